# SPDX-License-Identifier: GPL-3.0-or-later
"""Flicker of a still view: the cache alive, a new seed in every frame. Rival: Cycles with OpenImageDenoise, 4 samples."""

from __future__ import annotations

from ... import blenders, images, metrics
from ..figure import Context, Figure
from ..foundation.kitchen import PERCENT, scene

FRAMES, SAMPLES = 4, 16


def measure(context: Context) -> list[Figure]:
    """Persistent data keep the cache alive between the renders, as between the frames of an animation."""
    file, reference = scene()
    truth = images.read(reference)
    with blenders.Worker.of_official("5.0") as worker:
        worker.open(file, PERCENT)
        ours = [images.read(worker.render("AFTERGLOW", samples=SAMPLES, accuracy=0.0, method="INSTANT_CACHE", seed=seed,
                                          persistent=True)["image"]) for seed in range(FRAMES + 1)][1:]
        theirs = [images.read(worker.render("CYCLES", samples=4, denoise=True, seed=seed)["image"]) for seed in range(FRAMES)]
    mine, rival = (metrics.still_flicker(frames, truth) for frames in (ours, theirs))
    return [Figure("flicker of a still view", "country_kitchen 640×360", 100 * mine.value, "%", "Cycles + OIDN, 4 spp",
                   100 * rival.value, None, "≤ 0.3", spread=100 * mine.error,
                   note=f"{SAMPLES} samples a pixel, which stay where nothing changes").judged()]
