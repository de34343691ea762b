# SPDX-License-Identifier: GPL-3.0-or-later
"""relMSE: the mean of (x − r)² / (r² + 0.01) over pixels and channels, exposed so that the reference's mean luminance is 0.5.

The estimate from independent parts of a reference is free of the reference's own noise: for parts rᵢ the product
(x − rᵢ)(x − rⱼ), i ≠ j, has the expectation (x − r)², as the noises of the two parts are independent.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
LUMA = np.array([0.2126, 0.7152, 0.0722])
FLOOR = 0.01


class Estimate(NamedTuple):
    """A value and the standard error that it is known with."""

    value: float
    error: float


def rgb(image: Any) -> Array:
    """The first three channels as float64."""
    pixels = np.asarray(image, np.float64)
    if pixels.ndim != 3 or pixels.shape[2] < 3:
        raise ValueError(f"an image has the shape (height, width, 3 or more), this one {pixels.shape}")
    return pixels[..., :3]


def luminance(image: Any) -> Array:
    """Rec. 709 luminance, (height, width)."""
    return rgb(image) @ LUMA


def exposure(reference: Any) -> float:
    """The factor that brings the reference's mean luminance to 0.5; 1 for a black one."""
    mean = float(luminance(reference).mean())
    return 0.5 / mean if mean > 0 else 1.0


def _pair(image: Any, reference: Any) -> tuple[Array, Array]:
    x, r = rgb(image), rgb(reference)
    if x.shape != r.shape:
        raise ValueError(f"image {x.shape[1]}×{x.shape[0]} and reference {r.shape[1]}×{r.shape[0]} differ in size")
    scale = exposure(r)
    return np.where(np.isfinite(x).all(-1, keepdims=True), x, 0.0) * scale, r * scale


def relmse(image: Any, reference: Any) -> float:
    """Non-finite pixels of the image count as black."""
    x, r = _pair(image, reference)
    return float(((x - r) ** 2 / (r**2 + FLOOR)).mean())


def trimmed_relmse(image: Any, reference: Any, share: float = 0.001) -> float:
    """The same without the worst `share` of the pixels."""
    x, r = _pair(image, reference)
    error = np.sort(((x - r) ** 2 / (r**2 + FLOOR)).mean(-1).ravel())
    return float(error[: int(len(error) * (1 - share))].mean())


def mean_ratio(image: Any, reference: Any) -> float:
    """Mean luminance of the image over that of the reference."""
    return float(luminance(image).mean() / luminance(reference).mean())


def halves_relmse(image: Any, parts: Sequence[Any]) -> Estimate:
    """relMSE against the mean of two or more independent parts of a reference, free of its noise; with its standard error.

    Each pair's product is weighted by the other parts' mean where there are four or more: were the pair in its own weight,
    its noise would come back through it. The error is that of a U-statistic over the parts, with two or three parts from
    16 × 16 blocks of pixels. An estimate of a small error may be negative: it is not cut.
    """
    stack = np.stack([rgb(part) for part in parts])
    count = len(stack)
    if count < 2:
        raise ValueError("an unbiased estimate takes two independent parts of a reference or more")
    total = stack.sum(0)
    scale = exposure(total / count)
    difference, stack, total = (rgb(image) - stack) * scale, stack * scale, total * scale
    pairs = np.zeros((count, count))
    pixels = np.zeros(total.shape)
    for i in range(count):
        for j in range(i):
            weight = (total - stack[i] - stack[j]) / (count - 2) if count >= 4 else total / count
            product = difference[i] * difference[j] / (weight**2 + FLOOR)
            pairs[i, j] = pairs[j, i] = product.mean()
            pixels += product
    value = float(pairs.sum() / (count * (count - 1)))
    if count < 4:
        return Estimate(value, block_error(pixels * 2 / (count * (count - 1))))
    by_part = pairs.sum(1) / (count - 1)
    return Estimate(value, float(2 * by_part.std(ddof=1) / count**0.5))


def block_error(pixels: Array, size: int = 16) -> float:
    """Standard error of the mean of a map, from the means of its blocks: neighbours need not be independent."""
    height, width = pixels.shape[0] // size * size, pixels.shape[1] // size * size
    if height == 0 or width == 0 or height * width == size * size:
        return float(pixels.std() / max(1, pixels.shape[0] * pixels.shape[1] - 1) ** 0.5)
    blocks = pixels[:height, :width].reshape(height // size, size, width // size, size, -1).mean((1, 3, 4)).ravel()
    return float(blocks.std(ddof=1) / len(blocks) ** 0.5)
