# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures of the Country Kitchen (Jay-Artist, CC-BY 3.0): error at 256 samples, time to a denoised image of relMSE 0.01, peak
memory; samples per second, of the Cornell box, too. Peer: official Cycles 5.0 in the same run."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from ... import blenders, cache, images, metrics
from ..figure import Context, Figure, alternate

PERCENT = 50  # of 1280 × 720
ERROR = 0.01  # of the denoised image
SEEDS = 3  # over which its error is taken


def scene() -> tuple[Path, Path]:
    """The file and its reference of 2048 samples."""
    folder = blenders.shared_scenes()
    file, reference = folder / "country_kitchen.blend", folder / "country_kitchen_cycles2048.exr"
    if not (file.is_file() and reference.is_file()):
        raise blenders.Unavailable(f"{file} or its reference is absent")
    return file, reference


def traced(worker: blenders.Worker, engine: str, samples: int, **settings: Any) -> dict[str, Any]:
    return worker.render(engine, samples=samples, accuracy=0.0, method="PATH_TRACING", **settings)


def error(context: Context) -> list[Figure]:
    """relMSE at 256 samples, the reference's own noise included."""
    file, reference = scene()
    with blenders.Worker.of_official("5.0") as worker:
        worker.open(file, PERCENT)
        answer = traced(worker, "AFTERGLOW", 256, seed=0)
        image, truth = images.read(answer["image"]), images.read(reference)
    value = metrics.relmse(image, truth)
    details = {"trimmed": metrics.trimmed_relmse(image, truth), "mean_ratio": metrics.mean_ratio(image, truth),
               "seconds": answer["seconds"], "statistics": answer["statistics"]}
    return [Figure("relMSE at 256 spp", "country_kitchen 640×360", value, "", "reference by Cycles, 2048 spp",
                   None, None, "≤ 0.012", details=details).judged()]


def samples_per_second(context: Context) -> list[Figure]:
    """The slope between two sample counts, so that set-up falls out."""
    cases = [(blenders.project() / "blend_files" / "cornell_box.blend", 100, 16, 160)]
    try:
        cases.append((scene()[0], PERCENT, 4, 44))
    except blenders.Unavailable as reason:
        context.say(f"      kitchen left out: {reason}")
    figures = []
    with blenders.Worker.of_official("5.0") as ours, blenders.Worker.of_official("5.0", addon=False) as theirs:
        for file, percent, few, many in cases:
            size = ours.open(file, percent)["resolution"]
            theirs.open(file, percent)

            def rate(worker: blenders.Worker, engine: str, few: int = few, many: int = many, size: list[int] = size) -> float:
                start, end = (traced(worker, engine, n)["seconds"] for n in (few, many))
                return (many - few) * size[0] * size[1] / max(end - start, 1e-3)

            traced(ours, "AFTERGLOW", 1)
            traced(theirs, "CYCLES", 1)
            pairs = alternate(context.pairs, lambda: rate(ours, "AFTERGLOW"), lambda: rate(theirs, "CYCLES"))
            figures.append(Figure(
                "samples per second", file.stem, statistics.median(pairs.ours), "samples/s", f"Cycles {theirs.version}",
                statistics.median(pairs.theirs), pairs.median, "≥ 1.2", spread=pairs.spread,
                details={"ours": pairs.ours, "theirs": pairs.theirs, "ratios": pairs.ratios}).judged())
    return figures


def fewest(counts: Sequence[int], start: int, enough: Callable[[int], bool]) -> int | None:
    """The smallest of rising counts that is enough, where more is never worse: up from `start` or down from it. None: not even
    the last is."""
    at = counts.index(start)
    if enough(counts[at]):
        while at > 0 and enough(counts[at - 1]):
            at -= 1
        return counts[at]
    return next((count for count in counts[at + 1 :] if enough(count)), None)


