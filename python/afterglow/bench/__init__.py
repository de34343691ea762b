# SPDX-License-Identifier: GPL-3.0-or-later
"""The figures that the project promises, each measured beside its peer in the same run: python -m afterglow bench [NAME].

Writes <name>.json, <name>.svg and a table; ends with 1 when a figure misses its goal or could not be measured.
"""

from __future__ import annotations

import json
import sys
import time
import traceback
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

from .. import blenders, chart
from . import foundation
from .figure import Context, Figure
from .machine import machine, versions

Measure = Callable[[Context], list[Figure]]
SETS: dict[str, dict[str, Measure]] = {"foundation": foundation.FIGURES}


def run(name: str, context: Context, only: list[str]) -> list[Figure]:
    """All figures of one set. One that cannot be measured here stays in the list, with the reason."""
    figures: list[Figure] = []
    for key, measure in SETS[name].items():
        if only and not any(word in key for word in only):
            continue
        start = time.perf_counter()
        context.say(f"— {key}")
        try:
            made = measure(context)
        except blenders.Unavailable as reason:
            made = [Figure(key, "", note=f"not measured: {reason}", command=context.command(name, key))]
        except Exception as error:
            traceback.print_exc()
            made = [Figure(key, "", holds=False, note=f"failed: {type(error).__name__}: {error}", command=context.command(name, key))]
        for figure in made:
            figure.command = figure.command or context.command(name, key)
            figure.seconds = time.perf_counter() - start
            context.say("  " + figure.line())
        figures += made
    return figures


def write(name: str, figures: list[Figure], folder: Path) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{name}.json"
    data = {"machine": machine(), "versions": versions(), "figures": [asdict(figure) for figure in figures]}
    path.write_text(json.dumps(data, indent=1) + "\n")
    rows = [(f.title(), f.margin() or 0.0, f.relative_spread(), f.holds) for f in figures if f.value is not None]
    (folder / f"{name}.svg").write_text(chart.bars(f"{name}: margin to each goal", rows))
    return path


def table(figures: list[Figure]) -> str:
    rows: list[tuple[str, ...]] = [("figure", "scene", "value", "peer", "ratio", "goal", "holds")]
    for f in figures:
        holds = "not measured" if f.holds is None else "yes" if f.holds else "NO"
        ratio = "" if f.ratio is None else chart.number(f.ratio) + (f" ± {chart.number(f.spread)}" if f.spread else "")
        value = "" if f.value is None else f"{chart.number(f.value)} {f.unit}"
        peer = "" if f.peer_value is None else f"{chart.number(f.peer_value)} ({f.peer})"
        rows.append((f.figure, f.scene, value, peer, ratio, f.goal, holds))
    text = chart.table(rows)
    notes = [f"  {f.figure} {f.scene}: {f.note}" for f in figures if f.note]
    return text + ("\n\n" + "\n".join(notes) if notes else "")


def main(arguments: Any) -> int:
    names = arguments.name or list(SETS)
    unknown = [name for name in names if name not in SETS]
    if unknown:
        print(f"afterglow bench: no set {', '.join(unknown)}; there are {', '.join(SETS)}", file=sys.stderr)
        return 2
    missed = False
    for name in names:
        context = Context(Path(arguments.output), pairs=arguments.pairs)
        figures = run(name, context, arguments.only)
        path = write(name, figures, Path(arguments.output))
        print(table(figures))
        print(path)
        missed |= any(figure.holds is not True for figure in figures)
    return int(missed)
