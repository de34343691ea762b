# SPDX-License-Identifier: GPL-3.0-or-later
"""Instant radiosity (IGI), the cache filled anew in every frame (IC) and the one that is repaired (TIC), in one run."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Iterable
from functools import partial

from ... import scenes
from ...scenes import Description
from ..figure import Context, Figure, spread_of_median
from .paper import WHOLE_MOVING
from .watched import METHODS, Case, Frame, Watched, bunnies

# Two ways to direct and specular light alone.
TRACED, OWN = "path tracing without diffuse bounces", "the cache's own camera paths and film"

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
    "conference_room": Case(partial(scenes.make, "conference_room"), moving=(1.23, 0.17, 0.05)),
    "pillared_hall": Case(partial(scenes.make, "pillared_hall"), moving=(0.97, 0.42, 0.05)),
    "office_with_blinds": Case(partial(scenes.make, "office_with_blinds")),
}
ONE_MOVES = set(MOVING) - {"bunnies_2", "bunnies_4", "bunnies_9"}


def rounded(value: float | None) -> str:
    return "–" if value is None else f"{value:.2f}"


def whitted(make: Callable[[], Description]) -> Watched:
    """Direct and specular light alone, by path tracing. It traces one further ray from each first diffuse surface."""
    return Watched(make, "PATH_TRACING", diffuse_bounces=0)


def first_frame(context: Context) -> list[Figure]:
    figures = []
    for name, case in FIRST.items():
        found: dict[str, list[Frame]] = {"IC": [], "IGI": []}
        traced = []
        for _ in range(max(3, context.pairs)):
            for kind, frames in found.items():
                frames.append(Watched(case.make, METHODS[kind]).frame())
            traced.append(whitted(case.make).values()["elapsed"])
        ratios = [every.diffuse / cached.diffuse for every, cached in zip(found["IGI"], found["IC"])]
        cached, every = (statistics.median(f.diffuse for f in found[kind]) for kind in ("IC", "IGI"))
        paper = case.first[0] / case.first[1] if case.first else None
        figures.append(Figure("diffuse part of the first frame, IC over IGI", name, cached, "s", "instant radiosity", every,
                              statistics.median(ratios), "≥ 8", spread=spread_of_median(ratios),
                              note=f"paper: {rounded(paper)}",
                              details={"ratios": ratios, "paper": paper,
                                       "whitted": {TRACED: traced, OWN: [f.specular for f in found["IC"]]},
                                       "stages": {kind: [vars(f) for f in frames] for kind, frames in found.items()}}).judged())
    return figures


def mean(frames: Iterable[float]) -> float:
    return statistics.mean(frames)


def animation(context: Context) -> list[Figure]:
    """20 frames for every pair asked for: 100 with the usual five. Instant radiosity renders every tenth of them, for it does the
    same work in each."""
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
                    continue
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
    """A whole frame of the repaired cache against direct and specular light alone, by the faster of two ways: path tracing
    without diffuse bounces, and what the very same frames of the cache take for camera paths and film. In the box with mirrors
    nothing moves."""
    figures = []
    for name, case in {**MOVING, "cornell_mirror": FIRST["cornell_mirror"]}.items():
        start = case.make().frames[0]
        ours, traced = Watched(case.make, "INSTANT_CACHE"), whitted(case.make)
        ours.frame()
        whole: list[float] = []
        rivals: dict[str, list[float]] = {TRACED: [], OWN: []}
        for frame in range(1, max(6, 4 * context.pairs)):
            for watched in (ours, traced):
                watched.move_to(start + frame)
            whole.append(ours.values()["elapsed"])
            rivals[TRACED].append(traced.values()["elapsed"])
            rivals[OWN].append(ours.frame().specular)
        middles = {kind: statistics.median(times) for kind, times in rivals.items()}
        rival = min(middles, key=lambda kind: middles[kind])
        ratios = [a / b for a, b in zip(whole, rivals[rival])]
        paper = WHOLE_MOVING[name][0] / WHOLE_MOVING[name][3] if name in WHOLE_MOVING else None
        note = f"paper: {rounded(paper)}; " + ", ".join(f"{kind}: {seconds:.4f} s" for kind, seconds in middles.items())
        figures.append(Figure("whole frame, TIC over Whitted", name, statistics.median(whole), "s", rival, middles[rival],
                              statistics.median(ratios), "≤ 1.3", spread=spread_of_median(ratios), note=note,
                              details={"ratios": ratios, "seconds": whole, "whitted": rivals}).judged())
    return figures
