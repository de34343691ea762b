# SPDX-License-Identifier: GPL-3.0-or-later
"""Tables in the form of Debattista et al. 2009, ours beside theirs, from what the bench measured:
python -m afterglow.bench.instant_cache.tables [build/bench/instant_cache_details.json]. Table 3 counts frames a second; table 5
has the share of pixels with FLIP above 0.1 in place of HDR-VDP's."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path
from statistics import median
from typing import Any

from ... import chart
from .animations import FIRST, MOVING

Row = tuple[str, ...]


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
    """Tables 1 (whole) and 2 (diffuse part): the paper's numbers of the whole frame are not repeated."""
    rows: list[Row] = [("scene", "IGI s", "IC s", "IC over IGI", "paper")]
    for name, figure in by_key(figures, "diffuse part of the first frame, IC over IGI").items():
        stages = figure["details"]["stages"]
        every, cached = (middle(stages[kind], whole) for kind in ("IGI", "IC"))
        paper = FIRST[name].first
        rows.append((name, *numbers(every, cached, every / cached, None if whole or not paper else paper[0] / paper[1])))
    return rows


def moving(figures: list[dict[str, Any]], whole: bool) -> list[Row]:
    """Tables 3 (frames a second of the whole) and 4 (seconds of the diffuse part)."""
    rows: list[Row] = [("animation", "IGI", "IC", "TIC", "TIC over IGI", "TIC over IC", "paper, over IGI", "paper, over IC")]
    for name, figure in by_key(figures, "diffuse part, TIC over IGI").items():
        every, fresh, kept = (seconds(figure["details"]["stages"][kind], whole) for kind in ("IGI", "IC", "TIC"))
        case = MOVING[name]
        paper = (None, None) if whole else (case.paper(0, 2), case.paper(1, 2))
        shown = (1 / every, 1 / fresh, 1 / kept) if whole else (every, fresh, kept)
        rows.append((name, *numbers(*shown, every / kept, fresh / kept, *paper)))
    return rows


def differences(figures: list[dict[str, Any]]) -> list[Row]:
    """Table 5."""
    rows: list[Row] = [("scene", "pixels that differ from IGI, %", "relMSE against path tracing")]
    errors = by_key(figures, "relMSE against path tracing, finest setting")
    for name, figure in by_key(figures, "pixels with FLIP above 0.1, IC against IGI").items():
        rows.append((name, *numbers(figure["value"]), f"{errors[name]['value']:.4f}" if name in errors else "–"))
    return rows


def tables(figures: list[dict[str, Any]]) -> str:
    parts = [("Table 1: first frame, whole", first(figures, True)), ("Table 2: first frame, diffuse part", first(figures, False)),
             ("Table 3: animations, frames a second", moving(figures, True)),
             ("Table 4: animations, seconds of the diffuse part", moving(figures, False)),
             ("Table 5: differences", differences(figures))]
    return "\n\n".join(f"{title}\n\n{chart.table(rows)}" for title, rows in parts if len(rows) > 1)


if __name__ == "__main__":
    path = Path(sys.argv[1] if len(sys.argv) > 1 else "build/bench/instant_cache_details.json")
    print(tables(json.loads(path.read_text())["figures"]))
