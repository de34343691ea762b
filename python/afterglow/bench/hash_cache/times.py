# SPDX-License-Identifier: GPL-3.0-or-later
"""Whole renders from the opened file to an error: HashCache with OpenImageDenoise against official Cycles with it, and bare."""

from __future__ import annotations

import statistics
from typing import Any

from ... import blenders, cache, images, metrics
from ..figure import Context, Figure, alternate
from ..foundation.kitchen import PERCENT, fewest, scene

COUNTS = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48)
SEEDS = 3
BARE = {"CYCLES": 256, "AFTERGLOW": 256}  # samples to relMSE 0.01 without a denoiser


def shot(worker: blenders.Worker, engine: str, samples: int, method: str, seed: int = 0, denoise: bool = True) -> dict[str, Any]:
    return worker.render(engine, samples=samples, accuracy=0.0, method=method, seed=seed, denoise=denoise)


def samples_for(worker: blenders.Worker, engine: str, goal: float, context: Context
                ) -> tuple[int | None, dict[int, float]]:
    """The smallest number of samples whose denoised images, averaged over seeds, are within the goal."""
    file, reference = scene()
    truth = images.read(reference)
    seen: dict[int, float] = {}

    def errors(samples: int) -> dict[str, list[float]]:
        return {"errors": [metrics.relmse(images.read(shot(worker, engine, samples, "HASH_CACHE", seed)["image"]), truth)
                           for seed in range(SEEDS)]}

    def enough(samples: int) -> bool:
        if engine == "CYCLES":
            key = {"kind": "denoised_errors", "file": cache.file_key(file), "truth": cache.file_key(reference),
                   "percent": PERCENT, "blender": worker.version, "samples": samples, "seeds": SEEDS}
            found = cache.arrays(key, lambda: errors(samples))["errors"]
        else:
            found = errors(samples)["errors"]
        seen[samples] = float(statistics.mean(float(e) for e in found))
        context.say(f"      {engine}: {samples} samples, denoised: relMSE {seen[samples]:.5f}")
        return seen[samples] <= goal

    return fewest(COUNTS, 4, enough), seen


def to_error(context: Context) -> list[Figure]:
    file, _ = scene()
    figures = []
    with blenders.Worker.of_official("5.0") as ours, blenders.Worker.of_official("5.0", addon=False) as theirs:
        for worker, engine in ((ours, "AFTERGLOW"), (theirs, "CYCLES")):
            worker.open(file, PERCENT)
            shot(worker, engine, 1, "HASH_CACHE")
        for goal in (0.01, 0.005):
            mine, my_errors = samples_for(ours, "AFTERGLOW", goal, context)
            other, other_errors = samples_for(theirs, "CYCLES", goal, context)
            name, peer = f"time to relMSE {goal:g}, denoised", f"Cycles {theirs.version} with OpenImageDenoise"
            details: dict[str, object] = {"ours": my_errors, "theirs": other_errors}
            if mine is None or other is None:
                figures.append(Figure(name, "country_kitchen 640×360", None, "s", peer, goal="≥ 3", holds=False, details=details,
                                      note=f"{COUNTS[-1]} samples were not enough: {'us' if mine is None else 'Cycles'}"))
                continue
            pairs = alternate(context.pairs, lambda: shot(theirs, "CYCLES", other, "")["seconds"],  # noqa: B023
                              lambda: shot(ours, "AFTERGLOW", mine, "HASH_CACHE")["seconds"])  # noqa: B023
            figures.append(Figure(name, "country_kitchen 640×360", statistics.median(pairs.theirs), "s", peer,
                                  statistics.median(pairs.ours), pairs.median, "≥ 3", spread=pairs.spread,
                                  note=f"{mine} samples against {other}", details=details).judged())
            if goal == 0.01:
                mean = statistics.median(pairs.theirs)
                for engine, method, worker in (("CYCLES", "", theirs), ("AFTERGLOW", "PATH_TRACING", ours)):
                    seconds = shot(worker, engine, BARE[engine], method, denoise=False)["seconds"]
                    figures.append(Figure(f"time to relMSE 0.01 against {'bare Cycles' if method == '' else 'path tracing'}",
                                          "country_kitchen 640×360", mean, "s", f"{BARE[engine]} samples", seconds,
                                          seconds / mean, "≥ 40").judged())
    return figures
