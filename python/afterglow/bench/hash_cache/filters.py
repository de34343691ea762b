# SPDX-License-Identifier: GPL-3.0-or-later
"""Denoisers of finished pictures side by side: none, the layered filter, OpenImageDenoise, for each method at few samples:
relMSE, and how much a still view differs between seeds. Which is the default is decided by these figures."""

from __future__ import annotations

import os
import statistics
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ... import api, blenders, denoisers, metrics
from ...scenes.rooms import textured_room
from ..figure import Context, Figure
from . import walk

METHODS = {"PATH_TRACING": 4, "INSTANT_CACHE": 4, "HASH_CACHE": 1}  # samples
FILTERS: dict[str, dict[str, Any]] = {
    "none": {}, "layered": {"denoise": True, "denoiser": "LAYERED"},
    "OpenImageDenoise": {"denoise": True, "denoiser": "OPENIMAGEDENOISE"}}
SEEDS = 4
ROOM: dict[str, Any] = {"width": 320, "height": 240, "diffuse_bounces": 4}
Images = list[NDArray[np.float32]]


def places() -> list[str]:
    """Where a copy of OpenImageDenoise may lie: AFTERGLOW_OIDN, or the official Blender's."""
    found = [place for place in os.environ.get("AFTERGLOW_OIDN", "").split(":") if place]
    try:
        found += [str(file.parent) for file in
                  blenders.official("5.0").parent.parent.glob("lib/python*/site-packages/bpy/lib/libOpenImageDenoise.so*")]
    except blenders.Unavailable:
        pass
    return list(dict.fromkeys(found))


def of_room() -> tuple[Callable[[str, int, str], Images], Images]:
    room, search = textured_room(), places()
    known = {"none", "layered"}
    if any(d["id"] == "OPENIMAGEDENOISE" and d["available"] for d in denoisers(search)):
        known.add("OpenImageDenoise")

    def shots(method: str, samples: int, name: str) -> Images:
        if name not in known:
            return []
        return [api.render(room, method=method, samples=samples, seed=50 + seed, denoiser_search=search, **ROOM,
                           **FILTERS[name]).image[..., :3] for seed in range(SEEDS)]

    truth = [api.render(room, method="PATH_TRACING", samples=256, seed=seed, **ROOM).image[..., :3] for seed in (1, 2)]
    return shots, truth


def of_kitchen() -> tuple[Callable[[str, int, str], Images], Images]:
    """Each picture with a cache of its own."""

    def shots(method: str, samples: int, name: str) -> Images:
        return [walk.run([walk.render(None, 50 + seed, samples, "image", method, **FILTERS[name])])[1]["image"][..., :3]
                for seed in range(SEEDS)]

    return shots, walk.halves(None, 512, walk.SIZE)


def compared(scene: str, shots: Callable[[str, int, str], Images], truth: Images, context: Context) -> list[Figure]:
    figures = []
    mean = np.mean(truth, axis=0)
    for method, samples in METHODS.items():
        errors: dict[str, float] = {}
        flickers: dict[str, float] = {}
        for name in FILTERS:
            if pictures := shots(method, samples, name):
                errors[name] = statistics.mean(metrics.halves_relmse(picture, truth).value for picture in pictures)
                flickers[name] = metrics.still_flicker(pictures, mean).value
                context.say(f"      {method}, {samples} samples, {name}: relMSE {errors[name]:.5f}, flicker {flickers[name]:.4f}")
        details: dict[str, object] = {"relmse": errors, "flicker": flickers, "samples": samples}
        label = f"{scene}, {method}"
        note = ", ".join(f"{name}: relMSE {errors[name]:.4f}, flicker {100 * flickers[name]:.2f} %" for name in errors)
        figures.append(Figure("relMSE with the layered filter over without", label, errors["layered"], "", "no filter",
                              errors["none"], errors["layered"] / errors["none"], "≤ 1.0", note=note, details=details).judged())
        if "OpenImageDenoise" in errors:
            best = flickers["OpenImageDenoise"] / min(flickers.values()), errors["OpenImageDenoise"] / min(errors.values())
            figures.append(Figure("flicker and error of the default denoiser over the least of all", label, max(best),
                                  goal="≤ 1.0", note="OpenImageDenoise where it is found", details=details).judged())
    return figures


def measure(context: Context) -> list[Figure]:
    figures = compared("textured_room", *of_room(), context)
    try:
        figures += compared("country_kitchen", *of_kitchen(), context)
    except blenders.Unavailable as reason:
        context.say(f"      kitchen left out: {reason}")
    return figures
