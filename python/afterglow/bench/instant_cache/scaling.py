# SPDX-License-Identifier: GPL-3.0-or-later
"""What more lights, more triangles and more threads cost: the diffuse part of a first frame and of a repaired one."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable
from functools import partial
from typing import Any

from ... import scenes
from ...scenes import Description
from ..figure import Context, Figure
from .watched import Watched, bunnies

LIGHTS = (256, 1024, 4096)
DIVISIONS = (10, 30, 96)  # of nine bunnies: 11 k, 97 k and 1 M triangles


def diffuse(context: Context, make: Callable[[], Description], **settings: Any) -> tuple[float, float]:
    """Seconds of the first frame's diffuse part and of a repaired one's."""
    first, repaired = [], []
    for _ in range(max(2, context.pairs // 2)):
        watched = Watched(make, "INSTANT_CACHE", **settings)
        first.append(watched.frame().diffuse)
        watched.move_to(watched.built.description.frames[0] + 1)
        repaired.append(watched.frame().diffuse)
    return statistics.median(first), statistics.median(repaired)


def measure(context: Context) -> list[Figure]:
    lights = {n: diffuse(context, bunnies(1), virtual_lights=n) for n in LIGHTS}
    triangles = {12 * d * d * 9: diffuse(context, partial(scenes.SCENES["bouncing_bunnies"], 9, d, 1)) for d in DIVISIONS}
    threads = {n: diffuse(context, bunnies(1), threads=n) for n in (1, 2)}
    first, last = LIGHTS[0], LIGHTS[-1]
    power = math.log(lights[last][0] / lights[first][0]) / math.log(last / first)
    note = ("seconds of a first frame / of a repaired one. lights "
            + "; ".join(f"{n}: {a:.3f} / {b:.3f}" for n, (a, b) in lights.items()) + ". triangles "
            + "; ".join(f"{n}: {a:.3f} / {b:.3f}" for n, (a, b) in triangles.items()) + ". threads "
            + "; ".join(f"{n}: {a:.3f} / {b:.3f}" for n, (a, b) in threads.items()))
    return [Figure("cost of virtual lights, power of their number", "bunnies, 256 to 4096", power, goal="≤ 1", note=note,
                   details={"lights": lights, "triangles": triangles, "threads": threads}).judged()]
