# SPDX-License-Identifier: GPL-3.0-or-later
"""One measured figure, and what all share: alternating pairs, their median and spread, the table."""

from __future__ import annotations

import json
import math
import statistics
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from .. import chart


@dataclass
class Figure:
    """A figure of build/bench/<name>.json. ratio: value against peer, so that more is better where the goal is "≥"."""

    figure: str
    scene: str
    value: float | None = None
    unit: str = ""
    peer: str = ""
    peer_value: float | None = None
    ratio: float | None = None
    goal: str = ""
    holds: bool | None = None
    command: str = ""
    spread: float | None = None
    note: str = ""
    seconds: float = 0.0
    details: dict[str, object] = field(default_factory=dict)

    def judged(self) -> Figure:
        """Sets `holds` from the goal ("≥ 1.2", "≤ 0.012", "= 0"), read on the ratio where there is one."""
        sign, number = self.goal.split()
        actual = self.ratio if self.ratio is not None else self.value
        wanted = float(number)
        if actual is None or not math.isfinite(actual):
            self.holds = False
        else:
            self.holds = bool({"≥": actual >= wanted, "≤": actual <= wanted, "=": actual == wanted}[sign])
        return self

    def margin(self) -> float | None:
        """How far beyond its goal: above 1 it is met, whichever way the goal points."""
        actual = self.ratio if self.ratio is not None else self.value
        if actual is None or not self.goal:
            return None
        sign, number = self.goal.split()
        wanted = float(number)
        if sign == "=":
            return 1.0 if actual == wanted else 0.1
        if sign == "≥":
            return actual / wanted
        return min(10.0, wanted / actual) if actual > 0 else 10.0

    def relative_spread(self) -> float | None:
        actual, margin = self.ratio if self.ratio is not None else self.value, self.margin()
        return self.spread / actual * margin if self.spread and actual and margin else None

    def verdict(self) -> str:
        """"" for what has no goal, and stands beside another figure."""
        return "yes" if self.holds else "" if self.holds is None and not self.goal else "NO"

    def title(self) -> str:
        return f"{self.figure}{', ' + self.scene if self.scene else ''}"

    def line(self) -> str:
        actual = self.ratio if self.ratio is not None else self.value
        shown = "–" if actual is None else f"{actual:.4g}"
        spread = f" ± {self.spread:.2g}" if self.spread else ""
        verdict = {"yes": "holds", "": self.note, "NO": f"MISSED {self.note}"}[self.verdict()]
        return f"{self.title()}: {shown}{spread} (goal {self.goal or '–'}) {verdict}"


@dataclass
class Context:
    """What every measurement is given: where it may write, how many pairs, how to speak."""

    output: Path
    pairs: int = 5
    say: Callable[[str], None] = print

    def command(self, name: str, key: str) -> str:
        return f"make bench NAME={name} FIGURE={key}"


@dataclass(frozen=True)
class Pairs:
    """Ratios of alternating pairs; `spread` is the standard error of their median."""

    ours: list[float]
    theirs: list[float]

    @property
    def ratios(self) -> list[float]:
        return [a / b for a, b in zip(self.ours, self.theirs)]

    @property
    def median(self) -> float:
        return statistics.median(self.ratios)

    @property
    def spread(self) -> float:
        """1.25 · σ / √n with σ = 1.48 · MAD: the standard error of a median of nearly normal values."""
        return spread_of_median(self.ratios)


def spread_of_median(values: list[float]) -> float:
    middle = statistics.median(values)
    deviation = statistics.median(abs(value - middle) for value in values)
    return 1.2533 * 1.4826 * deviation / math.sqrt(len(values))


def alternate(count: int, ours: Callable[[], float], theirs: Callable[[], float]) -> Pairs:
    """Measures both in turns, the first of each pair changing, so that the machine's moods meet both."""
    a: list[float] = []
    b: list[float] = []
    for i in range(count):
        for mine in (True, False) if i % 2 == 0 else (False, True):
            (a if mine else b).append(ours() if mine else theirs())
    return Pairs(a, b)


def table(figures: list[Figure]) -> str:
    """What was measured, for people."""
    rows: list[tuple[str, ...]] = [("figure", "scene", "value", "peer", "ratio", "goal", "holds")]
    for f in figures:
        spread = f" ± {chart.number(f.spread)}" if f.spread else ""
        ratio = "" if f.ratio is None else chart.number(f.ratio) + spread
        value = "" if f.value is None else f"{chart.number(f.value)} {f.unit}" + ("" if f.ratio is not None else spread)
        peer = "" if f.peer_value is None else f"{chart.number(f.peer_value)} ({f.peer})"
        rows.append((f.figure, f.scene, value, peer, ratio, f.goal, f.verdict()))
    notes = [f"  {f.title()}: {f.note}" for f in figures if f.note]
    return chart.table(rows) + ("\n\n" + "\n".join(notes) if notes else "") + "\n"


FOLDER = Path("build/bench")


def recorded(name: str, files: Sequence[str | Path] = ()) -> list[dict[str, Any]]:
    """The figures of these details files, or of all that runs of a set left in build/bench; of two of the same, the newer.
    Raises FileNotFoundError where there is none."""
    paths = sorted((Path(f) for f in files or FOLDER.glob(f"{name}*_details.json")), key=lambda path: path.stat().st_mtime)
    if not paths:
        raise FileNotFoundError(f"{FOLDER} has no figures: make bench NAME={name}")
    found = {(f["figure"], f["scene"]): f for path in paths for f in json.loads(path.read_text())["figures"]}
    return list(found.values())
