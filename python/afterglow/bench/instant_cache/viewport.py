# SPDX-License-Identifier: GPL-3.0-or-later
"""From the move of the kitchen's cooker to the first image of the new state with bounced light, and until the view rests: seen
from outside a real window of 800 × 600 pixels under Xvfb."""

from __future__ import annotations

import shutil
import statistics

import numpy as np

from ... import blenders, images, metrics
from ..figure import Context, Figure, spread_of_median
from ..foundation.kitchen import PERCENT, scene
from ..foundation.viewport import Watched, first_image, watch

CACHED = ("method=INSTANT_CACHE",)
AS_VIEWPORT = {"light_compensation": 16, "light_bound": 4.0, "virtual_lights": 320}  # what the add-on makes of its defaults
SETTLED = 24  # samples a pixel: about as many as the window has when it is looked at last
RESTS = 0.005  # mean difference of display values to the settled image


def rests_after(watched: Watched) -> float:
    """The last time that the picture was further from the settled one than RESTS."""
    final = watched.pictures[-1]
    pairs = zip(watched.seconds, watched.pictures)
    far = [seconds for seconds, picture in pairs if float(np.abs(picture - final).mean()) > RESTS]
    return max(far, default=0.0)


def settled_error() -> float:
    """relMSE of a settled picture against path tracing: the screen holds display values of eight bits, so that the same kept and
    smoothed samples are taken from a render of the kitchen's camera, with persistent data, which keep them."""
    file, reference = scene()
    with blenders.Worker.of_debian() as worker:
        worker.open(file, PERCENT)
        answer = worker.render("AFTERGLOW", method="INSTANT_CACHE", samples=SETTLED, accuracy=0.0, seed=0, persistent=True,
                               **AS_VIEWPORT)
        return metrics.relmse(images.read(answer["image"]), images.read(reference))


def measure(context: Context) -> list[Figure]:
    if shutil.which("Xvfb") is None:
        raise blenders.Unavailable("Xvfb is absent: a window cannot be opened (Debian: xvfb)")
    watch("AFTERGLOW", CACHED)  # shaders and pages are cached now
    seen = [watch("AFTERGLOW", CACHED) for _ in range(max(3, context.pairs))]
    first, rest = [first_image(w) for w in seen], [rests_after(w) for w in seen]
    where = "country_kitchen 800×600"
    return [
        Figure("edit to first image with bounced light", where, 1e3 * statistics.median(first), "ms", "Cycles 3.4.1, coarse",
               130.0, None, "≤ 300", spread=1e3 * spread_of_median(first), details={"seconds": first}).judged(),
        Figure("edit to within 0.005 of the settled image", where, statistics.median(rest), "s",
               "Cycles 3.4.1: not in 40 s", None, None, "≤ 1", spread=spread_of_median(rest), details={"seconds": rest}).judged(),
        Figure("relMSE of the settled image", "country_kitchen 640×360", settled_error(), "",
               "reference by Cycles, 2048 spp", None, None, "≤ 0.02").judged(),
    ]
