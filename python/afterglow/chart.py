# SPDX-License-Identifier: GPL-3.0-or-later
"""Charts as SVG, without a library: lines over logarithmic axes with error bars, and bars against their goals."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from xml.sax.saxutils import escape

# Colours that differ in lightness, too (Okabe and Ito 2008), and a marker for each.
COLORS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000")
MARKERS = ("circle", "square", "diamond", "triangle")
WIDTH, HEIGHT, LEFT, RIGHT, TOP, BOTTOM = 640, 400, 70, 20, 40, 55


@dataclass
class Line:
    """Points (x, y) with an optional error of each y, a label of each point, and one point that stands out."""

    name: str
    points: Sequence[tuple[float, float]]
    errors: Sequence[float] = ()
    labels: Sequence[str] = ()
    marked: int | None = None


@dataclass
class Axis:
    """A logarithmic or linear axis over [low, high], mapped to [start, end] in the picture."""

    low: float
    high: float
    start: float
    end: float
    log: bool = True
    ticks: list[float] = field(default_factory=list)

    def __post_init__(self) -> None:
        if self.log:
            first, last = math.floor(math.log10(self.low)), math.ceil(math.log10(self.high))
            steps = (1,) if last - first > 4 else (1, 2, 5)
            self.ticks = [m * 10.0**e for e in range(first, last + 1) for m in steps]
            inside = [t for t in self.ticks if self.low <= t <= self.high]
            self.ticks = inside or [self.low, self.high]
        else:
            raw = (self.high - self.low) / 6 or 1.0
            power = 10 ** math.floor(math.log10(raw))
            step = min((m * power for m in (1, 2, 5, 10)), key=lambda s: abs(s - raw))
            count = int((self.high - self.low) / step + 1e-9)
            self.ticks = [math.ceil(self.low / step) * step + i * step for i in range(count + 1)]
            self.ticks = [t for t in self.ticks if t <= self.high * (1 + 1e-9)]

    def at(self, value: float) -> float:
        if self.log:
            share = (math.log(max(value, 1e-30)) - math.log(self.low)) / (math.log(self.high) - math.log(self.low))
        else:
            share = (value - self.low) / (self.high - self.low)
        return self.start + min(max(share, -0.02), 1.02) * (self.end - self.start)


class Labels:
    """Finds each label a place beside its point where it covers no other and no point; what finds none is left out."""

    SIDES = ((0, 1), (0, -1), (1, 0), (-1, 0), (1, 1), (-1, 1), (1, -1), (-1, -1))

    def __init__(self, points: Sequence[tuple[float, float]], radius: float) -> None:
        self.radius = radius
        self.taken = [(x - radius, y - radius, x + radius, y + radius) for x, y in points]

    def place(self, x: float, y: float, width: float, height: float) -> tuple[float, float] | None:
        """The label's middle for the point (x, y)."""
        for right, up in self.SIDES:
            at_x, at_y = x + right * (self.radius + 2 + width / 2), y + up * (self.radius + 2 + height / 2)
            box = (at_x - width / 2, at_y - height / 2, at_x + width / 2, at_y + height / 2)
            if not any(box[0] < b[2] and b[0] < box[2] and box[1] < b[3] and b[1] < box[3] for b in self.taken):
                self.taken.append(box)
                return at_x, at_y
        return None


def number(value: float) -> str:
    """Short, with as many digits as it takes."""
    if value == 0:
        return "0"
    if 1e-4 <= abs(value) < 1e5:
        return f"{value:.4g}"
    return f"{value:.1e}"


def _text(x: float, y: float, text: str, anchor: str = "middle", size: int = 12, extra: str = "") -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" font-size="{size}" {extra}>{escape(text)}</text>'


def _marker(kind: str, x: float, y: float, color: str, size: float = 4.0) -> str:
    if kind == "circle":
        return f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{size}" fill="{color}"/>'
    shapes = {"square": ((-1, -1), (1, -1), (1, 1), (-1, 1)), "diamond": ((0, -1.3), (1.3, 0), (0, 1.3), (-1.3, 0)),
              "triangle": ((0, -1.3), (1.2, 0.9), (-1.2, 0.9))}
    points = " ".join(f"{x + size * a:.1f},{y + size * b:.1f}" for a, b in shapes[kind])
    return f'<polygon points="{points}" fill="{color}"/>'


def _frame(title: str, body: list[str], width: int = WIDTH, height: int = HEIGHT) -> str:
    return "\n".join([
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}" '
        'font-family="sans-serif" fill="#222">',
        f'<rect width="{width}" height="{height}" fill="#fff"/>', _text(width / 2, 22, title, size=15), *body, "</svg>", ""])


def _range(values: Sequence[float], log: bool) -> tuple[float, float]:
    usable = [v for v in values if math.isfinite(v) and (v > 0 or not log)]
    if not usable:
        return (0.1, 1.0) if log else (0.0, 1.0)
    low, high = min(usable), max(usable)
    if log:
        return low / 1.25, high * 1.25
    return min(0.0, low), high * 1.05 if high > 0 else 1.0


