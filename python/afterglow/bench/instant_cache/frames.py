# SPDX-License-Identifier: GPL-3.0-or-later
"""An animation of the kitchen in which the cooker moves."""

from __future__ import annotations

from ..animation import Animation
from ..animation import measure as measure_animation
from ..figure import Context, Figure
from ..foundation.viewport import OBJECT, STEP

# More lights and short rays bring the error down (2048 and 64: 0.02) and cost more time than the goal leaves.
COOKER = Animation(
    "the cooker moves", {"op": "animate", "object": OBJECT, "step": float(STEP)},
    {"method": "INSTANT_CACHE", "samples": 8, "accuracy": 0.0, "virtual_lights": 512, "light_compensation": 16},
    rival_samples=4, error=0.01, sooner=5)


def measure(context: Context) -> list[Figure]:
    return measure_animation(context, COOKER)
