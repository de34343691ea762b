# SPDX-License-Identifier: GPL-3.0-or-later
"""The figures that the project promises, each measured beside its peer in the same run: python -m afterglow bench [NAME].

Writes <name>.json, <name>.svg and a table as each figure comes in; ends with 1 when a figure misses its goal or could not be
measured. Spreads, single measurements and notes stand in <name>_details.json. References and pictures of rivals are kept by
key under build/cache; times never are.
"""

from __future__ import annotations

import json
import math
import os
import sys
import time
import traceback
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from .. import blenders, chart
from . import foundation, hash_cache, instant_cache
from .figure import Context, Figure, table
from .machine import machine, versions

Measure = Callable[[Context], list[Figure]]
SETS: dict[str, Mapping[str, Measure]] = {
    "foundation": foundation.FIGURES, "hash_cache": hash_cache.FIGURES, "instant_cache": instant_cache.FIGURES}
# What a figure of <name>.json has.
COLUMNS = ("figure", "scene", "value", "unit", "peer", "peer_value", "ratio", "goal", "holds", "command")


def chosen(name: str, wanted: list[str]) -> list[str]:
    """The keys of a set that are named, wholly or in part; all when none is. Raises KeyError for what names nothing."""
    keys = list(SETS[name])
    for word in wanted:
        if not any(word in key for key in keys):
            raise KeyError(f"{name} has no figure '{word}'; it has {', '.join(keys)}")
    exact = [key for key in keys if key in wanted]
    return exact or [key for key in keys if not wanted or any(word in key for word in wanted)]


def measured(name: str, key: str, context: Context) -> list[Figure]:
    """The figures of one key. What cannot be measured here stays in the list, with the reason."""
    command = context.command(name, key)
    try:
        made = SETS[name][key](context)
    except blenders.Unavailable as reason:
        made = [Figure(key, "", holds=False, note=f"not measured: {reason}")]
    except Exception as error:
        traceback.print_exc()
        made = [Figure(key, "", holds=False, note=f"failed: {type(error).__name__}: {error}")]
    for figure in made:
        figure.command = figure.command or command
    return made


def run(name: str, context: Context, keys: list[str], done: Callable[[list[Figure]], object] = lambda _: None) -> list[Figure]:
    """All figures of these keys; `done` is called with those so far after each."""
    figures: list[Figure] = []
    start = time.perf_counter()
    for number, key in enumerate(keys, 1):
        began = time.perf_counter()
        context.say(f"[{number}/{len(keys)}] {key} ({clock(began - start)} so far)")
        made = measured(name, key, context)
        for figure in made:
            figure.seconds = (time.perf_counter() - began) / len(made)
            context.say("      " + figure.line())
        figures += made
        done(figures)
    return figures


def clock(seconds: float) -> str:
    return f"{int(seconds) // 60}:{int(seconds) % 60:02d}"


def plain(value: Any) -> Any:
    """As JSON can have it: numpy's numbers as Python's, and null for what is not finite."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple, np.ndarray)):
        return [plain(item) for item in value]
    if isinstance(value, (bool, np.bool_)):
        return bool(value)
    if isinstance(value, (float, np.floating)):
        return float(value) if math.isfinite(value) else None
    return int(value) if isinstance(value, np.integer) else value


def write(name: str, figures: list[Figure], folder: Path, about: Mapping[str, Any] | None = None) -> Path:
    """<name>.json, <name>_details.json and <name>.svg in the folder; the path of the first."""
    folder.mkdir(parents=True, exist_ok=True)
    about = dict(about or {"machine": machine(), "versions": versions()})
    rows = [plain(vars(figure)) for figure in figures]
    path = folder / f"{name}.json"
    for file, content in ((path, [{column: row[column] for column in COLUMNS} for row in rows]),
                          (folder / f"{name}_details.json", rows)):
        file.write_text(json.dumps({**about, "figures": content}, indent=1, ensure_ascii=False) + "\n")
    bars = [(f.title(), f.margin(), f.relative_spread(), bool(f.holds)) for f in figures]
    shown = [(title, margin, spread, holds)
             for title, margin, spread, holds in bars if margin is not None and math.isfinite(margin)]
    if shown:
        (folder / f"{name}.svg").write_text(chart.bars(f"{name}: margin to each goal", shown))
    return path


def main(arguments: Any) -> int:
    names = arguments.name or list(SETS)
    try:
        unknown = [name for name in names if name not in SETS]
        if unknown:
            raise KeyError(f"no set {', '.join(unknown)}; there are {', '.join(SETS)}")
        keys = {name: chosen(name, arguments.figure) for name in names}
    except KeyError as error:
        print(f"afterglow bench: {error.args[0]}", file=sys.stderr)
        return 2
    if arguments.list:
        print("\n".join(f"{name} {key}" for name in names for key in keys[name]))
        return 0
    os.environ.setdefault("AFTERGLOW_CACHE", str(blenders.project() / "build" / "cache"))
    about = {"machine": machine(), "versions": versions()}
    folder = Path(arguments.output)
    missed = False
    for name in names:
        # A run of single figures leaves the whole table as it is.
        file = name if keys[name] == list(SETS[name]) else "_".join([name, *keys[name]])
        context = Context(folder, pairs=max(1, arguments.pairs))
        start = time.perf_counter()
        figures = run(name, context, keys[name], lambda so_far, file=file: write(file, so_far, folder, about))  # type: ignore[misc]
        print(table(figures))
        judged = [figure for figure in figures if figure.verdict()]
        missing = [figure for figure in judged if figure.holds is not True]
        print(f"{len(judged) - len(missing)} of {len(judged)} hold; {clock(time.perf_counter() - start)}; "
              f"{folder / file}.json, .svg")
        missed |= bool(missing)
    return int(missed)
