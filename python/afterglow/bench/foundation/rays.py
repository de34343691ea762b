# SPDX-License-Identifier: GPL-3.0-or-later
"""The rays that the renderer traced, replayed through native/rays and through bare Embree calls, in turns on one thread."""

from __future__ import annotations

import statistics

from ... import scenes
from ..figure import Context, Figure

SCENES = ("cornell_box", "conference_room", "pillared_hall")


def measure(context: Context) -> list[Figure]:
    from ..._native import measure_rays, record_rays
    from ...scenes.native import Built

    figures = []
    for name in SCENES:
        built = Built(scenes.make(name))
        built.set_camera((96, 64), 1)
        built.scene.commit()
        rays = record_rays(built.scene, {"width": 96, "height": 64, "samples": 4, "method": "PATH_TRACING"})
        for kind, origins, ends in (("closest", "closest_origins", "closest_directions"), ("occluded", "occluded_origins", "occluded_targets")):
            count = len(rays[origins])
            times = measure_rays(built.scene, rays[origins], rays[ends], kind=kind, rounds=2 * max(5, context.pairs))
            speed = [bare / ours for ours, bare in zip(times["wrapped"], times["bare"])]
            middle = statistics.median(speed)
            spread = 1.2533 * 1.4826 * statistics.median(abs(s - middle) for s in speed) / len(speed) ** 0.5
            millions = count / 1e6
            figure = Figure(f"replayed {kind} rays", name, millions / statistics.median(times["wrapped"]), "Mray/s", "bare Embree",
                            millions / statistics.median(times["bare"]), middle, "≥ 0.8", spread=spread,
                            details={"rays": count, "hits": int(times["hits_wrapped"])}).judged()
            if times["hits_wrapped"] != times["hits_bare"]:  # then the comparison says nothing
                figure.holds, figure.note = False, f"hits differ: {times['hits_wrapped']} and {times['hits_bare']}"
            figures.append(figure)
    return figures
