# SPDX-License-Identifier: GPL-3.0-or-later
"""Images by one and by two threads: not one value may differ."""

from __future__ import annotations

import numpy as np

from ... import blenders, images, scenes
from ..figure import Context, Figure
from .kitchen import scene


def measure(context: Context) -> list[Figure]:
    from ... import render
    from ...scenes.native import Built

    figures = []
    for name in ("cornell_box", "cornell_glass", "many_lights", "sun_and_sky", "spheres"):
        built = Built(scenes.make(name))
        one, two = (render(built, width=128, height=96, samples=16, threads=n, seed=5).image for n in (1, 2))
        figures.append(_figure(name, one, two))
    try:
        file, _ = scene()
    except blenders.Unavailable as reason:
        context.say(f"      kitchen left out: {reason}")
        return figures
    with blenders.Worker.of_debian() as worker:
        worker.open(file, 25)
        pictures = [images.read(worker.render(samples=4, threads=n, seed=5, accuracy=0.0)["image"]) for n in (1, 2)]
    return [*figures, _figure("country_kitchen", *pictures)]


def _figure(name: str, one: np.ndarray, two: np.ndarray) -> Figure:
    return Figure("largest difference between 1 and 2 threads", name, float(np.abs(one - two).max()), "", "itself", 0.0,
                  None, "= 0").judged()
