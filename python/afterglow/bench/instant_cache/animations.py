# SPDX-License-Identifier: GPL-3.0-or-later
"""Instant radiosity (IGI), the cache filled anew in every frame (IC) and the one that is repaired (TIC), in one run."""

from __future__ import annotations

import statistics
from collections.abc import Iterable
from functools import partial

from ... import scenes
from ..figure import Context, Figure, spread_of_median
from .watched import METHODS, Case, Frame, Watched, bunnies

# The paper's seconds: tables 2 (IGI, IC) and 4 (IGI, IC, TIC).
FIRST: dict[str, Case] = {
    "cornell_statue": Case(partial(scenes.make, "cornell_statue"), (0.43, 0.08)),
    "wobbling_cylinder": Case(partial(scenes.make, "wobbling_cylinder"), (0.37, 0.05)),
    "desk_with_chair": Case(partial(scenes.make, "desk_with_chair"), (0.56, 0.06)),
    "bunnies": Case(bunnies(9), (0.57, 0.11)),
    "cornell_mirror": Case(partial(scenes.make, "cornell_mirror")),
    "cornell_indirect": Case(partial(scenes.make, "cornell_indirect"), (0.55, 0.08)),
    "conference_room": Case(partial(scenes.make, "conference_room"), (1.23, 0.15)),
    "pillared_hall": Case(partial(scenes.make, "pillared_hall"), (0.97, 0.38)),
    "office_with_blinds": Case(partial(scenes.make, "office_with_blinds"), (0.51, 0.05)),
}
MOVING: dict[str, Case] = {
    "cornell_statue": Case(partial(scenes.make, "cornell_statue"), moving=(0.43, 0.09, 0.03)),
    "wobbling_cylinder": Case(partial(scenes.make, "wobbling_cylinder"), moving=(0.37, 0.09, 0.03)),
    "desk_with_chair": Case(partial(scenes.make, "desk_with_chair"), moving=(0.56, 0.09, 0.03)),
    "bunnies_1": Case(bunnies(1), moving=(0.56, 0.12, 0.03)),
    "bunnies_2": Case(bunnies(2), moving=(0.55, 0.13, 0.04)),
    "bunnies_4": Case(bunnies(4), moving=(0.55, 0.13, 0.05)),
    "bunnies_9": Case(bunnies(9), moving=(0.57, 0.12, 0.09)),
}
ONE_MOVES = {"cornell_statue", "wobbling_cylinder", "desk_with_chair", "bunnies_1"}
WHOLE = ("desk_with_chair", "bunnies_1", "cornell_mirror")


def rounded(value: float | None) -> str:
    return "–" if value is None else f"{value:.2f}"


def first_frame(context: Context) -> list[Figure]:
    figures = []
    for name, case in FIRST.items():
        found: dict[str, list[Frame]] = {"IC": [], "IGI": []}
        for _ in range(max(3, context.pairs)):
            for kind, frames in found.items():
                frames.append(Watched(case.make, METHODS[kind]).frame())
        ratios = [every.diffuse / cached.diffuse for every, cached in zip(found["IGI"], found["IC"])]
        cached, every = (statistics.median(f.diffuse for f in found[kind]) for kind in ("IC", "IGI"))
        paper = case.first[0] / case.first[1] if case.first else None
        figures.append(Figure("diffuse part of the first frame, IC over IGI", name, cached, "s", "instant radiosity", every,
                              statistics.median(ratios), "≥ 8", spread=spread_of_median(ratios),
                              note=f"paper: {rounded(paper)}",
                              details={"ratios": ratios, "paper": paper,
                                       "stages": {kind: [vars(f) for f in frames] for kind, frames in found.items()}}).judged())
    return figures


def mean(frames: Iterable[float]) -> float:
    return statistics.mean(frames)


def animation(context: Context) -> list[Figure]:
    """20 frames for every pair asked for: 100 with the usual five."""
    figures = []
    for name, case in MOVING.items():
        start = case.make().frames[0]
        live = {kind: Watched(case.make, method) for kind, method in METHODS.items()}
        frames: dict[str, list[Frame]] = {kind: [] for kind in live}
        for watched in live.values():
            watched.frame()
        rays = {"TIC": 0, "IC": 0}
        for frame in range(1, max(2, 20 * context.pairs)):
            for kind, watched in live.items():
                if kind == "IGI" and frame % 10:
                    continue  # the same work in every frame
                watched.move_to(start + frame, anew=kind == "IC")
                frames[kind].append(watched.frame())
                if kind != "IGI":
                    rays[kind] += int(watched.values()["visibility_rays_now"])
        diffuse = {kind: mean(f.diffuse for f in found) for kind, found in frames.items()}
        repair = {kind: mean(f.repair for f in found) for kind, found in frames.items()}
        stages = {kind: {stage: mean(getattr(f, stage) for f in found) for stage in vars(found[0])}
                  for kind, found in frames.items()}
        details = {"stages": stages, "rays": rays, "frames": len(frames["TIC"])}
        one = name in ONE_MOVES
        note = (f"paper: {rounded(case.paper(0, 2))}, over IC {rounded(case.paper(1, 2))}; "
                f"rays: {rays['TIC'] / max(rays['IC'], 1):.0%} of IC's")
        figures += [
            Figure("diffuse part, TIC over IGI", name, diffuse["TIC"], "s", "instant radiosity", diffuse["IGI"],
                   diffuse["IGI"] / diffuse["TIC"], "≥ 25" if one else "≥ 6.3", note=note, details=details).judged(),
            Figure("diffuse part, TIC over IC", name, diffuse["TIC"], "s", "filled anew", diffuse["IC"],
                   diffuse["IC"] / diffuse["TIC"], "≥ 3" if one else "≥ 0.95", note=note, details=details).judged(),
            Figure("update and filling, TIC over IC", name, repair["TIC"], "s", "filled anew", repair["IC"],
                   repair["IC"] / repair["TIC"], "≥ 8" if one else "≥ 1.3" if name == "bunnies_9" else "≥ 0.95", note=note,
                   details=details).judged(),
        ]
    return figures


def whole_frame(context: Context) -> list[Figure]:
    """A whole frame of the repaired cache against direct and specular light alone, the same walks without diffuse bounces."""
    figures = []
    for name in WHOLE:
        make = MOVING[name].make if name in MOVING else FIRST[name].make
        start = make().frames[0]
        ours, whitted = Watched(make, "INSTANT_CACHE"), Watched(make, "PATH_TRACING", diffuse_bounces=0)
        ratios, times = [], []
        for frame in range(1, max(6, 4 * context.pairs)):
            for watched in (ours, whitted):
                watched.move_to(start + frame)
            times.append((ours.values()["elapsed"], whitted.values()["elapsed"]))
            ratios.append(times[-1][0] / times[-1][1])
        figures.append(Figure("whole frame, TIC over Whitted", name, statistics.median(t[0] for t in times), "s",
                              "direct and specular only", statistics.median(t[1] for t in times), statistics.median(ratios),
                              "≤ 1.3", spread=spread_of_median(ratios), note="paper: 0.89 to 3.56",
                              details={"ratios": ratios}).judged())
    return figures
