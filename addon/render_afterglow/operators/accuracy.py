# SPDX-License-Identifier: GPL-3.0-or-later
"""The accuracy chart: wall time against measured error of every method on the current scene, in the background.

The same measurement as `afterglow accuracy FILE`, with the scene read once from the open file: a path-traced reference
in independent parts, then every method at several settings. The chart is an image of the file.
"""

import threading
import time
from collections.abc import Callable
from typing import Any

import bpy
import numpy as np

from .. import backend
from ..native_scene import NativeScene
from ..properties.scene import session_settings
from ..sync import sync_camera_final
from . import chart

job: "Job | None" = None


class StoppedError(Exception):
    """The user stopped the measurement."""


class SceneRenderer:
    """Renders the scene that was read, as `afterglow.accuracy` asks renderers to."""

    def __init__(self, context: bpy.types.Context, percent: int) -> None:
        scene, depsgraph = context.scene, context.evaluated_depsgraph_get()
        view = sync_camera_final(None, depsgraph)
        if view is None:
            raise ValueError(f"the scene '{scene.name}' has no camera")
        self.native = NativeScene()
        self.native.sync_with(depsgraph)
        self.native.scene.set_camera(**view.camera)
        self.native.scene.commit(flatten=True)  # as a final render does: the chart shows its times
        self.name = scene.name
        self.resolution = (max(8, view.width * percent // 100), max(8, view.height * percent // 100))
        self.key: dict[str, Any] = {"scene": scene.name}
        self.settings = session_settings(scene, viewport=False)
        self.in_use = {name: self.settings[name] for name in ("method", "samples", "denoise", "accuracy")}
        self.stop = threading.Event()
        self.fraction = 0.0

    def render(self, **settings: Any) -> tuple[np.ndarray, float, dict[str, Any]]:
        """(image, seconds of the whole frame, statistics)."""
        width, height = self.resolution
        size = {"width": width, "height": height, "region": (0, 0, width, height), "passes": ["combined"]}
        session = backend.afterglow.Session(self.native.scene, {**self.settings, "time_limit": 0.0, **settings, **size})
        session.forget_cache()  # the chart shows what a frame takes from nothing
        start = time.perf_counter()
        session.start()
        while not session.wait(0.05):
            self.fraction = session.progress()["fraction"]
            if self.stop.is_set():
                session.cancel()
                raise StoppedError
        self.fraction = 0.0
        return session.read("combined")[..., :3].copy(), time.perf_counter() - start, dict(session.statistics())

    def close(self) -> None:
        pass


class Job:
    """One measurement: a thread that renders, and what the panel shows of it."""

    def __init__(self, renderer: SceneRenderer, samples: int, repeats: int, budget: float) -> None:
        from importlib import import_module

        self.accuracy = import_module(backend.afterglow.__name__ + ".accuracy")
        self.renderer, self.samples, self.repeats, self.budget = renderer, samples, repeats, budget
        self.settings = self.accuracy.ladder()
        self.total = self.accuracy.PARTS + len(self.settings) * repeats
        self.count = 0
        self.stage, self.problem = "Reference", ""
        self.report: Any = None
        self.thread = threading.Thread(target=self._run, name="Afterglow accuracy", daemon=True)

    def _run(self) -> None:
        try:
            self.report = self._measure()
        except StoppedError:
            self.problem = "stopped"
        except Exception as error:  # whatever it is, the panel tells it
            self.problem = str(error)

    def _measure(self) -> Any:
        accuracy, renderer = self.accuracy, self.renderer
        each = max(16, self.samples // accuracy.PARTS)
        parts = []
        for number in range(accuracy.PARTS):
            part = {"method": "PATH_TRACING", "samples": each, "accuracy": 0.0, "denoise": False, "seed": 1000 + number}
            parts.append(renderer.render(**part)[0])
            self.count += 1
        report = accuracy.Report(renderer.name, renderer.resolution, {"samples": each * accuracy.PARTS})

        def begin(number: int, setting: Any) -> None:
            self.stage = f"{setting.method} {setting.name}"
            self.count = accuracy.PARTS + number * self.repeats

        report.points = accuracy.measure(
            renderer, self.settings, np.stack(parts), self.repeats, self.budget, lambda text: None, begin
        )
        accuracy.mark_in_use(report, renderer.in_use)
        return report

    @property
    def progress(self) -> float:
        return min(1.0, (self.count + self.renderer.fraction) / self.total)


def chart_of(report: Any) -> chart.Chart:
    """The report as lines to draw."""
    from importlib import import_module

    accuracy = import_module(backend.afterglow.__name__ + ".accuracy")
    width, height = report.resolution
    it = chart.Chart(f"{report.scene}, {width} x {height}")
    for point in report.points:
        it.lines.setdefault(accuracy.line_name(point), []).append(
            chart.Point(point.seconds, point.error, point.error_bar, accuracy.label(point), point.in_use)
        )
    return it


def redraw_panels() -> None:
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "PROPERTIES":
                area.tag_redraw()


def look_after() -> float | None:
    """Called by Blender's timer: shows progress, and the chart at the end."""
    global job
    if job is None:
        return None
    redraw_panels()
    if job.thread.is_alive():
        return 0.25
    finished, job = job, None
    if finished.report is not None:
        chart.show(chart_of(finished.report))
    elif finished.problem != "stopped":
        print("Afterglow: accuracy chart:", finished.problem)
    return None


def stop_all() -> None:
    """Ends a measurement that runs: the add-on is disabled, or another file is opened."""
    global job
    if job is not None:
        job.renderer.stop.set()
        job.thread.join()
        job = None


class AFTERGLOW_OT_accuracy_chart(bpy.types.Operator):
    bl_idname = "afterglow.accuracy_chart"
    bl_label = "Accuracy Chart"
    bl_description = (
        "Measure time and error of every method on this scene, in the background, and show the chart in an image "
        "editor. The setting in use has a ring"
    )

    percent: bpy.props.IntProperty(
        name="Resolution",
        description="Part of the render's resolution",
        default=25,
        min=1,
        max=100,
        subtype="PERCENTAGE",
    )
    samples: bpy.props.IntProperty(
        name="Reference Samples", description="Samples of the reference, in all its parts", default=1024, min=128
    )
    repeats: bpy.props.IntProperty(name="Repeats", description="Renders of every setting", default=1, min=1, max=16)
    budget: bpy.props.FloatProperty(
        name="Time of a Render",
        description="Settings that take longer are left out",
        default=30.0,
        min=0.1,
        subtype="TIME",
        unit="TIME",
    )
    wait: bpy.props.BoolProperty(name="Wait", description="Return only when the chart is there", options={"HIDDEN"})

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return backend.afterglow is not None and job is None and context.scene.camera is not None

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        return context.window_manager.invoke_props_dialog(self)

    def execute(self, context: bpy.types.Context) -> set[str]:
        global job
        try:
            job = Job(SceneRenderer(context, self.percent), self.samples, self.repeats, self.budget)
        except (ValueError, backend.afterglow.Error) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        job.thread.start()
        if self.wait:
            running = job
            job.thread.join()
            look_after()
            if running.problem:
                self.report({"ERROR"}, running.problem)
                return {"CANCELLED"}
        else:
            bpy.app.timers.register(look_after, first_interval=0.25)
        return {"FINISHED"}


class AFTERGLOW_OT_accuracy_stop(bpy.types.Operator):
    bl_idname = "afterglow.accuracy_stop"
    bl_label = "Stop"
    bl_description = "Stop measuring; nothing is kept"

    def execute(self, context: bpy.types.Context) -> set[str]:
        stop_all()
        return {"FINISHED"}


def draw_progress(layout: bpy.types.UILayout, draw_idle: Callable[[bpy.types.UILayout], None]) -> None:
    """The running measurement with a button to stop it, or what is offered when none runs."""
    if job is None:
        draw_idle(layout)
        return
    row = layout.row(align=True)
    if hasattr(row, "progress"):
        row.progress(factor=job.progress, text=f"{job.stage}  {job.progress:.0%}")
    else:
        row.label(text=f"{job.stage}  {job.progress:.0%}", icon="TIME")
    row.operator("afterglow.accuracy_stop", text="", icon="CANCEL")


classes = (AFTERGLOW_OT_accuracy_chart, AFTERGLOW_OT_accuracy_stop)