def lines(title: str, series: Sequence[Line], x_name: str, y_name: str, log: tuple[bool, bool] = (True, True)) -> str:
    """A chart of lines as SVG text. Points that a logarithmic axis cannot show are left out."""
    xs = [x for line in series for x, _ in line.points]
    ys = [y for line in series for _, y in line.points]
    x_axis = Axis(*_range(xs, log[0]), LEFT, WIDTH - RIGHT, log[0])
    y_axis = Axis(*_range(ys, log[1]), HEIGHT - BOTTOM, TOP, log[1])
    body = []
    for tick in x_axis.ticks:
        x = x_axis.at(tick)
        body.append(f'<path d="M{x:.1f} {TOP}V{HEIGHT - BOTTOM}" stroke="#ddd"/>')
        body.append(_text(x, HEIGHT - BOTTOM + 16, number(tick), size=11))
    for tick in y_axis.ticks:
        y = y_axis.at(tick)
        body.append(f'<path d="M{LEFT} {y:.1f}H{WIDTH - RIGHT}" stroke="#ddd"/>')
        body.append(_text(LEFT - 6, y + 4, number(tick), "end", 11))
    body.append(_text((LEFT + WIDTH - RIGHT) / 2, HEIGHT - 14, x_name))
    middle = (TOP + HEIGHT - BOTTOM) / 2
    body.append(_text(16, middle, y_name, extra=f'transform="rotate(-90 16 {middle:.0f})"'))
    labels = Labels([(x_axis.at(x), y_axis.at(y)) for line in series for x, y in line.points if x > 0 and y > 0], 5)
    for i, line in enumerate(series):
        color, marker = COLORS[i % len(COLORS)], MARKERS[i % len(MARKERS)]
        shown = [(j, x, y) for j, (x, y) in enumerate(line.points)
                 if math.isfinite(x) and math.isfinite(y) and (x > 0 or not log[0]) and (y > 0 or not log[1])]
        path = " ".join(f"{x_axis.at(x):.1f},{y_axis.at(y):.1f}" for _, x, y in shown)
        body.append(f'<polyline points="{path}" fill="none" stroke="{color}" stroke-width="1.8"/>')
        for j, x, y in shown:
            px, py = x_axis.at(x), y_axis.at(y)
            if j < len(line.errors) and math.isfinite(line.errors[j]):
                top, bottom = y_axis.at(y + line.errors[j]), y_axis.at(max(y - line.errors[j], 1e-30 if log[1] else -1e30))
                body.append(f'<path d="M{px:.1f} {top:.1f}V{bottom:.1f}M{px - 3:.1f} {top:.1f}h6M{px - 3:.1f} {bottom:.1f}h6" '
                            f'stroke="{color}"/>')
            body.append(_marker(marker, px, py, color))
            if j == line.marked:
                body.append(f'<circle cx="{px:.1f}" cy="{py:.1f}" r="9" fill="none" stroke="{color}" stroke-width="2"/>')
            place = labels.place(px, py, 5.5 * len(line.labels[j]), 10) if j < len(line.labels) else None
            if place is not None:
                body.append(_text(place[0], place[1] + 3.5, line.labels[j], size=10, extra=f'fill="{color}"'))
        body.append(_marker(marker, WIDTH - RIGHT + 16, TOP + 14 + 16 * i, color))
        body.append(_text(WIDTH - RIGHT + 26, TOP + 18 + 16 * i, line.name, "start"))
    # Names stand beside the lines: wherever among them, some would run through.
    return _frame(title, body, width=WIDTH + 26 + round(7 * max((len(line.name) for line in series), default=0)))


def bars(title: str, rows: Sequence[tuple[str, float, float | None, bool | None]]) -> str:
    """Rows (name, value over goal, its spread or None, holds or None) as bars on a logarithmic axis; 1 is the goal."""
    height = TOP + 34 * len(rows) + BOTTOM
    low, high = _range([0.5, 2.0, *(v for _, v, _, _ in rows if v > 0)], True)
    left = max(250, 12 + round(6.2 * max((len(name) for name, *_ in rows), default=0)))
    axis = Axis(low, high, left, left + WIDTH - 250 - RIGHT)
    body = []
    for tick in axis.ticks:
        body.append(f'<path d="M{axis.at(tick):.1f} {TOP}V{height - BOTTOM}" stroke="#ddd"/>')
        body.append(_text(axis.at(tick), height - BOTTOM + 16, number(tick), size=11))
    for i, (name, value, spread, holds) in enumerate(rows):
        y = TOP + 8 + 34 * i
        color = "#999" if holds is None else COLORS[2] if holds else COLORS[1]
        start, end = sorted((axis.at(1.0), axis.at(max(value, low))))
        body.append(f'<rect x="{start:.1f}" y="{y}" width="{max(1.0, end - start):.1f}" height="18" fill="{color}"/>')
        if spread:
            a, b = axis.at(max(value - spread, low)), axis.at(value + spread)
            body.append(f'<path d="M{a:.1f} {y + 9}H{b:.1f}" stroke="#222" stroke-width="1.5"/>')
        body.append(_text(left - 6, y + 13, name, "end", 11))
    body.append(f'<path d="M{axis.at(1.0):.1f} {TOP - 4}V{height - BOTTOM + 4}" stroke="#222" stroke-width="1.5"/>')
    body.append(_text(axis.at(1.0), height - 18, "goal = 1, right of it is better", size=12))
    return _frame(title, body, height=height, width=left + WIDTH - 250)


def table(rows: Sequence[Sequence[str]]) -> str:
    """Columns of text in line; the first row is the head."""
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    text = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths)).rstrip() for row in rows]
    return "\n".join([text[0], "  ".join("-" * width for width in widths), *text[1:]])
