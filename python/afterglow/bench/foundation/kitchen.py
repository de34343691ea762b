# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures of the Country Kitchen (Jay-Artist, CC-BY 3.0): error at 256 samples, samples per second, time to a denoised image
of relMSE 0.01, peak memory; samples per second of the Cornell box, too. Peer: official Cycles 5.0 in the same run."""

from __future__ import annotations

import math
import statistics
from pathlib import Path

from ... import blenders, images, metrics
from ..figure import Context, Figure, alternate

PERCENT = 50  # of 1280 × 720
PEER = "Cycles 5.0"


def scene() -> tuple[Path, Path]:
    """The file and its reference of 2048 samples."""
    folder = blenders.shared() / "scenes"
    file, reference = folder / "country_kitchen.blend", folder / "country_kitchen_cycles2048.exr"
    if not (file.is_file() and reference.is_file()):
        raise blenders.Unavailable(f"{file} or its reference is absent")
    return file, reference


def error(context: Context) -> list[Figure]:
    """relMSE at 256 samples, the reference's own noise included."""
    file, reference = scene()
    with blenders.Worker.of_official("5.0") as worker:
        worker.open(file, PERCENT)
        answer = worker.render(samples=256, accuracy=0.0, method="PATH_TRACING", seed=0)
        image, truth = images.read(answer["image"]), images.read(reference)
    value = metrics.relmse(image, truth)
    details = {"trimmed": metrics.trimmed_relmse(image, truth), "mean_ratio": metrics.mean_ratio(image, truth),
               "seconds": answer["seconds"], "statistics": answer["statistics"]}
    return [Figure("relMSE at 256 spp", "country_kitchen 640×360", value, "", "reference by Cycles, 2048 spp", None, None, "≤ 0.012",
                   details=details).judged()]


def samples_per_second(context: Context) -> list[Figure]:
    """The slope between two sample counts, so that set-up falls out."""
    cases = [(blenders.project() / "blend_files" / "cornell_box.blend", 100, 64, 320)]
    try:
        cases.append((scene()[0], PERCENT, 4, 20))
    except blenders.Unavailable as reason:
        context.say(f"  kitchen left out: {reason}")
    figures = []
    with blenders.Worker.of_official("5.0") as ours, blenders.Worker.of_official("5.0", addon=False) as theirs:
        for file, percent, few, many in cases:
            size = ours.open(file, percent)["resolution"]
            theirs.open(file, percent)

            def rate(worker: blenders.Worker, engine: str, few: int = few, many: int = many, size: list[int] = size) -> float:
                start, end = (worker.render(engine, samples=n, accuracy=0.0, method="PATH_TRACING")["seconds"] for n in (few, many))
                return (many - few) * size[0] * size[1] / (end - start)

            rate(ours, "AFTERGLOW", 1, 2)
            rate(theirs, "CYCLES", 1, 2)
            pairs = alternate(context.pairs, lambda: rate(ours, "AFTERGLOW"), lambda: rate(theirs, "CYCLES"))
            figures.append(Figure(
                "samples per second", file.stem, statistics.median(pairs.ours), "samples/s", f"Cycles {theirs.version}",
                statistics.median(pairs.theirs), pairs.median, "≥ 1.2", spread=pairs.spread,
                details={"ours": pairs.ours, "theirs": pairs.theirs}).judged())
    return figures


def crossing(points: list[tuple[float, float]], goal: float) -> float:
    """Seconds at which the error falls to the goal: straight lines between the logarithms of measured points in order."""
    points = sorted(points)
    if points[0][1] <= goal:
        return points[0][0]
    for (t0, e0), (t1, e1) in zip(points, points[1:]):
        if e1 <= goal:
            share = (math.log(e0) - math.log(goal)) / (math.log(e0) - math.log(e1))
            return math.exp(math.log(t0) + share * (math.log(t1) - math.log(t0)))
    return float("inf")


def denoised_time(context: Context) -> list[Figure]:
    """Whole renders from the opened file at growing sample counts, denoised, until the goal is reached."""
    file, reference = scene()
    truth, goal = images.read(reference), 0.01

    def climb(worker: blenders.Worker, engine: str, seed: int) -> tuple[float, list[tuple[int, float, float]]]:
        seen: list[tuple[int, float, float]] = []
        for samples in (1, 2, 3, 4, 5, 6, 8, 12, 16, 24, 32):
            if seen and seen[-1][2] > 3 * goal and samples in (3, 5, 6, 12, 24):
                continue  # far off still: no need for fine steps
            answer = worker.render(engine, samples=samples, seed=seed, denoise=True, accuracy=0.0, method="PATH_TRACING")
            seen.append((samples, answer["seconds"], metrics.relmse(images.read(answer["image"]), truth)))
            if seen[-1][2] <= goal:
                break
        return crossing([(t, e) for _, t, e in seen], goal), seen

    with blenders.Worker.of_official("5.0") as ours, blenders.Worker.of_official("5.0", addon=False) as theirs:
        for worker, engine in ((ours, "AFTERGLOW"), (theirs, "CYCLES")):
            worker.open(file, PERCENT)
            worker.render(engine, samples=1, denoise=True)  # loads libraries and kernels; users wait for them once
        log: dict[str, list[object]] = {"ours": [], "theirs": []}
        seeds = {"ours": iter(range(1000)), "theirs": iter(range(1000))}

        def once(worker: blenders.Worker, engine: str, side: str) -> float:
            seconds, seen = climb(worker, engine, next(seeds[side]))
            log[side].append(seen)
            return seconds

        pairs = alternate(context.pairs, lambda: once(theirs, "CYCLES", "theirs"), lambda: once(ours, "AFTERGLOW", "ours"))
    return [Figure("time to relMSE 0.01, denoised", "country_kitchen 640×360", statistics.median(pairs.theirs), "s",
                   f"Cycles {theirs.version} with OpenImageDenoise", statistics.median(pairs.ours), pairs.median, "≥ 1.3",
                   spread=pairs.spread, details=dict(log)).judged()]


def memory(context: Context) -> list[Figure]:
    """Peak resident memory of the whole process over the render, a fresh process for each."""
    file, _ = scene()
    peaks: dict[str, list[int]] = {"AFTERGLOW": [], "CYCLES": []}
    for _ in range(2):
        for engine in peaks:
            with blenders.Worker.of_official("5.0", addon=engine == "AFTERGLOW") as worker:
                worker.open(file, PERCENT)
                worker.render(engine, samples=4, accuracy=0.0, method="PATH_TRACING")
                peaks[engine].append(worker.job("memory")["peak"])
    ours, theirs = statistics.median(peaks["AFTERGLOW"]), statistics.median(peaks["CYCLES"])
    return [Figure("peak memory", "country_kitchen 640×360", ours / 2**20, "MiB", PEER, theirs / 2**20, ours / theirs, "≤ 1.2",
                   details=dict(peaks)).judged()]
