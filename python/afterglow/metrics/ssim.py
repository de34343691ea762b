# SPDX-License-Identifier: GPL-3.0-or-later
"""MS-SSIM after Wang, Simoncelli and Bovik, "Multiscale structural similarity for image quality assessment" (2003).

Contrast and structure at five scales, luminance at the coarsest, an 11 × 11 Gaussian window of σ = 1.5, on the luma of the
displayed image. Images too small for five scales use fewer, their exponents scaled to the same sum.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..images import to_display
from .error import LUMA, Array, exposure, rgb

WEIGHTS = (0.0448, 0.2856, 0.3001, 0.2363, 0.1333)
WINDOW, SIGMA = 11, 1.5


def _blur(image: Array) -> Array:
    """Gaussian window at every place where it fits wholly."""
    offsets = np.arange(WINDOW) - WINDOW // 2
    kernel = np.exp(-(offsets**2) / (2 * SIGMA**2))
    kernel /= kernel.sum()
    rows = np.lib.stride_tricks.sliding_window_view(image, WINDOW, 0) @ kernel
    return np.lib.stride_tricks.sliding_window_view(rows, WINDOW, 1) @ kernel


def _similarity(x: Array, y: Array) -> tuple[float, float]:
    """Mean luminance term and mean contrast-structure term of one scale."""
    c1, c2 = 0.01**2, 0.03**2
    mx, my = _blur(x), _blur(y)
    vx, vy, cov = _blur(x * x) - mx * mx, _blur(y * y) - my * my, _blur(x * y) - mx * my
    structure = (2 * cov + c2) / (vx + vy + c2)
    light = (2 * mx * my + c1) / (mx * mx + my * my + c1)
    return float((light * structure).mean()), float(structure.mean())


def ms_ssim(image: Any, reference: Any, scale: float | None = None) -> float:
    """1: equal. scale: exposure before display (None: `exposure(reference)`)."""
    scale = exposure(reference) if scale is None else scale
    x = to_display(rgb(image) * scale).astype(np.float64) @ LUMA
    y = to_display(rgb(reference) * scale).astype(np.float64) @ LUMA
    if x.shape != y.shape:
        raise ValueError(f"image {x.shape} and reference {y.shape} differ in size")
    if min(x.shape) < WINDOW:
        raise ValueError(f"MS-SSIM takes an image of {WINDOW} × {WINDOW} pixels or more")
    levels = min(len(WEIGHTS), 1 + int(np.log2(min(x.shape) / WINDOW)))
    weights = np.array(WEIGHTS[:levels]) * sum(WEIGHTS) / sum(WEIGHTS[:levels])
    result = 1.0
    for level, weight in enumerate(weights):
        whole, structure = _similarity(x, y)
        result *= max(0.0, whole if level == levels - 1 else structure) ** weight
        height, width = x.shape[0] // 2 * 2, x.shape[1] // 2 * 2
        x, y = (v[:height, :width].reshape(height // 2, 2, width // 2, 2).mean((1, 3)) for v in (x, y))
    return float(result)
