# SPDX-License-Identifier: GPL-3.0-or-later
"""The rays that the renderer traced, replayed through native/rays and through bare Embree calls, in turns on one thread."""

from __future__ import annotations

import statistics

from ... import scenes
from ..figure import Context, Figure, spread_of_median

SCENES = ("cornell_box", "conference_room", "pillared_hall")
KINDS = (("closest", "closest_origins", "closest_directions"), ("occluded", "occluded_origins", "occluded_targets"))


def measure(context: Context) -> list[Figure]:
    from ..._native import measure_rays, record_rays
    from ...scenes.native import Built

    figures = []
    for name in SCENES:
        built = Built(scenes.make(name))
        built.set_camera((320, 180), 1)
        built.scene.commit()
        rays = record_rays(built.scene, {"width": 320, "height": 180, "samples": 4, "method": "PATH_TRACING"}, most=300_000)
        for kind, origins, ends in KINDS:
            count = len(rays[origins])
            times = measure_rays(built.scene, rays[origins], rays[ends], kind=kind, rounds=4 * max(5, context.pairs))
            wrapped, bare = list(map(float, times["wrapped"])), list(map(float, times["bare"]))
            speed = [theirs / ours for ours, theirs in zip(wrapped, bare)]
            figure = Figure(f"replayed {kind} rays", name, count / 1e6 / statistics.median(wrapped), "Mray/s", "bare Embree",
                            count / 1e6 / statistics.median(bare), statistics.median(speed), "≥ 0.8",
                            spread=spread_of_median(speed),
                            details={"rays": count, "hits": int(times["hits_wrapped"]), "ratios": speed}).judged()
            if times["hits_wrapped"] != times["hits_bare"]:  # then the comparison says nothing
                figure.holds, figure.note = False, f"hits differ: {times['hits_wrapped']} and {times['hits_bare']}"
            figures.append(figure)
    return figures
