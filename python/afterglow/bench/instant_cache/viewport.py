# SPDX-License-Identifier: GPL-3.0-or-later
"""From the move of the kitchen's cooker to the first image of the new state with bounced light, and until the view rests: seen
from outside a real window of 800 × 600 pixels under Xvfb."""

from __future__ import annotations

import shutil
import statistics
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ... import __version__, blenders, cache, images, metrics
from ..figure import Context, Figure, spread_of_median
from ..foundation.kitchen import PERCENT, scene
from ..foundation.viewport import OBJECT, STEP, Watched, first_image, watch

CACHED = ("method=INSTANT_CACHE",)
AS_VIEWPORT = {"light_compensation": 16, "light_bound": 4.0, "virtual_lights": 320}  # what the add-on makes of its defaults
REFERENCE_SAMPLES = 256
SETTLED = 24  # samples a pixel: about as many as the window has when it is looked at last
RESTS = 0.005  # mean difference of display values to the settled image


def rests_after(watched: Watched) -> float:
    """The last time that the picture was further from the settled one than RESTS."""
    final = watched.pictures[-1]
    pairs = zip(watched.seconds, watched.pictures)
    far = [seconds for seconds, picture in pairs if float(np.abs(picture - final).mean()) > RESTS]
    return max(far, default=0.0)


def edited(worker: blenders.Worker) -> None:
    """Opens the kitchen; its first frame is the state before the edit, its second the one after."""
    worker.open(scene()[0], PERCENT)
    worker.job("animate", object=OBJECT, step=float(STEP), last=2)


def references(worker: blenders.Worker) -> list[NDArray[np.float32]]:
    """Two independent halves of the state after the edit, by path tracing."""
    halves = []
    for seed in (1001, 1002):
        key = {"kind": "kitchen_edited", "file": cache.file_key(scene()[0]), "percent": PERCENT, "blender": worker.version,
               "object": OBJECT, "step": STEP, "samples": REFERENCE_SAMPLES, "seed": seed, "version": __version__}

        def trace(seed: int = seed) -> dict[str, Any]:
            edited(worker)
            answer = worker.frames("AFTERGLOW", (2,), method="PATH_TRACING", samples=REFERENCE_SAMPLES, accuracy=0.0, seed=seed)
            return {"image": images.read(answer["images"][0])}

        halves.append(np.asarray(cache.arrays(key, trace)["image"]))
    return halves


def settled_error() -> metrics.Estimate:
    """relMSE of a settled picture against path tracing. The screen holds display values of eight bits, so that the picture is not
    the window's: it is a final render of the state after the edit with the viewport's settings, at 640 × 360, by the kitchen's
    camera. The state before the edit is rendered first, with persistent data: the cache is repaired and samples are kept, settled
    and smoothed, as in the window."""
    with blenders.Worker.of_debian() as worker:
        truth = references(worker)
        edited(worker)
        answer = worker.frames("AFTERGLOW", (1, 2), method="INSTANT_CACHE", samples=SETTLED, accuracy=0.0, seed=0, **AS_VIEWPORT)
        return metrics.halves_relmse(images.read(answer["images"][1]), truth)


def measure(context: Context) -> list[Figure]:
    if shutil.which("Xvfb") is None:
        raise blenders.Unavailable("Xvfb is absent: a window cannot be opened (Debian: xvfb)")
    watch("AFTERGLOW", CACHED)  # shaders and pages are cached now
    seen = [watch("AFTERGLOW", CACHED) for _ in range(max(3, context.pairs))]
    first, rest = [first_image(w) for w in seen], [rests_after(w) for w in seen]
    where, settled = "country_kitchen 800×600", settled_error()
    return [
        Figure("edit to first image with bounced light", where, 1e3 * statistics.median(first), "ms", "Cycles 3.4.1, coarse",
               130.0, None, "≤ 300", spread=1e3 * spread_of_median(first), details={"seconds": first}).judged(),
        Figure("edit to within 0.005 of the settled image", where, statistics.median(rest), "s",
               "Cycles 3.4.1: not in 40 s", None, None, "≤ 1", spread=spread_of_median(rest), details={"seconds": rest}).judged(),
        Figure("relMSE of the settled image", "country_kitchen 640×360, after the edit", settled.value, "",
               f"path tracing, 2 × {REFERENCE_SAMPLES} spp", None, None, "≤ 0.02", spread=settled.error,
               note="a final render with the viewport's settings").judged(),
    ]
