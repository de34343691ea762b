# SPDX-License-Identifier: GPL-3.0-or-later
"""Tables in the form of Debattista et al. 2009, ours beside theirs, from what the bench measured:
python -m afterglow.bench.instant_cache.tables [details.json ...], all of build/bench by default. Table 3 counts frames a second;
table 5 has the share of pixels with FLIP above 0.1 in place of HDR-VDP's."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping
from statistics import median
from typing import Any

from ... import chart
from ..figure import recorded
from .animations import FIRST, MOVING

Row = tuple[str, ...]
# The paper's whole frames: table 1, seconds of the first one by IGI and IC; table 3, frames a second by IGI, IC and TIC. Table 5:
# per cent of the pixels that HDR-VDP would have seen to differ from path tracing and from IGI, with a probability above 75 %.
WHOLE_FIRST: dict[str, tuple[float, float]] = {
    "cornell_statue": (0.59, 0.21), "wobbling_cylinder": (0.62, 0.19), "desk_with_chair": (0.76, 0.21), "bunnies": (0.72, 0.33),
    "cornell_indirect": (0.77, 0.24), "conference_room": (1.58, 0.45), "pillared_hall": (1.27, 0.85),
    "office_with_blinds": (0.78, 0.23)}
WHOLE_MOVING: dict[str, tuple[float, float, float]] = {
    "cornell_statue": (2.11, 6.01, 10.45), "wobbling_cylinder": (1.63, 2.79, 8.95), "desk_with_chair": (1.31, 4.92, 8.94),
    "bunnies_1": (1.49, 3.42, 9.13), "bunnies_2": (1.45, 3.55, 8.04), "bunnies_4": (1.46, 3.51, 5.81),
    "bunnies_9": (1.47, 3.54, 3.56)}
DIFFERENT: dict[str, tuple[float, float]] = {
    "cornell_statue": (0.57, 0.0), "wobbling_cylinder": (0.13, 0.0), "desk_with_chair": (2.11, 0.02), "bunnies": (0.21, 0.0),
    "cornell_mirror": (0.91, 0.0), "cornell_indirect": (1.86, 0.33), "conference_room": (1.61, 0.16),
    "pillared_hall": (0.18, 0.06), "office_with_blinds": (0.45, 0.23)}


def seconds(stages: Mapping[str, float], whole: bool) -> float:
    """Of the diffuse part, or of the whole frame."""
    names = ["update", "fill", "interpolate", "filter", *(["walk", "film"] if whole else [])]
    return sum(stages[name] for name in names)


def middle(frames: Iterable[Mapping[str, float]], whole: bool) -> float:
    return median(seconds(stages, whole) for stages in frames)


def numbers(*values: float | None) -> Row:
    return tuple("–" if value is None else f"{value:.2f}" for value in values)


def by_key(figures: list[dict[str, Any]], figure: str) -> dict[str, dict[str, Any]]:
    return {str(f["scene"]): f for f in figures if f["figure"] == figure and f["value"] is not None}


def first(figures: list[dict[str, Any]], whole: bool) -> list[Row]:
    """Tables 1 (whole) and 2 (diffuse part)."""
    rows: list[Row] = [("scene", "IGI s", "IC s", "IC over IGI", "paper: IGI s", "IC s", "IC over IGI")]
    for name, figure in by_key(figures, "diffuse part of the first frame, IC over IGI").items():
        stages = figure["details"]["stages"]
        every, cached = (middle(stages[kind], whole) for kind in ("IGI", "IC"))
        paper = WHOLE_FIRST.get(name) if whole else FIRST[name].first
        theirs = (*paper, paper[0] / paper[1]) if paper else (None, None, None)
        rows.append((name, *numbers(every, cached, every / cached, *theirs)))
    return rows


def moving(figures: list[dict[str, Any]], whole: bool) -> list[Row]:
    """Tables 3 (frames a second of the whole) and 4 (seconds of the diffuse part)."""
    rows: list[Row] = [("animation", "IGI", "IC", "TIC", "TIC over IGI", "TIC over IC", "paper: IGI", "IC", "TIC", "TIC over IGI",
                        "TIC over IC")]
    for name, figure in by_key(figures, "diffuse part, TIC over IGI").items():
        every, fresh, kept = (seconds(figure["details"]["stages"][kind], whole) for kind in ("IGI", "IC", "TIC"))
        paper = WHOLE_MOVING.get(name) if whole else MOVING[name].moving
        theirs: tuple[float | None, ...] = (None,) * 5
        if paper:
            over = (paper[2] / paper[0], paper[2] / paper[1]) if whole else (paper[0] / paper[2], paper[1] / paper[2])
            theirs = (*paper, *over)
        shown = (1 / every, 1 / fresh, 1 / kept) if whole else (every, fresh, kept)
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