def denoised_errors(worker: blenders.Worker, engine: str, context: Context) -> tuple[int | None, dict[int, list[float]]]:
    """The sample count that a denoised image of the wanted error takes, and the errors of SEEDS images at each count tried."""
    file, reference = scene()
    truth = images.read(reference)
    seen: dict[int, list[float]] = {}

    def errors(samples: int) -> dict[str, list[float]]:
        return {"errors": [metrics.relmse(images.read(traced(worker, engine, samples, seed=seed, denoise=True)["image"]), truth)
                           for seed in range(SEEDS)]}

    def enough(samples: int) -> bool:
        if engine == "CYCLES":
            key = {"kind": "denoised_errors", "file": cache.file_key(file), "truth": cache.file_key(reference),
                   "percent": PERCENT, "blender": worker.version, "samples": samples, "seeds": SEEDS}
            found = cache.arrays(key, lambda: errors(samples))["errors"]
        else:
            found = errors(samples)["errors"]
        seen[samples] = [float(e) for e in found]
        context.say(f"      {engine}: {samples} samples, denoised: relMSE {statistics.mean(seen[samples]):.5f}")
        return statistics.mean(seen[samples]) <= ERROR

    return fewest((1, 2, 3, 4, 5, 6, 8, 10, 12, 16, 24, 32, 48), 4, enough), seen


def denoised_time(context: Context) -> list[Figure]:
    """Whole renders from the opened file, denoised, at the smallest sample count whose error, averaged over seeds, is within the
    goal: sought for each side first, timed in turns then."""
    file, _ = scene()
    with blenders.Worker.of_official("5.0") as ours, blenders.Worker.of_official("5.0", addon=False) as theirs:
        for worker, engine in ((ours, "AFTERGLOW"), (theirs, "CYCLES")):
            worker.open(file, PERCENT)
            traced(worker, engine, 1, denoise=True)  # loads libraries and kernels; users wait for them once
        mine, my_errors = denoised_errors(ours, "AFTERGLOW", context)
        other, other_errors = denoised_errors(theirs, "CYCLES", context)
        details: dict[str, object] = {"samples": [mine, other], "errors": {"ours": my_errors, "theirs": other_errors}}
        peer = f"Cycles {theirs.version} with OpenImageDenoise"
        if mine is None or other is None:
            return [Figure("time to relMSE 0.01, denoised", "country_kitchen 640×360", None, "s", peer, goal="≥ 1.3", holds=False,
                           note="48 samples were not enough", details=details)]
        pairs = alternate(context.pairs, lambda: traced(theirs, "CYCLES", other, denoise=True)["seconds"],
                          lambda: traced(ours, "AFTERGLOW", mine, denoise=True)["seconds"])
    details |= {"ours": pairs.theirs, "theirs": pairs.ours, "ratios": pairs.ratios}
    return [Figure("time to relMSE 0.01, denoised", "country_kitchen 640×360", statistics.median(pairs.theirs), "s", peer,
                   statistics.median(pairs.ours), pairs.median, "≥ 1.3", spread=pairs.spread,
                   note=f"{mine} samples against {other}", details=details).judged()]


def memory(context: Context) -> list[Figure]:
    """Peak resident memory of the whole process over the render, a fresh process for each."""
    file, _ = scene()
    peaks: dict[str, list[int]] = {"AFTERGLOW": [], "CYCLES": []}
    before: dict[str, int] = {}
    for _ in range(2):
        for engine in peaks:
            with blenders.Worker.of_official("5.0", addon=engine == "AFTERGLOW") as worker:
                worker.open(file, PERCENT)
                before[engine] = worker.job("memory")["now"]
                traced(worker, engine, 4)
                peaks[engine].append(worker.job("memory")["peak"])
                version = worker.version
    ours, theirs = (statistics.median(peaks[engine]) for engine in ("AFTERGLOW", "CYCLES"))
    return [Figure("peak memory", "country_kitchen 640×360", ours / 2**20, "MiB", f"Cycles {version}", theirs / 2**20,
                   ours / theirs, "≤ 1.2", details={"peaks": peaks, "with the file open": before}).judged()]
