# SPDX-License-Identifier: GPL-3.0-or-later
"""Tables in the form of Debattista et al. 2009, ours beside theirs, from what the bench measured:
python -m afterglow.bench.instant_cache.tables [details.json ...], all of build/bench by default. RT is Whitted's ray tracing:
direct and specular light alone. Table 3 counts frames a second, RT's from the figure `whole_frame`; table 5 has the share of
pixels with FLIP above 0.1 in place of HDR-VDP's."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping
from statistics import median
from typing import Any

from ... import chart
from ..figure import recorded
from .animations import FIRST, MOVING
from .paper import DIFFERENT, WHOLE_FIRST, WHOLE_MOVING

Row = tuple[str, ...]


def seconds(stages: Mapping[str, float], whole: bool) -> float:
    """Of the diffuse part, or of the whole frame."""
    names = ["update", "fill", "interpolate", "filter", *(["walk", "film"] if whole else [])]
    return sum(stages[name] for name in names)


def middle(frames: Iterable[Mapping[str, float]], whole: bool) -> float:
    return median(seconds(stages, whole) for stages in frames)


def fastest(whitted: Mapping[str, list[float]] | None) -> float | None:
    """Seconds of a frame of direct and specular light alone, by whichever way was the faster one."""
    return min(median(times) for times in whitted.values()) if whitted else None


def numbers(*values: float | None) -> Row:
    return tuple("–" if value is None else f"{value:.2f}" for value in values)


def by_key(figures: list[dict[str, Any]], figure: str) -> dict[str, dict[str, Any]]:
    return {str(f["scene"]): f for f in figures if f["figure"] == figure and f["value"] is not None}


def first(figures: list[dict[str, Any]], whole: bool) -> list[Row]:
    """Tables 1 (whole) and 2 (diffuse part)."""
    names = (*(["RT s"] if whole else []), "IGI s", "IC s", "IC over IGI")
    rows: list[Row] = [("scene", *names, "paper: " + names[0], *names[1:])]
    for name, figure in by_key(figures, "diffuse part of the first frame, IC over IGI").items():
        details = figure["details"]
        every, cached = (middle(details["stages"][kind], whole) for kind in ("IGI", "IC"))
        ours: tuple[float | None, ...] = (every, cached, every / cached)
        paper = WHOLE_FIRST.get(name) if whole else FIRST[name].first
        theirs: tuple[float | None, ...] = (*paper, paper[-2] / paper[-1]) if paper else (None,) * (4 if whole else 3)
        if whole:
            ours = (fastest(details.get("whitted")), *ours)
        rows.append((name, *numbers(*ours, *theirs)))
    return rows


def moving(figures: list[dict[str, Any]], whole: bool) -> list[Row]:
    """Tables 3 (frames a second of the whole) and 4 (seconds of the diffuse part)."""
    names = (*(["RT"] if whole else []), "IGI", "IC", "TIC", "TIC over IGI", "TIC over IC")
    rows: list[Row] = [("animation", *names, "paper: " + names[0], *names[1:])]
    whitted = by_key(figures, "whole frame, TIC over Whitted")
    for name, figure in by_key(figures, "diffuse part, TIC over IGI").items():
        every, fresh, kept = (seconds(figure["details"]["stages"][kind], whole) for kind in ("IGI", "IC", "TIC"))
        theirs: tuple[float | None, ...]
        if whole:
            direct = fastest(whitted[name]["details"].get("whitted")) if name in whitted else None
            speeds = WHOLE_MOVING.get(name)
            theirs = (*speeds, speeds[3] / speeds[1], speeds[3] / speeds[2]) if speeds else (None,) * 6
            shown: tuple[float | None, ...] = (1 / direct if direct else None, 1 / every, 1 / fresh, 1 / kept)
        else:
            paper = MOVING[name].moving
            theirs = (*paper, paper[0] / paper[2], paper[1] / paper[2]) if paper else (None,) * 5
            shown = (every, fresh, kept)
        rows.append((name, *numbers(*shown, every / kept, fresh / kept, *theirs)))
    return rows


def differences(figures: list[dict[str, Any]]) -> list[Row]:
    """Table 5."""
    rows: list[Row] = [("scene", "pixels that differ from IGI, %", "relMSE against path tracing", "paper: from IGI, %",
                        "from path tracing, %")]
    errors = by_key(figures, "relMSE against path tracing, finest setting")
    for name, figure in by_key(figures, "pixels with FLIP above 0.1, IC against IGI").items():
        traced, instant = DIFFERENT.get(name, (None, None))
        error = f"{errors[name]['value']:.4f}" if name in errors else "–"
        rows.append((name, *numbers(figure["value"]), error, *numbers(instant, traced)))
    return rows


def tables(figures: list[dict[str, Any]]) -> str:
    parts = [("Table 1: first frame, whole", first(figures, True)), ("Table 2: first frame, diffuse part", first(figures, False)),
             ("Table 3: animations, frames a second", moving(figures, True)),
             ("Table 4: animations, seconds of the diffuse part", moving(figures, False)),
             ("Table 5: differences", differences(figures))]
    return "\n\n".join(f"{title}\n\n{chart.table(rows)}" for title, rows in parts if len(rows) > 1)


if __name__ == "__main__":
    print(tables(recorded("instant_cache", sys.argv[1:])))
