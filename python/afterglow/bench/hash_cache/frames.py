# SPDX-License-Identifier: GPL-3.0-or-later
"""A camera's path through the kitchen, in Blender: all frames by HashCache, its cells warmed by the frames before."""

from __future__ import annotations

from ..animation import LAST, Animation
from ..animation import measure as measure_animation
from ..figure import Context, Figure
from . import walk

# As the add-on's preset for animations in which the camera moves.
WALK = Animation(
    "the camera walks", {"op": "walk", "stride": walk.STRIDE},
    {"method": "HASH_CACHE", "samples": 1, "accuracy": 0.0, "denoise": True, "hash_extra": 3.0, "hash_resolution": 0.35,
     "hash_first": 4},
    rival_samples=16, error=0.005, sooner=10, reference_samples=128, frames=range(1, LAST + 1))


def measure(context: Context) -> list[Figure]:
    return measure_animation(context, WALK)
