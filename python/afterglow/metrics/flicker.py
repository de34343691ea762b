# SPDX-License-Identifier: GPL-3.0-or-later
"""Flicker: what changes between neighbouring frames and should not.

Of a still view all change is flicker: mean |a − b| over the reference's mean. Of a moving one the reference moves, too:
with two independent references of both frames, √max(0, mean((Δx − Δr₁)(Δx − Δr₂))) / mean(r) is free of their noise.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np

from .error import Estimate, block_error, rgb


def still_flicker(frames: Sequence[Any], reference: Any) -> Estimate:
    """Mean over neighbouring pairs of frames, and the standard error of that mean over the pairs."""
    images = [rgb(frame) for frame in frames]
    if len(images) < 2:
        raise ValueError("flicker takes two frames or more")
    level = rgb(reference).mean()
    steps = np.array([np.abs(a - b).mean() / level for a, b in itertools.pairwise(images)])
    return Estimate(float(steps.mean()), float(steps.std(ddof=1) / len(steps) ** 0.5) if len(steps) > 1 else float("nan"))


def moving_flicker(frames: tuple[Any, Any], first: tuple[Any, Any], second: tuple[Any, Any]) -> Estimate:
    """frames: two neighbouring ones; first, second: independent references of the same two. Error bar from pixel blocks."""
    change = rgb(frames[1]) - rgb(frames[0])
    one, two = rgb(first[1]) - rgb(first[0]), rgb(second[1]) - rgb(second[0])
    level = np.mean([rgb(image).mean() for image in (*first, *second)])
    product = (change - one) * (change - two)
    square, error = max(0.0, float(product.mean())), block_error(product)
    value = square**0.5
    # d√s = ds / (2√s); where the square is lost in its own error, the root of the error bounds it.
    return Estimate(float(value / level), float((error / (2 * value) if square > error else error**0.5) / level))
