# SPDX-License-Identifier: GPL-3.0-or-later
"""Time against measured error of every method on one scene: JSON, an SVG chart, a table.

Time is the wall time of the whole frame. Error is relMSE against independent parts of a path-traced reference, so that it
is free of the reference's noise; its error bar joins the reference's and that of the repeated renders.
"""

from __future__ import annotations

import json
import math
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from . import blenders, cache, chart, images, metrics, scenes

PARTS = 8


@dataclass(frozen=True)
class Setting:
    """One way of rendering: a method and the settings that differ from the scene's own."""

    method: str
    name: str
    values: tuple[tuple[str, Any], ...]


@dataclass
class Point:
    """What one setting took and gave. Errors are relMSE; believed is the error that the renderer itself believes."""

    method: str
    setting: str
    seconds: float
    error: float
    error_bar: float
    trimmed: float
    ms_ssim: float
    flip: float
    believed: float | None  # None: the method has a bias, which no spread of samples shows
    noise: float | None
    samples: float
    accuracy: float  # that was asked for; 0: exactly these samples
    in_use: bool = False


@dataclass
class Report:
    scene: str
    resolution: tuple[int, int]
    reference: dict[str, Any]
    points: list[Point] = field(default_factory=list)

    def to_json(self) -> dict[str, Any]:
        return asdict(self)


class Renderer(Protocol):
    """Renders one scene with settings; both kinds of FILE have one."""

    name: str
    resolution: tuple[int, int]
    key: dict[str, Any]

    def render(self, **settings: Any) -> tuple[np.ndarray, float, dict[str, Any]]:
        """(image, seconds of the whole frame, statistics)."""

    def close(self) -> None: ...


