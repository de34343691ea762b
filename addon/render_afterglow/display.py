# SPDX-License-Identifier: GPL-3.0-or-later
"""Pixels on their way to Blender: pass rectangles of a final render, a texture of the viewport.

Both take float32 arrays with row 0 at the bottom, scene-linear, as the native session gives them.
"""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

_flat_rectangles: bool | None = None


def write_pass(render_pass: bpy.types.RenderPass, pixels: np.ndarray) -> None:
    """Copies (height, width, channels) pixels into a pass. Blender before 4.0 wants (pixels, channels), later ones a
    flat array; which of them is found out once."""
    global _flat_rectangles
    channels = render_pass.channels
    if pixels.ndim == 2:
        pixels = pixels[:, :, None]
    if pixels.shape[2] != channels:
        fitted = np.zeros((*pixels.shape[:2], channels), np.float32)
        count = min(channels, pixels.shape[2])
        fitted[:, :, :count] = pixels[:, :, :count]
        pixels = fitted
    table = np.ascontiguousarray(pixels, np.float32).reshape(-1, channels)
    if _flat_rectangles is None:
        try:
            render_pass.rect.foreach_set(table.reshape(-1))
            _flat_rectangles = True
        except (TypeError, ValueError, RuntimeError):
            render_pass.rect.foreach_set(table)
            _flat_rectangles = False
    else:
        render_pass.rect.foreach_set(table.reshape(-1) if _flat_rectangles else table)


class Picture:
    """The viewport's picture: an array that the session writes into, and the texture that is drawn.

    The array is the memory of a `gpu.types.Buffer`, so an upload makes no copy in Python.
    """

    def __init__(self, width: int, height: int) -> None:
        import gpu

        self.width, self.height = width, height
        self.pixels = np.zeros((height, width, 4), np.float32)
        self._buffer: Any = gpu.types.Buffer("FLOAT", width * height * 4, self.pixels.reshape(-1))
        self._texture: Any = None

    def upload(self) -> None:
        import gpu

        self._texture = gpu.types.GPUTexture((self.width, self.height), format="RGBA16F", data=self._buffer)

    def draw(self, x: float, y: float, width: float, height: float) -> None:
        """Draws the picture over a rectangle of the region, in pixels. Values are scene-linear: Blender's viewport
        turns them into display values afterwards."""
        if self._texture is None:
            return
        import gpu
        from gpu_extras.presets import draw_texture_2d

        gpu.state.blend_set("ALPHA_PREMULT")
        draw_texture_2d(self._texture, (x, y), width, height)
        gpu.state.blend_set("NONE")
