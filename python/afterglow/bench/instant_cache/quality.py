# SPDX-License-Identifier: GPL-3.0-or-later
"""How far the cache is from instant radiosity, from itself filled anew, and from the path tracer."""

from __future__ import annotations

import hashlib
import time
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ... import __version__, blenders, cache, images, metrics
from ...scenes import Description
from ..figure import Context, Figure
from ..foundation import kitchen
from .animations import FIRST, MOVING
from .watched import Watched

DIFFERENCE = ("cornell_statue", "wobbling_cylinder", "desk_with_chair", "bunnies", "cornell_mirror", "cornell_indirect",
              "conference_room", "pillared_hall", "office_with_blinds")
SMALL = {"width": 300, "height": 200, "pixel_filter": "BLACKMAN_HARRIS", "filter_width": 1.5, "caustics_reflective": False,
         "caustics_refractive": False}
REFERENCE_SAMPLES = 512
# Samples until the believed error is what a render accepts by default; as many as the office with blinds asks for.
ACCURACY, MOST_SAMPLES = 0.03, 4096
LEVELS: dict[str, dict[str, Any]] = {
    "default": {"cache_accuracy": 0.05, "virtual_lights": 256, "light_compensation": 0, "light_bound": 2.0},
    "finer": {"cache_accuracy": 0.025, "virtual_lights": 2048, "light_compensation": 16, "light_bound": 4.0},
    "finest": {"cache_accuracy": 0.0125, "virtual_lights": 16384, "light_compensation": 64, "light_bound": 4.0}}
Levels = dict[str, dict[str, float]]  # seconds, relmse, error, samples of each
ERROR = "relMSE against path tracing, finest setting"
KITCHEN, KITCHEN_PERCENT = "country_kitchen", 25  # of 1280 × 720


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
    every pair asked for, in every animation."""
    figures = []
    for name in MOVING:
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


def fingerprint(description: Description) -> str:
    """Of forms, places and colours in the first frame: a reference is of one state of a scene."""
    start, seen = description.frames[0], hashlib.sha256()
    for name, mesh in description.meshes.items():
        seen.update(name.encode() + mesh.positions.tobytes() + mesh.triangles.tobytes())
    for item in description.objects:
        seen.update(f"{item.name} {item.mesh} {item.materials}".encode() + item.at(start).tobytes())
    for light in description.lights:
        seen.update(repr(replace(light, transform=np.eye(4), move=None)).encode() + light.at(start).tobytes())
    seen.update(repr([sorted(description.materials.items()), description.world]).encode())
    seen.update(description.camera.at(start).tobytes())
    return seen.hexdigest()[:24]


def reference(name: str) -> tuple[list[NDArray[np.float32]], float]:
    """Two independent halves by the path tracer."""

    def trace() -> dict[str, Any]:
        began = time.perf_counter()
        halves = [picture(Watched(FIRST[name].make, "PATH_TRACING", **SMALL, samples=REFERENCE_SAMPLES, seed=seed))
                  for seed in (1, 2)]
        return {"halves": np.stack(halves), "seconds": time.perf_counter() - began}

    found = cache.arrays({"kind": "instant_cache_reference", "scene": name, "state": fingerprint(FIRST[name].make()),
                          "samples": REFERENCE_SAMPLES, "version": __version__, "settings": str(SMALL)}, trace)
    return list(np.asarray(found["halves"])), float(found["seconds"])


def of_scene(name: str) -> Levels:
    truth, _ = reference(name)
    found = {}
    for level, settings in LEVELS.items():
        began = time.perf_counter()
        watched = Watched(FIRST[name].make, "INSTANT_CACHE", **SMALL, accuracy=ACCURACY, samples=MOST_SAMPLES, **settings)
        seconds = time.perf_counter() - began
        estimate = metrics.halves_relmse(picture(watched), truth)
        found[level] = {"seconds": seconds, "relmse": estimate.value, "error": estimate.error,
                        "samples": watched.session.statistics()["samples"]}
    return found


def of_kitchen() -> Levels:
    """The Country Kitchen in Debian's Blender, an empty cache before each render; seconds from the opened file."""
    file, _ = kitchen.scene()
    with blenders.Worker.of_debian() as worker:

        def rendered(**settings: Any) -> dict[str, Any]:
            worker.open(file, KITCHEN_PERCENT)
            return worker.render("AFTERGLOW", **settings)

        truth = []
        for seed in (1001, 1002):
            key = {"kind": "instant_cache_kitchen", "file": cache.file_key(file), "percent": KITCHEN_PERCENT, "seed": seed,
                   "samples": REFERENCE_SAMPLES, "blender": worker.version, "version": __version__}

            def trace(seed: int = seed) -> dict[str, Any]:
                answer = rendered(method="PATH_TRACING", samples=REFERENCE_SAMPLES, accuracy=0.0, seed=seed)
                return {"image": images.read(answer["image"])}

            truth.append(np.asarray(cache.arrays(key, trace)["image"]))
        found = {}
        for level, settings in LEVELS.items():
            answer = rendered(method="INSTANT_CACHE", samples=MOST_SAMPLES, accuracy=ACCURACY, seed=0, **settings)
            estimate = metrics.halves_relmse(images.read(answer["image"]), truth)
            found[level] = {"seconds": answer["seconds"], "relmse": estimate.value, "error": estimate.error,
                            "samples": answer["statistics"]["samples"]}
    return found


def error_figure(name: str, found: Levels) -> Figure:
    errors = [found[level]["relmse"] for level in LEVELS]
    falls = errors == sorted(errors, reverse=True)
    note = ", ".join(f"{level}: {it['relmse']:.4f} in {it['seconds']:.1f} s" for level, it in found.items())
    figure = Figure(ERROR, name, found["finest"]["relmse"], goal="≤ 0.02", spread=found["finest"]["error"],
                    note=note + ("" if falls else "; the error does not fall"), details={"levels": found}).judged()
    figure.holds = bool(figure.holds and falls)
    return figure


def error(context: Context) -> list[Figure]:
    """relMSE against the path tracer by the time it took, at three settings of the cache, each with the samples that `accuracy`
    chooses; free of the reference's own noise."""
    figures = [error_figure(name, of_scene(name)) for name in DIFFERENCE]
    try:
        figures.append(error_figure(KITCHEN, of_kitchen()))
    except blenders.Unavailable as reason:
        figures.append(Figure(ERROR, KITCHEN, goal="≤ 0.02", holds=False, note=f"not measured: {reason}"))
    return figures
