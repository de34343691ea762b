# SPDX-License-Identifier: GPL-3.0-or-later
"""Animations of the kitchen at 640 × 360 with persistent data: the time of 100 frames, the error of the first, middle and last,
and flicker, against official Cycles with OpenImageDenoise. Of a side that remembers nothing between frames six are rendered:
a frame costs what it costs whichever it is, so that 100 take the first and 99 times the mean of the others.
"""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import blenders, cache, images, metrics
from .figure import Context, Figure
from .foundation.kitchen import PERCENT, scene

LAST = 100
FRAMES = (1, 2, 50, 51, 99, 100)
SHOWN = (1, 50, 100)  # whose error counts
PARTS = 2  # of the references


@dataclass(frozen=True)
class Animation:
    """What moves, by a worker's job; our settings; the frames that ours must render for its caches to be what they would be;
    the rival's samples; goals."""

    name: str
    motion: dict[str, Any]  # "op" and its values
    ours: dict[str, Any]
    rival_samples: int
    error: float
    sooner: float
    reference_samples: int = 64
    frames: Sequence[int] = FRAMES


def animated(worker: blenders.Worker, animation: Animation) -> blenders.Worker:
    worker.open(scene()[0], PERCENT)
    worker.job(**animation.motion, last=LAST)
    return worker


def rendered(worker: blenders.Worker, engine: str, frames: Sequence[int], **settings: Any) -> tuple[list[Any], list[float]]:
    """The pictures of FRAMES and the seconds of all `frames`, in order."""
    answer = worker.frames(engine, frames, **settings)
    paths = dict(zip(frames, answer["images"], strict=True))
    return [images.read(paths[frame]) for frame in FRAMES], [float(s) for s in answer["seconds"]]


def references(context: Context, worker: blenders.Worker, animation: Animation) -> list[list[Any]]:
    """For each part all FRAMES. Within a part all have the same random numbers, so that what moves is told from noise."""
    parts = []
    for part in range(PARTS):
        key = {"kind": "kitchen_frames", "file": cache.file_key(scene()[0]), "percent": PERCENT, "blender": worker.version,
               **animation.motion, "last": LAST, "frames": FRAMES, "samples": animation.reference_samples, "part": part}

        def make(part: int = part) -> dict[str, Any]:
            context.say(f"      reference {part + 1} of {PARTS}: path tracing, {len(FRAMES)} frames, "
                        f"{animation.reference_samples} samples")
            made, _ = rendered(worker, "AFTERGLOW", FRAMES, method="PATH_TRACING", samples=animation.reference_samples,
                               accuracy=0.0, seed=1000 + part)
            return {str(frame): picture for frame, picture in zip(FRAMES, made, strict=True)}

        kept = cache.arrays(key, make)
        parts.append([np.asarray(kept[str(frame)]) for frame in FRAMES])
    return parts


def flicker(pictures: list[Any], parts: list[list[Any]]) -> metrics.Estimate:
    """Mean over the neighbouring pairs of frames."""
    pairs = [i for i in range(len(FRAMES) - 1) if FRAMES[i + 1] == FRAMES[i] + 1]
    found = [metrics.moving_flicker((pictures[i], pictures[i + 1]), *((part[i], part[i + 1]) for part in parts)) for i in pairs]
    return metrics.Estimate(statistics.mean(e.value for e in found), sum(e.error**2 for e in found) ** 0.5 / len(found))


def whole(seconds: list[float]) -> float:
    return sum(seconds) if len(seconds) == LAST else seconds[0] + (LAST - 1) * statistics.mean(seconds[1:])


def measure(context: Context, animation: Animation) -> list[Figure]:
    with blenders.Worker.of_official("5.0") as ours:
        parts = references(context, animated(ours, animation), animation)
        rendered(ours, "AFTERGLOW", FRAMES, **{**animation.ours, "samples": 1})  # loads libraries and pictures
        mine, my_seconds = rendered(animated(ours, animation), "AFTERGLOW", animation.frames, seed=0, use_animated_seed=True,
                                    **animation.ours)
    with blenders.Worker.of_official("5.0", addon=False) as theirs:
        animated(theirs, animation).frames("CYCLES", (1,), samples=1, denoise=True)
        other, other_seconds = rendered(theirs, "CYCLES", FRAMES, samples=animation.rival_samples, denoise=True, seed=0,
                                        use_animated_seed=True)
    where = f"country_kitchen 640×360, {animation.name}, {LAST} frames"
    errors = {frame: [metrics.halves_relmse(pictures[FRAMES.index(frame)], [part[FRAMES.index(frame)] for part in parts])
                      for pictures in (mine, other)] for frame in SHOWN}
    worst = max((e[0] for e in errors.values()), key=lambda e: e.value)
    rival_worst = max(e[1].value for e in errors.values())
    flickers = [flicker(pictures, parts) for pictures in (mine, other)]
    details = {"seconds": my_seconds, "cycles": other_seconds, "flicker": [(e.value, e.error) for e in flickers],
               "errors": {str(frame): [e.value for e in pair] for frame, pair in errors.items()}}
    times = whole(my_seconds), whole(other_seconds)
    peer = f"Cycles 5.0 + OIDN, {animation.rival_samples} spp"
    return [
        Figure("relMSE of an animation, worst of first, middle and last frame", where, worst.value, "", peer, rival_worst, None,
               f"≤ {animation.error}", spread=worst.error, details=details).judged(),
        Figure("an animation, time", where, times[0], "s", peer, times[1], times[1] / times[0], f"≥ {animation.sooner:g}",
               note=f"{len(my_seconds)} frames measured: the first {my_seconds[0]:.2f} s, the others "
               f"{statistics.mean(my_seconds[1:]):.2f} s; Cycles {other_seconds[0]:.2f} s and "
               f"{statistics.mean(other_seconds[1:]):.2f} s", details=details).judged(),
        Figure("flicker of an animation", where, 100 * flickers[0].value, "%", peer, 100 * flickers[1].value,
               flickers[1].value / max(flickers[0].value, 1e-9), "≥ 8", spread=100 * flickers[0].error, details=details).judged(),
    ]
