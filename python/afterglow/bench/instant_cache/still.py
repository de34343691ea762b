# SPDX-License-Identifier: GPL-3.0-or-later
"""Flicker of a still view: the cache alive, a new seed in every frame. Rival: Cycles with OpenImageDenoise, 4 samples. Where
nothing changes a render keeps its samples, too, so that nothing is left to flicker; what the cache does alone, every sample taken
anew, stands beside, without a goal."""

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

        def ours(keep: bool) -> metrics.Estimate:
            worker.open(file, PERCENT)  # the caches of before are gone
            frames = [images.read(worker.render("AFTERGLOW", samples=SAMPLES, accuracy=0.0, method="INSTANT_CACHE", seed=seed,
                                                persistent=True, carry_over=keep)["image"]) for seed in range(FRAMES + 1)]
            return metrics.still_flicker(frames[1:], truth)

        kept, anew = ours(True), ours(False)
        theirs = [images.read(worker.render("CYCLES", samples=4, denoise=True, seed=seed)["image"]) for seed in range(FRAMES)]
    rival = metrics.still_flicker(theirs, truth)
    where, peer = "country_kitchen 640×360", "Cycles + OIDN, 4 spp"
    return [Figure("flicker of a still view", where, 100 * kept.value, "%", peer, 100 * rival.value, None, "≤ 0.3",
                   spread=100 * kept.error, note=f"{SAMPLES} samples a pixel, which stay where nothing changes").judged(),
            Figure("flicker of a still view, samples taken anew", where, 100 * anew.value, "%", peer, 100 * rival.value,
                   spread=100 * anew.error, note=f"{SAMPLES} samples a pixel; the cache alone is kept")]
