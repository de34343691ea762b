# SPDX-License-Identifier: GPL-3.0-or-later
"""How far the cache is from instant radiosity, from itself filled anew, and from the path tracer."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ... import cache, metrics
from ..figure import Context, Figure
from .animations import FIRST, MOVING
from .watched import Watched

DIFFERENCE = ("cornell_statue", "wobbling_cylinder", "desk_with_chair", "bunnies", "cornell_mirror", "cornell_indirect",
              "conference_room", "pillared_hall", "office_with_blinds")
SMALL = {"width": 300, "height": 200, "pixel_filter": "BLACKMAN_HARRIS", "filter_width": 1.5, "caustics_reflective": False,
         "caustics_refractive": False}
REFERENCE_SAMPLES = 512
# Samples until the believed error is what a render accepts by default; as many as the office with blinds asks for.
ACCURACY, MOST_SAMPLES = 0.03, 4096
# accuracy of the cache, virtual lights, short rays, bound
LEVELS = {"default": (0.05, 256, 0, 2.0), "finer": (0.025, 2048, 16, 4.0), "finest": (0.0125, 16384, 64, 4.0)}


def picture(watched: Watched) -> NDArray[np.float32]:
    image: NDArray[np.float32] = watched.session.read()[..., :3].copy()
    return image


def difference(context: Context) -> list[Figure]:
    """Share of pixels that differ by more than 0.1 in FLIP, at the same lights and one sample a pixel. Instant radiosity asks all
    of its lights in every pixel: its interleaving would be seen as an error of the cache."""
    figures = []
    for name in DIFFERENCE:
        ours = picture(Watched(FIRST[name].make, "INSTANT_CACHE"))
        theirs = picture(Watched(FIRST[name].make, "INSTANT_RADIOSITY", interleave=False))
        share = float((metrics.flip_map(ours, theirs) > 0.1).mean())
        figures.append(Figure("pixels with FLIP above 0.1, IC against IGI", name, 100 * share, "%", goal="≤ 0.5",
                              note="paper: at most 0.33 % (HDR-VDP)",
                              details={"flip": metrics.flip(ours, theirs), "relmse": metrics.relmse(ours, theirs)}).judged())
    return figures


def after_edits(context: Context) -> list[Figure]:
    """Every record against a fresh one at its place, and the picture against that of a cache filled anew, after 20 frames for
    every pair asked for."""
    figures = []
    for name in ("desk_with_chair", "wobbling_cylinder", "bunnies_9"):
        make = MOVING[name].make
        start, last = make().frames[0], max(2, 20 * context.pairs)
        live = Watched(make, "INSTANT_CACHE")
        for frame in range(1, last):
            live.move_to(start + frame)
        live.again(cache_verify=True)
        worst = live.values()["verified_worst"]
        kept = picture(live)
        live.move_to(start + last - 1, anew=True)
        anew = picture(live)
        note = f"after {last - 1} frames"
        figures += [
            Figure("records after edits against fresh ones, relative", name, worst, goal="≤ 1e-5", note=note).judged(),
            Figure("mean FLIP of TIC against IC after edits", name, metrics.flip(kept, anew), goal="≤ 0.005", note=note).judged(),
        ]
    return figures


def reference(name: str) -> tuple[list[NDArray[np.float32]], float]:
    """Two independent halves by the path tracer."""

    def trace() -> dict[str, Any]:
        began = time.perf_counter()
        halves = [picture(Watched(FIRST[name].make, "PATH_TRACING", **SMALL, samples=REFERENCE_SAMPLES, seed=seed))
                  for seed in (1, 2)]
        return {"halves": np.stack(halves), "seconds": time.perf_counter() - began}

    from ... import __version__

    found = cache.arrays({"kind": "instant_cache_reference", "scene": name, "samples": REFERENCE_SAMPLES, "version": __version__,
                          "settings": str(SMALL)}, trace)
    return list(np.asarray(found["halves"])), float(found["seconds"])


def error(context: Context) -> list[Figure]:
    """relMSE against the path tracer by the time it took, at three settings of the cache, each with the samples that `accuracy`
    chooses; free of the reference's own noise."""
    figures = []
    for name in DIFFERENCE:
        truth, _ = reference(name)
        found = {}
        for level, (accuracy, lights, short, bound) in LEVELS.items():
            began = time.perf_counter()
            watched = Watched(FIRST[name].make, "INSTANT_CACHE", **SMALL, accuracy=ACCURACY, samples=MOST_SAMPLES,
                              cache_accuracy=accuracy, virtual_lights=lights, light_compensation=short, light_bound=bound)
            seconds = time.perf_counter() - began
            estimate = metrics.halves_relmse(picture(watched), truth)
            found[level] = {"seconds": seconds, "relmse": estimate.value, "error": estimate.error,
                            "samples": watched.session.statistics()["samples"]}
        errors = [found[level]["relmse"] for level in LEVELS]
        falls = errors == sorted(errors, reverse=True)
        figure = Figure("relMSE against path tracing, finest setting", name, found["finest"]["relmse"], goal="≤ 0.02",
                              spread=found["finest"]["error"],
                              note=", ".join(f"{k}: {v['relmse']:.4f} in {v['seconds']:.1f} s" for k, v in found.items())
                              + ("" if falls else "; the error does not fall"), details={"levels": found}).judged()
        figure.holds = bool(figure.holds and falls)
        figures.append(figure)
    return figures


