# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's images as sources of `Scene.add_image`: files, packed files, tiles, sequences, pixels that live in memory only."""
from __future__ import annotations

import os
from typing import Any

import bpy
import numpy as np

COLORSPACES = {"sRGB": "sRGB", "Linear": "linear", "Linear Rec.709": "linear", "Non-Color": "non-color",
               "Non-Colour Data": "non-color", "Raw": "non-color"}
ALPHA = {"STRAIGHT": "straight", "PREMUL": "premultiplied", "CHANNEL_PACKED": "channel_packed", "NONE": "none"}
MAX_PIXELS = 1 << 28


def colorspace_of(image: Any) -> str:
    name = image.colorspace_settings.name
    if getattr(image.colorspace_settings, "is_data", False):
        return "non-color"
    return COLORSPACES.get(name, name)


def signature(image: Any, frame: int) -> tuple[Any, ...]:
    """What a source was made from: as long as it stays the same and Blender reports no edit, the image does."""
    packed = tuple((item.filepath, item.size) for item in getattr(image, "packed_files", ()) if hasattr(item, "size"))
    tiles = tuple(tile.number for tile in image.tiles) if image.source == "TILED" else ()
    return (image.source, image.filepath_raw, image.colorspace_settings.name, image.alpha_mode, packed, tiles,
            image.source == "FILE" and image.is_dirty, frame if image.source in {"SEQUENCE", "MOVIE"} else 0,
            tuple(image.size) if image.source in {"GENERATED", "VIEWER"} else (),
            (image.generated_type, tuple(image.generated_color)) if image.source == "GENERATED" else ())


def absolute(image: Any, path: str) -> str:
    return bpy.path.abspath(path, library=image.library)


def read_image(image: Any, image_user: Any = None) -> tuple[Any, dict[str, str]] | None:
    """(source, keyword arguments) for `Scene.add_image`; None: there is no such image."""
    options = {"name": image.name, "colorspace": colorspace_of(image), "alpha": ALPHA.get(image.alpha_mode, "straight")}
    if image.source in {"GENERATED", "VIEWER", "MOVIE"} or (image.source == "FILE" and image.is_dirty):
        return _pixels(image, options)
    if image.source == "TILED":
        tiles = _tiles(image)
        return (tiles, options) if tiles else None
    if image.source == "SEQUENCE":
        path = image.filepath_from_user(image_user=image_user) if image_user is not None else absolute(image, image.filepath)
        return (path, options) if os.path.isfile(path) else None
    if image.packed_file is not None and image.packed_file.size:
        return image.packed_file.data, options
    path = absolute(image, image.filepath)
    return (path, options) if os.path.isfile(path) else None


def _tiles(image: Any) -> dict[int, Any]:
    packed = {os.path.basename(item.filepath): item.packed_file for item in image.packed_files}
    pattern, tiles = absolute(image, image.filepath), {}
    for tile in image.tiles:
        index = tile.number - 1001
        path = pattern.replace("<UDIM>", str(tile.number)).replace("<UVTILE>", f"u{index % 10 + 1}_v{index // 10 + 1}")
        inner = packed.get(os.path.basename(path))
        if inner is not None and inner.size:
            tiles[tile.number] = inner.data
        elif os.path.isfile(path):
            tiles[tile.number] = path
    return tiles


def _pixels(image: Any, options: dict[str, str]) -> tuple[Any, dict[str, str]] | None:
    """Pixels as Blender holds them: bytes in the image's own colour space, floats scene-linear and premultiplied."""
    width, height = image.size
    channels = image.channels or 4
    if not width or not height or width * height > MAX_PIXELS:
        return None
    values = np.empty(width * height * channels, np.float32)
    image.pixels.foreach_get(values)
    values = values.reshape(height, width, channels)
    if not image.is_float:
        return np.rint(values * 255.0).astype(np.uint8), options
    if options["colorspace"] != "non-color":
        options["colorspace"] = "linear"
    if options["alpha"] == "straight":
        options["alpha"] = "premultiplied"
    return values, options
