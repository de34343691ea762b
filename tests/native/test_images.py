# SPDX-License-Identifier: GPL-3.0-or-later
"""Images on a plane, seen straight on: filters, what lies outside, colour spaces, alpha, tiles, packed and missing files."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path
from typing import Any

import afterglow._native as native
import numpy as np
import pytest

RED, GREEN, BLUE, WHITE = (1.0, 0.0, 0.0, 1.0), (0.0, 1.0, 0.0, 1.0), (0.0, 0.0, 1.0, 1.0), (1.0, 1.0, 1.0, 1.0)
FOUR = np.array([[RED, GREEN], [BLUE, WHITE]], np.float32)  # row 0 at the bottom


def png(pixels: np.ndarray) -> bytes:
    """An 8-bit RGBA file; row 0 at the bottom becomes the last row of the file."""
    height, width, _ = pixels.shape
    rows = b"".join(b"\0" + pixels[y].astype(np.uint8).tobytes() for y in reversed(range(height)))

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    header = struct.pack(">IIBBBBB", width, height, 8, 6, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


def seen(source: Any, places: list[tuple[float, float]], *, output: str = "color", params: dict[str, Any] | None = None,
         **image: Any) -> tuple[np.ndarray, list[str]]:
    """The values of an Image Texture at places of UV space: a small quad of one UV for each, one pixel wide."""
    scene = native.Scene()
    handle = scene.add_image(source, name="picture", **image)
    texture = {"type": "image_texture", "name": "texture", "inputs": {},
               "params": {"image": handle, "interpolation": "closest", **(params or {})}}
    emission = {"type": "emission", "name": "emission", "params": {}, "inputs": {"color": ("link", 0, output)}}
    material = scene.add_material({"nodes": [texture, emission], "surface": ("link", 1, "shader")}, name="m")
    count = len(places)
    corners = [(x + dx, dy, 0.0) for x in range(count) for dx, dy in ((0, 0), (1, 0), (1, 1), (0, 1))]
    triangles = [(4 * k + a, 4 * k + b, 4 * k + c) for k in range(count) for a, b, c in ((0, 1, 2), (0, 2, 3))]
    uv = np.repeat(np.array(places, np.float32), 6, axis=0)
    mesh = scene.add_mesh(name="quads", positions=np.array(corners, np.float32), triangles=np.array(triangles, np.int32),
                          uvs={"UVMap": uv}, active_uv="UVMap")
    scene.add_instances(mesh, np.eye(4)[None], name="quads", materials=[material])
    camera = np.eye(4)
    camera[2, 3] = 5
    scene.set_camera("orthographic", camera, window=(0, count, 0, 1))
    warnings = scene.commit()["warnings"]
    session = native.Session(scene, {"width": count, "height": 1, "samples": 1, "pixel_filter": "BOX", "filter_width": 0.01})
    session.start()
    session.wait()
    return session.read("combined")[0, :, :3], warnings


CENTRES = [(0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.75, 0.75)]


@pytest.mark.parametrize("interpolation", ["closest", "linear"])
def test_texel_centres(interpolation: str) -> None:
    values, warnings = seen(FOUR, CENTRES, params={"interpolation": interpolation}, colorspace="linear")
    np.testing.assert_allclose(values, [RED[:3], GREEN[:3], BLUE[:3], WHITE[:3]], atol=1e-6)
    assert not warnings


def test_filters_between_texels() -> None:
    linear, _ = seen(FOUR, [(0.5, 0.25), (0.5, 0.5)], params={"interpolation": "linear"}, colorspace="linear")
    np.testing.assert_allclose(linear, [(0.5, 0.5, 0.0), (0.5, 0.5, 0.5)], atol=1e-5)
    flat, _ = seen(np.full((4, 4, 3), 0.3, np.float32), [(0.1, 0.9), (0.4, 0.6)], params={"interpolation": "cubic"},
                   colorspace="linear")
    np.testing.assert_allclose(flat, 0.3, rtol=1e-5)  # the weights sum to 1


@pytest.mark.parametrize(("extension", "expected"), [("repeat", RED), ("extend", GREEN), ("clip", (0.0, 0.0, 0.0)),
                                                     ("mirror", GREEN)])
def test_outside(extension: str, expected: tuple[float, ...]) -> None:
    values, _ = seen(FOUR, [(1.25, 0.25)], params={"extension": extension}, colorspace="linear")
    np.testing.assert_allclose(values[0], expected[:3], atol=1e-6)


def test_color_spaces_of_bytes() -> None:
    pixels = np.full((2, 2, 4), 128, np.uint8)
    pixels[..., 3] = 255
    encoded = 128 / 255
    linear = ((encoded + 0.055) / 1.055) ** 2.4
    for colorspace, expected in (("sRGB", linear), ("non-color", encoded), ("linear", encoded)):
        values, _ = seen(pixels, CENTRES[:1], colorspace=colorspace)
        np.testing.assert_allclose(values[0], expected, rtol=1e-4)
        packed, warnings = seen(png(pixels), CENTRES[:1], colorspace=colorspace)
        np.testing.assert_allclose(packed[0], expected, rtol=1e-4)
        assert not warnings


@pytest.mark.parametrize(("alpha", "color", "coverage"), [("straight", 0.4, 0.5), ("premultiplied", 0.8, 0.5),
                                                           ("channel_packed", 0.8, 0.5), ("none", 0.8, 1.0)])
def test_alpha(alpha: str, color: float, coverage: float) -> None:
    """Straight alpha multiplies the colour where alpha itself is not used, as Blender does it."""
    pixels = np.full((2, 2, 4), (0.8, 0.8, 0.8, 0.5), np.float32)
    np.testing.assert_allclose(seen(pixels, CENTRES[:1], alpha=alpha, colorspace="linear")[0][0], color, rtol=1e-5)
    np.testing.assert_allclose(seen(pixels, CENTRES[:1], alpha=alpha, output="alpha", colorspace="linear")[0][0], coverage,
                               rtol=1e-5)


def test_tiles() -> None:
    tiles = {1001: np.full((1, 1, 3), 0.1, np.float32), 1002: np.full((1, 1, 3), 0.2, np.float32),
             1011: np.full((1, 1, 3), 0.3, np.float32)}
    values, _ = seen(tiles, [(0.5, 0.5), (1.5, 0.5), (0.5, 1.5), (1.5, 1.5)], colorspace="linear")
    np.testing.assert_allclose(values[:3, 0], [0.1, 0.2, 0.3], rtol=1e-5)
    np.testing.assert_allclose(values[3], (1, 0, 1))  # no such tile


def test_missing_and_broken_files_are_magenta_and_told(tmp_path: Path) -> None:
    broken = tmp_path / "broken.png"
    broken.write_bytes(b"\x89PNG\r\n\x1a\n nothing of a picture")
    for source in (str(tmp_path / "absent.png"), str(broken), b"no picture at all", png(np.zeros((2, 2, 4), np.uint8))[:40]):
        values, warnings = seen(source, CENTRES[:1])
        np.testing.assert_allclose(values[0], (1, 0, 1))
        assert len(warnings) == 1 and "picture" in warnings[0], warnings


def test_a_file_on_disk(tmp_path: Path) -> None:
    path = tmp_path / "four.png"
    path.write_bytes(png(FOUR * 255))
    np.testing.assert_allclose(seen(str(path), CENTRES, colorspace="sRGB")[0],
                               [RED[:3], GREEN[:3], BLUE[:3], WHITE[:3]], atol=1e-6)


def test_places_that_are_no_numbers() -> None:
    values, _ = seen(FOUR, [(float("nan"), 0.5), (float("inf"), 0.5), (1e30, -1e30)], colorspace="linear",
                     params={"interpolation": "linear"})
    assert np.isfinite(values).all()
