# SPDX-License-Identifier: GPL-3.0-or-later
"""How far HashCache images are from the truth, in samples of path tracing; how still a still view stands; what comes back when
the camera comes back; what the layered filter does for mirrored and refracted things; whether threads matter."""

from __future__ import annotations

import statistics
from typing import Any

import numpy as np

from ... import api, blenders, images, metrics
from ...scenes.rooms import cornell_box, floor_room
from ..figure import Context, Figure
from ..foundation.kitchen import PERCENT, scene
from . import walk

FRAMES, SAMPLES = 100, 64
PATH_COUNTS = (1, 8, SAMPLES)
MEASURED = (0, 24, 49, 74, 99)
REFERENCE = 512  # samples of each half
PATHS: dict[str, dict[str, Any]] = {", direct light per pixel": {},
                                    ", all from the cache": {"hash_direct": True, "hash_cell": 0.7}}


def similarity(image: Any, truth: list[Any]) -> float:
    return metrics.ms_ssim(image, np.mean(truth, axis=0))


def camera_path(context: Context) -> list[Figure]:
    """1, 8 and 64 samples of HashCache in each of 100 frames, five of them measured, against the path tracer's c / N: the paper's
    figure 11. With direct light per pixel, as is the default, and all from the cache, as is the paper's."""
    size = walk.SMALL
    truths = {f: walk.halves(f / FRAMES, REFERENCE, size) for f in MEASURED}
    costs = [walk.path_tracing_cost(f / FRAMES, truth, size) for f, truth in truths.items()]
    traced = {kind: {n: statistics.mean(getattr(cost, kind)[n] for cost in costs) for n in costs[0].errors}
              for kind in ("errors", "similarity")}
    figures = []
    for name, settings in PATHS.items():
        errors: dict[int, list[metrics.Estimate]] = {}
        seen: dict[int, float] = {}
        seconds: dict[int, float] = {}
        for n in PATH_COUNTS:
            jobs = [walk.render(f / FRAMES, 100 + f, n, f"f{f}" if f in truths else None, **settings) for f in range(FRAMES)]
            answers, pictures = walk.run(jobs, size)
            seconds[n] = sum(a["seconds"] for a in answers[1:])
            errors[n] = [metrics.halves_relmse(pictures[f"f{f}"], truth) for f, truth in truths.items()]
            seen[n] = statistics.mean(similarity(pictures[f"f{f}"], truth) for f, truth in truths.items())
            found = ", ".join(f"{e.value:.5f} ± {e.error:.5f}" for e in errors[n])
            context.say(f"      {n} samples{name}: relMSE {found}, {seconds[n]:.0f} s")
        worth = [cost.c / max(e.value, 1e-6) for cost, e in zip(costs, errors[SAMPLES], strict=True)]
        figures.append(Figure(
            f"path-traced samples that 64 samples are worth, camera path{name}", f"country_kitchen {size[0]}×{size[1]}",
            statistics.mean(worth), "samples", "figure 11 of the paper", 4096, None, "≥ 4096",
            details={"errors": {n: statistics.mean(e.value for e in found) for n, found in errors.items()}, "similarity": seen,
                     "path_tracing": traced, "frames": errors, "costs": [cost.c for cost in costs], "worth": worth,
                     "seconds": seconds}).judged())
    return figures


def single_frame(context: Context) -> list[Figure]:
    """The same for one frame with an empty cache."""
    truth = walk.halves(None, REFERENCE, walk.SIZE)
    cost = walk.path_tracing_cost(None, truth, walk.SIZE)
    errors, seen, seconds = {}, {}, {}
    for n in (1, 4, 16, SAMPLES):
        answers, pictures = walk.run([walk.render(None, 5, n, "image")])
        errors[n], seconds[n] = metrics.halves_relmse(pictures["image"], truth).value, answers[1]["seconds"]
        seen[n] = similarity(pictures["image"], truth)
        context.say(f"      {n} samples: relMSE {errors[n]:.5f}, {seconds[n]:.1f} s")
    return [Figure("path-traced samples that 64 samples are worth, first frame", "country_kitchen 640×360",
                   cost.c / max(errors[SAMPLES], 1e-6), "samples", "", None, None, "≥ 1024",
                   details={"errors": errors, "similarity": seen, "path_tracing": vars(cost), "seconds": seconds}).judged()]


