# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's cameras and viewports as arguments of `Scene.set_camera`, image size and the region to render.

The window of a view is read back from the projection matrix that Blender itself would draw with, so that sensor fit, shift,
pixel aspect, camera zoom and passepartout need no arithmetic of their own here.
"""
from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any


@dataclass
class CameraView:
    """camera: keyword arguments of `Scene.set_camera`; width, height: the full image in pixels; region: x0, y0, x1, y1 of
    what is to be rendered, x1 and y1 exclusive, row 0 at the bottom; warnings: what the camera asks for and does not get."""

    camera: dict[str, Any]
    width: int
    height: int
    region: tuple[int, int, int, int]
    warnings: list[str] = field(default_factory=list)


def sync_camera_final(engine: Any, depsgraph: Any) -> CameraView | None:
    """The scene's (or the engine's overriding) camera at the render's resolution; None: the scene has no camera."""
    raise NotImplementedError


def sync_camera_view(depsgraph: Any, region: Any, rv3d: Any, space: Any, scale: float = 1.0) -> CameraView:
    """What a 3D viewport looks at. scale: rendered pixels for one pixel of the region (1/2: half the resolution)."""
    raise NotImplementedError
