# SPDX-License-Identifier: GPL-3.0-or-later
"""An animation of the kitchen in which the cooker moves: all frames, for each is made of what the ones before left."""

from __future__ import annotations

from ..animation import LAST, Animation
from ..animation import measure as measure_animation
from ..figure import Context, Figure
from ..foundation.viewport import OBJECT, STEP

# As the add-on's preset for animations in which objects move.
COOKER = Animation(
    "the cooker moves", {"op": "animate", "object": OBJECT, "step": float(STEP)},
    {"method": "INSTANT_CACHE", "samples": 4, "accuracy": 0.0, "denoise": True, "virtual_lights": 512, "light_compensation": 24,
     "light_bound": 4.0, "cache_first": 12},
    rival_samples=4, error=0.01, sooner=5, frames=range(1, LAST + 1))


def measure(context: Context) -> list[Figure]:
    return measure_animation(context, COOKER)
