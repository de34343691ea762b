# SPDX-License-Identifier: GPL-3.0-or-later
"""Rays of the cameras: where they go, how they are clipped, where the lens lets them cross, and their differentials."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from test_scene import at, square

WIDTH, HEIGHT = 64, 48
UNMOVED = np.eye(4)


@pytest.fixture(scope="module")
def ag(library):
    import afterglow

    return afterglow


def rays(ag: Any, kind: str, pixels: Any, lens: Any = None, matrix: np.ndarray = UNMOVED, **camera: Any) -> dict[str, Any]:
    scene = ag.Scene()
    scene.set_camera(kind, matrix, **({"window": (-0.8, 0.8, -0.6, 0.6)} | camera))
    scene.commit()
    pixels = np.atleast_2d(np.asarray(pixels, np.float32))
    lens = np.zeros_like(pixels) + 0.5 if lens is None else np.asarray(lens, np.float32)
    return scene.camera_rays(pixels, lens, WIDTH, HEIGHT)


def places(n: int = 500) -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(4)
    return random.random((n, 2)) * [WIDTH, HEIGHT], random.random((n, 2))


def test_perspective(ag) -> None:
    found = rays(ag, "perspective", [[0, 0], [WIDTH, HEIGHT], [WIDTH / 2, HEIGHT / 2]])
    expected = np.array([[-0.8, -0.6, -1], [0.8, 0.6, -1], [0, 0, -1]])
    assert np.allclose(found["direction"], expected / np.linalg.norm(expected, axis=1, keepdims=True), atol=1e-6)
    assert (found["origin"] == 0).all()


def test_scale_of_the_camera_object_does_not_matter(ag) -> None:
    turn = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))[0]
    matrix, scaled = np.eye(4), np.eye(4)
    matrix[:3, :3], scaled[:3, :3] = turn, turn * [3.0, 0.5, 2.0]
    pixels, lens = places(50)
    for kind in ("perspective", "orthographic"):
        a, b = (rays(ag, kind, pixels, lens, m, aperture_radius=0.1, focus_distance=3.0) for m in (matrix, scaled))
        for name in a:
            assert np.allclose(a[name], b[name], atol=1e-6)


def test_shifted_window(ag) -> None:
    found = rays(ag, "perspective", [[WIDTH / 2, HEIGHT / 2]], window=(0.0, 1.0, 0.5, 1.5))
    assert np.allclose(found["direction"], [np.array([0.5, 1.0, -1.0]) / 1.5], atol=1e-6)


def test_clipping_is_between_planes(ag) -> None:
    pixels, _ = places()
    found = rays(ag, "perspective", pixels, clip=(0.5, 20.0))
    for column, plane in ((0, 0.5), (1, 20.0)):
        assert np.allclose(-found["direction"][:, 2] * found["range"][:, column], plane, rtol=1e-5)
    panorama = rays(ag, "panorama", pixels, clip=(0.5, 20.0), panorama=(-3.0, 3.0, -1.0, 1.0))
    assert (panorama["range"] == [0.5, 20.0]).all()


def test_orthographic(ag) -> None:
    found = rays(ag, "orthographic", [[0, 0], [WIDTH, HEIGHT / 2]], window=(-4, 4, -3, 3), matrix=at(1, 2, 3))
    assert np.allclose(found["direction"], [[0, 0, -1]] * 2)
    assert np.allclose(found["origin"], [[-3, -1, 3], [5, 2, 3]])
    assert np.allclose(found["origin_dx"], [[8 / WIDTH, 0, 0]] * 2) and (found["direction_dx"] == 0).all()


def test_panorama(ag) -> None:
    full = (-np.pi, np.pi, -np.pi / 2, np.pi / 2)
    found = rays(ag, "panorama", [[WIDTH / 2, HEIGHT / 2], [WIDTH * 0.75, HEIGHT / 2], [WIDTH / 2, HEIGHT], [0, HEIGHT / 2]],
                 panorama=full)["direction"]
    assert np.allclose(found, [[0, 0, -1], [1, 0, 0], [0, 1, 0], [0, 0, 1]], atol=1e-6)


def test_the_lens_focuses_on_a_plane(ag) -> None:
    pixels, lens = places()
    for kind in ("perspective", "orthographic"):
        wide = rays(ag, kind, pixels, lens, aperture_radius=0.3, focus_distance=4.0)
        sharp = rays(ag, kind, pixels)
        for found in (wide, sharp):
            assert np.allclose(np.linalg.norm(found["direction"], axis=1), 1.0, atol=1e-6)
        meet = [f["origin"] + f["direction"] * (4.0 / -f["direction"][:, 2:]) for f in (wide, sharp)]
        assert np.allclose(meet[0], meet[1], atol=1e-5)
        assert 0.25 < np.linalg.norm(wide["origin"] - sharp["origin"], axis=1).max() <= 0.3 + 1e-6


@pytest.mark.parametrize("blades", [0, 3, 6])
def test_the_lens_is_covered_evenly(ag, blades: int) -> None:
    """The mean of x² + y² is r²/2 over a disk and r² (2 + cos(2π/n)) / 6 over a regular polygon with n corners."""
    n = 1 << 14
    lens = np.random.default_rng(1).random((n, 2))
    found = rays(ag, "perspective", np.full((n, 2), 20.0), lens, aperture_radius=1.0, aperture_blades=blades,
                 aperture_rotation=0.3)["origin"][:, :2]
    mean = 0.5 if blades == 0 else (2.0 + np.cos(2 * np.pi / blades)) / 6.0
    square_radius = (found ** 2).sum(axis=1)
    assert abs(square_radius.mean() - mean) < 5.0 * square_radius.std() / np.sqrt(n)
    assert np.all(np.abs(found.mean(axis=0)) < 5.0 * found.std(axis=0) / np.sqrt(n))
    ratio = rays(ag, "perspective", np.full((n, 2), 20.0), lens, aperture_radius=1.0, aperture_ratio=2.0)["origin"]
    assert abs(np.abs(ratio[:, 0]).max() - 0.5) < 0.02 and abs(np.abs(ratio[:, 1]).max() - 1.0) < 0.02


@pytest.mark.parametrize("kind", ["perspective", "orthographic", "panorama"])
def test_differentials_are_the_neighbouring_pixels_difference(ag, kind: str) -> None:
    pixels, _ = places(100)
    more = {"panorama": (-2.0, 2.0, -1.0, 1.0)}
    here = rays(ag, kind, pixels, **more)
    for axis, name in enumerate(("dx", "dy")):
        step = np.zeros(2)
        step[axis] = 0.5
        ahead, behind = (rays(ag, kind, pixels + s, **more) for s in (step, -step))
        for of in ("origin", "direction"):
            difference = ahead[of].astype(float) - behind[of]
            scale = max(np.abs(difference).max(), 1e-9)
            assert np.abs(here[f"{of}_{name}"] - difference).max() < 0.05 * scale


def test_a_far_camera_is_as_precise_as_its_scene(ag) -> None:
    scene = ag.Scene()
    scene.add_instances(square(scene), at(1e7, -1e7, 1e6), name="o")
    scene.set_camera("perspective", at(1e7 + 0.25, -1e7 + 0.5, 1e6 + 3.0), window=(-1, 1, -1, 1))
    scene.commit()
    found = scene.camera_rays(np.full((1, 2), 24.0, np.float32), np.full((1, 2), 0.5, np.float32), 48, 48)
    assert np.allclose(found["origin"][0] + np.array(scene.origin), [1e7 + 0.25, -1e7 + 0.5, 1e6 + 3.0], atol=1e-5)


def test_strange_lenses_are_no_lenses(ag) -> None:
    pixels, lens = places(20)
    for strange in ({"aperture_radius": 0.0}, {"aperture_radius": 0.5, "focus_distance": 0.0}):
        assert (rays(ag, "perspective", pixels, lens, **strange)["origin"] == 0).all()