def rival_flicker(samples: int = 16, frames: int = 4) -> metrics.Estimate:
    """Official Cycles with OpenImageDenoise, a new seed in every frame."""
    file, reference = scene()
    with blenders.Worker.of_official("5.0", addon=False) as worker:
        worker.open(file, PERCENT)
        shots = [images.read(worker.render("CYCLES", samples=samples, denoise=True, seed=seed)["image"])
                 for seed in range(frames)]
    return metrics.still_flicker(shots, images.read(reference))


def still(context: Context) -> list[Figure]:
    """Frames of a still view at 16 samples, a new seed each, after a second of them; the rival's in the same run."""
    jobs = [walk.render(None, 200 + f, 16, f"f{f}" if f >= 24 else None) for f in range(30)]
    _, kept = walk.run(jobs)
    frames = [kept[f"f{f}"] for f in range(24, 30)]
    rival = rival_flicker()
    found = metrics.still_flicker(frames, np.mean(frames, axis=0))
    return [Figure("flicker of a still view, 16 samples a frame", "country_kitchen 640×360", 100 * found.value, "%",
                   "Cycles 5.0 with OpenImageDenoise, 16 samples", 100 * rival.value, None, "≤ 0.3", spread=100 * found.error,
                   note="" if found.value <= 0.003 else f"{100 * found.value:.2f} %").judged()]


def returning(context: Context) -> list[Figure]:
    """The camera leaves and comes back: twice the noise's variance is what two images may differ by."""
    apart = {"hash_running": False}
    jobs = [walk.render(0.0, 1, 16, **apart)] * 2
    jobs += [walk.render(0.0, 2, 16, "first", **apart), walk.render(0.0, 3, 16, "again", **apart)]
    jobs += [walk.render(f / 10, 10 + f, 16, **apart) for f in range(1, 10)]
    jobs += [walk.render(0.0, 30, 16, "back", **apart)]
    _, pictures = walk.run(jobs, walk.SMALL)
    noise = float(((pictures["first"] - pictures["again"]) ** 2).mean())
    change = float(((pictures["first"] - pictures["back"]) ** 2).mean())
    return [Figure("image change on returning, over that between two seeds", "country_kitchen 192×108", change / noise, "", "",
                   None, None, "≤ 1.1").judged()]


def layers(context: Context) -> list[Figure]:
    """MS-SSIM of mirrored and refracted floors and things at one sample, with the layered filter over without."""
    figures = []
    for room in (floor_room("mirror"), floor_room("glass"), cornell_box("mirror"), cornell_box("glass")):
        common = {"width": 192, "height": 192, "diffuse_bounces": 4}
        truth = api.render(room, method="PATH_TRACING", samples=2048, seed=9, **common).image
        values = {on: statistics.mean(metrics.ms_ssim(
            api.render(room, method="HASH_CACHE", samples=1, seed=s, hash_filter=on, **common).image, truth) for s in range(3))
            for on in (True, False)}
        figures.append(Figure("MS-SSIM with layered filter over without", room.name, values[True], "",
                              "without filter", values[False], values[True] / values[False], "≥ 1.0").judged())
    return figures


def methods_apart(context: Context) -> list[Figure]:
    """What somebody would see if a viewport went over from the instant cache to HashCache when the camera begins to move."""
    jobs = [walk.render(None, 5, 16, "instant", "INSTANT_CACHE"), walk.render(None, 5, 16, "hash"),
            walk.render(None, 6, 16, "again", hash_running=False)]
    pictures = walk.run(jobs)[1]
    apart = metrics.flip(pictures["instant"], pictures["hash"])
    return [Figure("mean FLIP between instant cache and HashCache", "country_kitchen 640×360", apart, "",
                   "HashCache, another seed", metrics.flip(pictures["again"], pictures["hash"]), None, "≤ 0.01").judged()]


def threads(context: Context) -> list[Figure]:
    """Largest difference between one and two threads, kitchen."""
    pictures = [walk.run([walk.render(None, 3, 4, "image", threads=n)], walk.SMALL)[1]["image"] for n in (1, 2)]
    most = float(np.abs(pictures[0] - pictures[1]).max())
    return [Figure("largest difference between 1 and 2 threads", "country_kitchen 192×108", most, "",
                   "", None, None, "= 0").judged()]