class ProceduralRenderer:
    """A procedural scene, rendered in this process."""

    def __init__(self, name: str, percent: int = 100) -> None:
        from .scenes.native import Built

        description = scenes.make(name)
        width, height = description.resolution
        self.name, self.resolution = name, (max(1, width * percent // 100), max(1, height * percent // 100))
        self.built = Built(description)
        self.key = {"scene": name, "resolution": self.resolution}

    def render(self, **settings: Any) -> tuple[np.ndarray, float, dict[str, Any]]:
        from . import Session, render

        width, height = self.resolution
        Session(self.built.scene, {"method": settings["method"]}).forget_cache()  # a frame is timed from nothing
        result = render(self.built, width=width, height=height, **settings)
        return result.image, result.seconds, result.statistics

    def close(self) -> None:
        pass


class BlenderRenderer:
    """A .blend file, rendered by one Blender that stays open; the file's own bounces and clamping count."""

    def __init__(self, path: str | Path, percent: int = 100) -> None:
        path = Path(path).resolve()
        if not path.is_file():
            raise FileNotFoundError(f"there is no file {path}")
        self.name = path.stem
        self.worker = blenders.Worker.of_debian()
        try:
            opened = self.worker.open(path, percent)
            if opened["problem"]:
                raise blenders.WorkerError(opened["problem"])
        except BaseException:
            self.worker.close()
            raise
        self.resolution = tuple(opened["resolution"])
        self.key = {"scene": cache.file_key(path), "resolution": self.resolution, "frame": opened["frame"]}
        self.in_use = opened["settings"]

    def render(self, **settings: Any) -> tuple[np.ndarray, float, dict[str, Any]]:
        answer = self.worker.render(as_references=False, **settings)
        pixels = images.read(answer["image"])
        Path(answer["image"]).unlink()
        return pixels, answer["seconds"], answer["statistics"]

    def close(self) -> None:
        self.worker.close()


def open_renderer(file: str, percent: int = 100) -> Renderer:
    """FILE: a path that ends in .blend, or the name of a procedural scene."""
    if file.endswith(".blend"):
        return BlenderRenderer(file, percent)
    return ProceduralRenderer(file, percent)


def ladder(methods: Sequence[str] | None = None) -> list[Setting]:
    """The settings to try: of path tracing sample counts and, where a denoiser is found, the same denoised; of every cached
    method the accuracies that it offers."""
    from . import denoisers, method_descriptions

    denoises = any(d["available"] for d in denoisers())
    result: list[Setting] = []
    for method in method_descriptions():
        if methods and method["id"] not in methods:
            continue
        if method["id"] == "PATH_TRACING":
            counts = (4, 16, 64, 256, 1024)
            result += [Setting("PATH_TRACING", f"{n} spp", (("samples", n), ("accuracy", 0.0))) for n in counts]
            if denoises:
                result += [Setting("PATH_TRACING + OIDN", f"{n} spp", (("samples", n), ("accuracy", 0.0), ("denoise", True)))
                           for n in (1, 4, 16, 64, 256)]
        elif method["id"] != "AUTO":
            result += [Setting(method["id"], f"accuracy {a:g}", (("accuracy", a),)) for a in (0.2, 0.1, 0.05, 0.02, 0.01)]
    return result


def reference(renderer: Renderer, samples: int, say: Callable[[str], None]) -> tuple[np.ndarray, bool]:
    """(PARTS, height, width, 3): independent path-traced images of `samples` samples together; and whether it was kept."""
    from . import __version__

    each = max(16, samples // PARTS)
    made = False

    def make() -> dict[str, Any]:
        nonlocal made
        made = True
        say(f"reference: {PARTS} parts of {each} samples")
        images = [renderer.render(method="PATH_TRACING", samples=each, accuracy=0.0, seed=1000 + i, denoise=False)[0][..., :3]
                  for i in range(PARTS)]
        return {"parts": np.stack(images)}

    key = {"kind": "reference", "samples": each, "parts": PARTS, "version": __version__, **renderer.key}
    return np.asarray(cache.arrays(key, make)["parts"]), not made


def was_cut(values: dict[str, Any], statistics: dict[str, Any], budget: float) -> bool:
    """Whether the time ended a render before its samples or its accuracy did. A pass that would not end in time is not begun:
    what was cut may have taken less than the budget."""
    if not values["accuracy"]:
        return bool(statistics["samples"] < values["samples"])
    noise = statistics.get("noise")
    return (noise is None or noise > values["accuracy"]) and statistics["elapsed"] > 0.5 * budget


def measure(renderer: Renderer, settings: Sequence[Setting], parts: np.ndarray, repeats: int, budget: float,
            say: Callable[[str], None], begin: Callable[[int, Setting], None] = lambda number, setting: None) -> list[Point]:
    """Every setting `repeats` times with another seed. A method's settings that would take more than `budget` s by what the last
    one took are left out; what takes longer all the same is cut there, and its point says so.
    begin: called with the number of each setting before it is rendered."""
    whole, points, spent = parts.mean(0), [], {}
    for number, setting in enumerate(settings):
        begin(number, setting)
        values = dict(setting.values)
        method = setting.method.split(" ")[0]
        effort = float(values.get("samples") or 1.0 / values["accuracy"])
        whole_time, rendering, before = spent.get(setting.method, (0.0, 0.0, effort))
        if whole_time + rendering * max(0.0, effort / before - 1.0) > budget:
            say(f"{setting.method} {setting.name}: left out, it would take more than {budget:g} s")
            continue
        errors, bars, seconds, shown, statistics = [], [], [], None, {}
        for repeat in range(repeats):
            image, took, statistics = renderer.render(method=method, seed=repeat, time_limit=budget, **values)
            estimate = metrics.halves_relmse(image, list(parts))
            errors.append(estimate.value)
            bars.append(estimate.error)
            seconds.append(took)
            shown = image
        # what is read and built before does not grow with the effort
        spent[setting.method] = (min(seconds), (statistics.get("seconds") or {}).get("render", min(seconds)), effort)
        spread = float(np.std(errors, ddof=1) / math.sqrt(repeats)) if repeats > 1 else 0.0
        assert shown is not None
        name = setting.name + (", cut" if was_cut(values, statistics, budget) else "")
        points.append(Point(
            setting.method, name, float(np.median(seconds)), float(np.mean(errors)),
            math.hypot(spread, float(np.mean(bars))),
            metrics.trimmed_relmse(shown, whole), metrics.ms_ssim(shown, whole) if min(shown.shape[:2]) >= 11 else float("nan"),
            metrics.flip(shown, whole), statistics.get("believed_error"), statistics.get("noise"),
            float(statistics.get("samples") or 0), float(values["accuracy"])))
        last = points[-1]
        say(f"{setting.method:24} {setting.name:14} {last.seconds:8.2f} s  relMSE {last.error:.5f} ± {last.error_bar:.5f}")
    return points


def run(file: str, *, percent: int = 100, samples: int = 4096, repeats: int = 2, budget: float = 60.0,
        methods: Sequence[str] | None = None, say: Callable[[str], None] = print) -> Report:
    """Everything for one file; `samples` are those of the whole reference."""
    renderer = open_renderer(file, percent)
    try:
        start = time.perf_counter()
        parts, kept = reference(renderer, samples, say)
        noise = float(np.mean((parts.std(0, ddof=1) ** 2 / len(parts)) / (parts.mean(0) ** 2 + metrics.error.FLOOR)))
        about = {"samples": samples, "parts": len(parts), "kept": kept, "own_error": noise,
                 "seconds": 0.0 if kept else time.perf_counter() - start}
        report = Report(renderer.name, tuple(renderer.resolution), about)  # type: ignore[arg-type]
        report.points = measure(renderer, ladder(methods), parts, repeats, budget, say)
        mark_in_use(report, getattr(renderer, "in_use", {}))
        return report
    finally:
        renderer.close()


def mark_in_use(report: Report, settings: dict[str, Any]) -> None:
    """Marks the point nearest to the settings that are in use: same method; of a caching one the nearest accuracy, of the path
    tracer the nearest count of samples, which an accuracy above 0 makes fewer."""
    if not settings:
        return
    method = settings.get("method", "AUTO")
    name = ("PATH_TRACING" if method == "AUTO" else method) + (" + OIDN" if settings.get("denoise") else "")
    same = [p for p in report.points if p.method == name]
    if not same:
        return
    accuracy, wanted = settings.get("accuracy", 0.0), max(1, settings.get("samples", 1))
    if same[0].accuracy > 0:
        min(same, key=lambda p: abs(math.log(p.accuracy / max(accuracy, 1e-6)))).in_use = True
        return
    if accuracy > 0 and same[-1].believed:
        wanted = max(1, min(wanted, same[-1].samples * (same[-1].believed / accuracy) ** 2))
    min(same, key=lambda p: abs(math.log(max(1.0, p.samples) / wanted))).in_use = True


def line_name(point: Point) -> str:
    """What a chart calls the line of a point's method."""
    return point.method.replace("_", " ").title().replace("Oidn", "OIDN") + (", by accuracy" if point.accuracy > 0 else "")


def label(point: Point) -> str:
    """A point's setting in few letters."""
    return point.setting.removeprefix("accuracy ")


def to_svg(report: Report) -> str:
    """The chart: seconds against relMSE, a line a method."""
    lines = []
    for method in dict.fromkeys(p.method for p in report.points):
        points = [p for p in report.points if p.method == method]
        marked = next((i for i, p in enumerate(points) if p.in_use), None)
        lines.append(chart.Line(line_name(points[0]), [(p.seconds, p.error) for p in points], [p.error_bar for p in points],
                                [label(p) for p in points], marked))
    width, height = report.resolution
    return chart.lines(f"{report.scene}, {width}×{height}", lines, "seconds for the whole frame", "relMSE against the reference")


def to_table(report: Report) -> str:
    rows = [("method", "setting", "seconds", "relMSE", "±", "trimmed", "MS-SSIM", "FLIP", "believed", "noise")]
    for p in report.points:
        believed, noise = ("–" if value is None else f"{value:.4f}" for value in (p.believed, p.noise))
        rows.append((p.method + (" *" if p.in_use else ""), p.setting, f"{p.seconds:.2f}", f"{p.error:.5f}", f"{p.error_bar:.5f}",
                     f"{p.trimmed:.5f}", f"{p.ms_ssim:.4f}", f"{p.flip:.4f}", believed, noise))
    return chart.table(rows)


def write(report: Report, folder: str | Path) -> tuple[Path, Path]:
    """JSON and SVG named after the scene; returns both paths."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    data, picture = folder / f"accuracy_{report.scene}.json", folder / f"accuracy_{report.scene}.svg"
    data.write_text(json.dumps(report.to_json(), indent=1) + "\n")
    picture.write_text(to_svg(report))
    return data, picture


def main(arguments: Any) -> int:
    """`python -m afterglow accuracy FILE`."""
    try:
        report = run(arguments.file, percent=arguments.percent, samples=arguments.samples, repeats=arguments.repeats,
                     budget=arguments.budget, methods=arguments.method or None)
    except (KeyError, FileNotFoundError, blenders.Unavailable, blenders.WorkerError) as error:
        print(f"afterglow accuracy: {error.args[0] if isinstance(error, KeyError) else error}", file=sys.stderr)
        return 2
    print(to_table(report))
    for path in write(report, arguments.output):
        print(path)
    return 0
