# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads and writes images, row 0 at the bottom as everywhere in Afterglow, through OpenImageIO's Python module.

Where that module is absent, PNG is written by the standard library alone and EXR goes through the native module.
"""

from __future__ import annotations

import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float32]


def _openimageio() -> Any:
    try:
        import OpenImageIO
    except ImportError:
        return None
    return OpenImageIO


def _failed(path: Any, reason: str) -> OSError:
    return OSError(f"{path}: {reason or 'not an image that can be read'}")


def layers(path: str | Path) -> dict[str, Array]:
    """Every layer or pass of a file: name → (height, width, channels). A plain RGB(A) image is the layer "combined".

    Names of a multilayer EXR by Blender ("ViewLayer.DiffDir.R", or channel sets in parts) lose the view layer's name.
    """
    oiio = _openimageio()
    if oiio is None:
        return {"combined": read(path)}
    source = oiio.ImageInput.open(str(path))
    if source is None:
        raise _failed(path, oiio.geterror())
    result: dict[str, Array] = {}
    part = 0
    while source.seek_subimage(part, 0):
        spec = source.spec()
        pixels = np.asarray(source.read_image(part, 0, 0, spec.nchannels, oiio.FLOAT), np.float32)
        groups: dict[str, list[int]] = {}
        for index, channel in enumerate(spec.channelnames):
            path_of, _, _ = channel.rpartition(".")
            name = path_of.split(".", 1)[1] if "." in path_of else path_of
            groups.setdefault(name or "combined", []).append(index)
        for name, indices in groups.items():
            order = sorted(indices, key=lambda i: ("RGBXYZUVA".find(spec.channelnames[i][-1].upper()), i))
            result.setdefault("combined" if name == "Combined" else name,
                              pixels.reshape(spec.height, spec.width, -1)[::-1, :, order])
        part += 1
    source.close()
    return {name: np.ascontiguousarray(pixels) for name, pixels in result.items()}


def read(path: str | Path) -> Array:
    """The image of a file, (height, width, channels) float32: of a multilayer EXR the combined pass.

    8- and 16-bit files give their encoded values from 0 to 1.
    """
    oiio = _openimageio()
    if oiio is not None:
        found = layers(path)
        if "combined" in found:
            return found["combined"]
        raise _failed(path, f"holds no combined pass, only {', '.join(found)}")
    from . import _native

    reader = getattr(_native, "read_image", None)
    if reader is None:
        raise _failed(path, "reading images needs the Python module OpenImageIO (Debian: python3-openimageio)")
    return np.asarray(reader(str(path)), np.float32)


def write(path: str | Path, pixels: Any) -> None:
    """Writes float EXR by the name's end, else 8-bit: scene-linear light encoded as sRGB. Alpha stays as it is."""
    data = np.asarray(pixels, np.float32)
    if data.ndim == 2:
        data = data[..., None]
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    linear = path.suffix.lower() in (".exr", ".hdr")
    if not linear:
        color = data if data.shape[2] != 2 else data[..., :1]
        encoded = to_display(color[..., :3]) if color.shape[2] >= 3 else to_display(color)
        data = np.concatenate([encoded, np.clip(data[..., 3:4], 0, 1)], -1) if data.shape[2] == 4 else encoded
    if path.suffix.lower() == ".png":
        _write_png(path, np.round(data[::-1] * 255).astype(np.uint8))
        return
    oiio = _openimageio()
    if oiio is None:
        from . import _native

        writer = getattr(_native, "write_image", None)
        if writer is None:
            raise _failed(path, "writing this format needs the Python module OpenImageIO (Debian: python3-openimageio)")
        writer(str(path), np.ascontiguousarray(data))
        return
    output = oiio.ImageOutput.create(str(path))
    if output is None:
        raise _failed(path, oiio.geterror())
    height, width, channels = data.shape
    spec = oiio.ImageSpec(width, height, channels, oiio.FLOAT if linear else oiio.UINT8)
    if not output.open(str(path), spec) or not output.write_image(np.ascontiguousarray(data[::-1])):
        raise _failed(path, output.geterror())
    output.close()


def to_display(linear: Any) -> Array:
    """Scene-linear light to sRGB-encoded values from 0 to 1; what is not finite becomes 0."""
    x = np.clip(np.nan_to_num(np.asarray(linear, np.float32), nan=0.0, posinf=1.0, neginf=0.0), 0.0, 1.0)
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * np.power(np.maximum(x, 1e-8), 1 / 2.4) - 0.055).astype(np.float32)


def from_display(encoded: Any) -> Array:
    """The inverse of `to_display` on its range."""
    x = np.asarray(encoded, np.float32)
    return np.where(x <= 0.04045, x / 12.92, np.power((np.maximum(x, 0) + 0.055) / 1.055, 2.4)).astype(np.float32)


def _write_png(path: Path, pixels: NDArray[np.uint8]) -> None:
    height, width, channels = pixels.shape
    kind = {1: 0, 3: 2, 4: 6}[channels]
    rows = np.concatenate([np.zeros((height, 1), np.uint8), pixels.reshape(height, -1)], 1)

    def chunk(tag: bytes, body: bytes) -> bytes:
        return struct.pack(">I", len(body)) + tag + body + struct.pack(">I", zlib.crc32(tag + body))

    header = struct.pack(">IIBBBBB", width, height, 8, kind, 0, 0, 0)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"sRGB", b"\0")
                     + chunk(b"IDAT", zlib.compress(rows.tobytes(), 6)) + chunk(b"IEND", b""))
