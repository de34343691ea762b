# SPDX-License-Identifier: GPL-3.0-or-later
"""Whole renders from the opened file to an error: HashCache with OpenImageDenoise against official Cycles with it, and bare; the
Country Kitchen and a room of ours."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ... import blenders, cache, images, metrics
from ..figure import Context, Figure, alternate
from ..foundation.kitchen import PERCENT, fewest, scene

COUNTS = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48)
SEEDS = 3
BARE_COUNTS = (64, 256)  # samples at which the bare path tracers' c of c / N is measured
ROOM, ROOM_PERCENT, ROOM_REFERENCE = "conference_room", 100, 2048


@dataclass(frozen=True)
class Place:
    """A file, its size in per cent, and its reference."""

    name: str
    file: Path
    percent: int
    truth: NDArray[np.float32]
    key: str  # of the reference


def kitchen() -> Place:
    file, reference = scene()
    return Place("country_kitchen 640×360", file, PERCENT, images.read(reference), cache.file_key(reference))


def room(worker: blenders.Worker) -> Place:
    """One of ours, its reference by official Cycles: the rival's own light is the truth."""
    file = blenders.project() / "blend_files" / f"{ROOM}.blend"
    key = {"kind": "room_reference", "file": cache.file_key(file), "blender": worker.version, "samples": ROOM_REFERENCE}

    def trace() -> dict[str, Any]:
        worker.open(file, ROOM_PERCENT)
        return {"image": images.read(shot(worker, "CYCLES", ROOM_REFERENCE, "", 77, denoise=False)["image"])}

    return Place(ROOM, file, ROOM_PERCENT, np.asarray(cache.arrays(key, trace)["image"]), f"{ROOM} {ROOM_REFERENCE}")


def shot(worker: blenders.Worker, engine: str, samples: int, method: str, seed: int = 0, denoise: bool = True) -> dict[str, Any]:
    return worker.render(engine, samples=samples, accuracy=0.0, method=method, seed=seed, denoise=denoise)


def bare_samples(worker: blenders.Worker, engine: str, place: Place, goal: float, context: Context) -> int:
    """How many samples a path tracer needs without a denoiser: its error is c / N, c the mean of those at two counts."""
    found = []
    for samples in BARE_COUNTS:
        image = images.read(shot(worker, engine, samples, "PATH_TRACING", 1, denoise=False)["image"])
        error = metrics.relmse(image, place.truth)
        context.say(f"      {engine}, bare: {samples} samples: relMSE {error:.5f}")
        found.append(error * samples)
    return max(1, math.ceil(statistics.mean(found) / goal))


def samples_for(worker: blenders.Worker, engine: str, goal: float, place: Place, context: Context
                ) -> tuple[int | None, dict[int, float]]:
    """The smallest number of samples whose denoised images, averaged over seeds, are within the goal."""
    seen: dict[int, float] = {}

    def errors(samples: int) -> dict[str, list[float]]:
        return {"errors": [metrics.relmse(images.read(shot(worker, engine, samples, "HASH_CACHE", seed)["image"]), place.truth)
                           for seed in range(SEEDS)]}

    def enough(samples: int) -> bool:
        if engine == "CYCLES":
            key = {"kind": "denoised_errors", "file": cache.file_key(place.file), "truth": place.key,
                   "percent": place.percent, "blender": worker.version, "samples": samples, "seeds": SEEDS}
            found = cache.arrays(key, lambda: errors(samples))["errors"]
        else:
            found = errors(samples)["errors"]
        seen[samples] = float(statistics.mean(float(e) for e in found))
        context.say(f"      {engine}: {samples} samples, denoised: relMSE {seen[samples]:.5f}")
        return seen[samples] <= goal

    return fewest(COUNTS, 4, enough), seen


def to_error(context: Context) -> list[Figure]:
    figures: list[Figure] = []
    with blenders.Worker.of_official("5.0") as ours, blenders.Worker.of_official("5.0", addon=False) as theirs:
        places: list[Callable[[], Place]] = [lambda: room(theirs), kitchen]
        for make in places:
            try:
                place = make()
            except blenders.Unavailable as reason:
                context.say(f"      left out: {reason}")
                continue
            for worker, engine in ((ours, "AFTERGLOW"), (theirs, "CYCLES")):
                worker.open(place.file, place.percent)
                shot(worker, engine, 1, "HASH_CACHE")
            figures += at_place(place, ours, theirs, context)
    return figures


def at_place(place: Place, ours: blenders.Worker, theirs: blenders.Worker, context: Context) -> list[Figure]:
    figures = []
    for goal in (0.01, 0.005):
        mine, my_errors = samples_for(ours, "AFTERGLOW", goal, place, context)
        other, other_errors = samples_for(theirs, "CYCLES", goal, place, context)
        name, peer = f"time to relMSE {goal:g}, denoised", f"Cycles {theirs.version} with OpenImageDenoise"
        details: dict[str, object] = {"ours": my_errors, "theirs": other_errors}
        if mine is None or other is None:
            figures.append(Figure(name, place.name, None, "s", peer, goal="≥ 3", holds=False, details=details,
                                  note=f"{COUNTS[-1]} samples were not enough: {'us' if mine is None else 'Cycles'}"))
            continue
        pairs = alternate(context.pairs, lambda: shot(theirs, "CYCLES", other, "")["seconds"],  # noqa: B023
                          lambda: shot(ours, "AFTERGLOW", mine, "HASH_CACHE")["seconds"])  # noqa: B023
        figures.append(Figure(name, place.name, statistics.median(pairs.theirs), "s", peer, statistics.median(pairs.ours),
                              pairs.median, "≥ 3", spread=pairs.spread, note=f"{mine} samples against {other}",
                              details=details).judged())
        if goal == 0.01:
            mean = statistics.median(pairs.theirs)
            for engine, method, worker in (("CYCLES", "", theirs), ("AFTERGLOW", "PATH_TRACING", ours)):
                samples = bare_samples(worker, engine, place, goal, context)
                seconds = shot(worker, engine, samples, method, denoise=False)["seconds"]
                figures.append(Figure(f"time to relMSE 0.01 against {'bare Cycles' if method == '' else 'path tracing'}",
                                      place.name, mean, "s", f"{samples} samples", seconds, seconds / mean, "≥ 40").judged())
    return figures
