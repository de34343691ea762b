# SPDX-License-Identifier: GPL-3.0-or-later
"""One measured figure, and the ways of measuring that all share: alternating pairs, their median and spread."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path


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
        self.holds = actual is not None and math.isfinite(actual) and {
            "≥": actual >= wanted, "≤": actual <= wanted, "=": actual == wanted}[sign]
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

    def title(self) -> str:
        return f"{self.figure}{', ' + self.scene if self.scene else ''}"

    def line(self) -> str:
        actual = self.ratio if self.ratio is not None else self.value
        shown = "–" if actual is None else f"{actual:.4g}"
        return f"{self.title()}: {shown} (goal {self.goal or '–'}) {'holds' if self.holds else self.note or 'MISSED'}"


@dataclass
class Context:
    """What every measurement is given: where it may write, how many pairs, how to speak."""

    output: Path
    pairs: int = 5
    say: Callable[[str], None] = print

    def command(self, name: str, key: str) -> str:
        return f"python3 -m afterglow bench {name} --only {key}"


@dataclass(frozen=True)
class Pairs:
    """Ratios of alternating pairs; `spread` is the standard error of the median's neighbourhood (MAD-based)."""

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
        middle = self.median
        deviation = statistics.median(abs(r - middle) for r in self.ratios)
        return 1.2533 * 1.4826 * deviation / math.sqrt(len(self.ratios))


def alternate(count: int, ours: Callable[[], float], theirs: Callable[[], float]) -> Pairs:
    """Measures both in turns, the first of each pair changing, so that the machine's moods meet both."""
    a: list[float] = []
    b: list[float] = []
    for i in range(count):
        for mine in (True, False) if i % 2 == 0 else (False, True):
            (a if mine else b).append(ours() if mine else theirs())
    return Pairs(a, b)
