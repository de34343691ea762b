# SPDX-License-Identifier: GPL-3.0-or-later
"""An accuracy chart as an image: wall time against measured error, both axes logarithmic, one line a method.

Lines are drawn into an array by numpy; letters come from Blender's own font through the graphics card, where there is a
window, and are left out in the background.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, field

import bpy
import numpy as np

from .. import backend

WIDTH, HEIGHT = 960, 640
LEFT, RIGHT, BOTTOM, TOP = 90, 30, 70, 60
BACKGROUND, GRID, INK = (0.12, 0.12, 0.13), (0.22, 0.22, 0.24), (0.85, 0.85, 0.85)
COLOURS = (
    (0.98, 0.72, 0.25),
    (0.35, 0.70, 0.98),
    (0.45, 0.85, 0.50),
    (0.95, 0.45, 0.45),
    (0.75, 0.55, 0.95),
    (0.5, 0.9, 0.9),
)


@dataclass
class Point:
    """One measured render: seconds of wall time, relMSE with the half width of its 95 % interval; used: the scene's own
    setting."""

    seconds: float
    error: float
    error_bar: float = 0.0
    label: str = ""
    used: bool = False


@dataclass
class Chart:
    title: str
    lines: dict[str, list[Point]] = field(default_factory=dict)


def decades(values: list[float]) -> tuple[int, int]:
    """The powers of ten that enclose some positive values."""
    good = [value for value in values if value > 0 and math.isfinite(value)]
    if not good:
        return -1, 0
    low, high = math.floor(math.log10(min(good))), math.ceil(math.log10(max(good)))
    return low, max(high, low + 1)


class Canvas:
    """A picture to draw lines and disks into, row 0 at the bottom."""

    def __init__(self) -> None:
        self.pixels = np.empty((HEIGHT, WIDTH, 4), np.float32)
        self.pixels[...] = (*BACKGROUND, 1.0)
        self.rows, self.columns = np.mgrid[0:HEIGHT, 0:WIDTH].astype(np.float32)
        self.texts: list[tuple[float, float, str, int, tuple[float, float, float]]] = []

    def _blend(self, coverage: np.ndarray, colour: tuple[float, float, float]) -> None:
        coverage = np.clip(coverage, 0.0, 1.0)[..., None]
        self.pixels[..., :3] += coverage * (np.array(colour, np.float32) - self.pixels[..., :3])

    def line(
        self, x0: float, y0: float, x1: float, y1: float, colour: tuple[float, float, float], width: float = 1.0
    ) -> None:
        dx, dy = x1 - x0, y1 - y0
        along = ((self.columns - x0) * dx + (self.rows - y0) * dy) / max(dx * dx + dy * dy, 1e-9)
        along = np.clip(along, 0.0, 1.0)
        distance = np.hypot(self.columns - x0 - along * dx, self.rows - y0 - along * dy)
        self._blend(width / 2 + 0.5 - distance, colour)

    def disk(self, x: float, y: float, radius: float, colour: tuple[float, float, float], ring: float = 0.0) -> None:
        distance = np.hypot(self.columns - x, self.rows - y)
        self._blend(ring / 2 + 0.5 - np.abs(distance - radius) if ring else radius + 0.5 - distance, colour)

    def text(self, x: float, y: float, words: str, size: int = 14, colour: tuple[float, float, float] = INK) -> None:
        self.texts.append((x, y, words, size, colour))

    def write_texts(self) -> None:
        """Lays the words over the picture; does nothing where there is no graphics card to write with."""
        if bpy.app.background or not self.texts:
            return
        import blf
        import gpu
        from mathutils import Matrix

        offscreen = gpu.types.GPUOffScreen(WIDTH, HEIGHT)
        with offscreen.bind():
            frame = gpu.state.active_framebuffer_get()
            frame.clear(color=(0.0, 0.0, 0.0, 0.0))
            with gpu.matrix.push_pop():
                gpu.matrix.load_matrix(Matrix.Identity(4))
                gpu.matrix.load_projection_matrix(
                    Matrix(((2 / WIDTH, 0, 0, -1), (0, 2 / HEIGHT, 0, -1), (0, 0, 1, 0), (0, 0, 0, 1)))
                )
                gpu.state.blend_set("ALPHA")
                for x, y, words, size, _colour in self.texts:
                    blf.size(0, size, *((72,) if bpy.app.version < (4, 0, 0) else ()))
                    width = blf.dimensions(0, words)[0]
                    blf.color(0, 1.0, 1.0, 1.0, 1.0)
                    blf.position(0, round(x - width / 2), round(y), 0)
                    blf.draw(0, words)
                gpu.state.blend_set("NONE")
            data = frame.read_color(0, 0, WIDTH, HEIGHT, 4, 0, "FLOAT")
        offscreen.free()
        coverage = np.array(data.to_list(), np.float32).reshape(HEIGHT, WIDTH, 4)[..., 0]
        self._blend(coverage, INK)


def draw(chart: Chart) -> np.ndarray:
    """The chart as (height, width, 4) display values, row 0 at the bottom."""
    points = [point for line in chart.lines.values() for point in line]
    x_low, x_high = decades([point.seconds for point in points])
    y_low, y_high = decades([point.error for point in points])
    canvas = Canvas()

    def place(seconds: float, error: float) -> tuple[float, float]:
        across = (math.log10(max(seconds, 1e-12)) - x_low) / (x_high - x_low)
        up = (math.log10(max(error, 1e-12)) - y_low) / (y_high - y_low)
        return LEFT + across * (WIDTH - LEFT - RIGHT), BOTTOM + min(max(up, 0.0), 1.0) * (HEIGHT - BOTTOM - TOP)

    for power in range(x_low, x_high + 1):
        x, y = place(10.0**power, 10.0**y_low)
        canvas.line(x, BOTTOM, x, HEIGHT - TOP, GRID)
        canvas.text(x, BOTTOM - 22, f"{10.0**power:g} s")
    for power in range(y_low, y_high + 1):
        x, y = place(10.0**x_low, 10.0**power)
        canvas.line(LEFT, y, WIDTH - RIGHT, y, GRID)
        canvas.text(LEFT - 42, y - 5, f"{10.0**power:g}")
    canvas.text(WIDTH / 2, HEIGHT - 32, chart.title, 18)
    canvas.text(WIDTH / 2, 16, "wall time of the whole frame")
    canvas.text(LEFT - 20, HEIGHT - TOP + 12, "error (relMSE)")
    from importlib import import_module

    labels = import_module(backend.afterglow.__name__ + ".chart").Labels(
        [place(point.seconds, point.error) for point in points if point.seconds > 0 and point.error > 0], 6
    )
    for number, (name, line) in enumerate(chart.lines.items()):
        colour = COLOURS[number % len(COLOURS)]
        line = sorted((p for p in line if p.error > 0 and p.seconds > 0), key=lambda p: p.seconds)
        places = [place(p.seconds, p.error) for p in line]
        for (x0, y0), (x1, y1) in itertools.pairwise(places):
            canvas.line(x0, y0, x1, y1, colour, 2.0)
        for point, (x, y) in zip(line, places, strict=True):
            low, high = (
                place(point.seconds, max(point.error - point.error_bar, 1e-12))[1],
                place(point.seconds, point.error + point.error_bar)[1],
            )
            canvas.line(x, low, x, high, colour)
            canvas.disk(x, y, 4.0, colour)
            if point.used:
                canvas.disk(x, y, 10.0, INK, ring=2.0)
            where = labels.place(x, y, 7.0 * len(point.label), 11) if point.label else None
            if where is not None:
                canvas.text(where[0], where[1] - 4, point.label, 11)
        canvas.line(
            WIDTH - 260, HEIGHT - TOP - 16 - 22 * number, WIDTH - 230, HEIGHT - TOP - 16 - 22 * number, colour, 3.0
        )
        canvas.text(WIDTH - 110, HEIGHT - TOP - 21 - 22 * number, name)
    canvas.write_texts()
    return canvas.pixels


def show(chart: Chart, name: str = "Afterglow Accuracy") -> bpy.types.Image:
    """Draws the chart into an image of this file and shows it in an image editor, where one is open."""
    pixels = draw(chart)
    image = bpy.data.images.get(name)
    if image is None or tuple(image.size) != (WIDTH, HEIGHT):
        if image is not None:
            bpy.data.images.remove(image)
        image = bpy.data.images.new(name, WIDTH, HEIGHT, alpha=False)
    image.pixels.foreach_set(np.ascontiguousarray(pixels).ravel())
    image.update()
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "IMAGE_EDITOR":
                area.spaces.active.image = image
                area.tag_redraw()
    return image
