# SPDX-License-Identifier: GPL-3.0-or-later
"""The viewport: a native session in the background, whose newest picture is drawn whenever Blender redraws the region.

Blender's data are read in `view_update` and `view_draw` alone; a thread of ours only watches the session and asks for
redraws. Nothing here waits for a picture: while the first one of a new state is not there, the last one stays.
"""

from __future__ import annotations

import threading
import time
import traceback
import weakref
from collections.abc import Callable
from typing import Any

import bpy
import numpy as np

from . import backend, display, store
from .native_scene import NativeScene
from .properties.scene import mist_settings, session_settings
from .sync import CameraView, sync_camera_view
from .sync.scene import viewport_shading

_NOTHING = object()
WATCH_SECONDS = 0.015  # how often the watcher looks for a newer picture
AWAIT_SECONDS = 0.1  # how long a redraw waits for the first picture after an edit, at most
HOLD_SECONDS = 0.15  # how long the render leaves the processor to the drawing of that picture, at most
REDRAW_SECONDS = 0.05  # between two redraws of a picture that refines slowly, at least


class Watcher(threading.Thread):
    """Asks Blender for a redraw whenever the session has a newer picture. Holds the engine weakly: Blender frees it
    when it likes."""

    def __init__(self, engine: bpy.types.RenderEngine) -> None:
        super().__init__(name="Afterglow viewport", daemon=True)
        self._engine = weakref.ref(engine)
        self._stop = threading.Event()
        self._wake = threading.Event()
        self._session: Any = None
        self._seen = -1
        self._shown = threading.Event()
        self._held = False
        self._holding = threading.Lock()

    def watch(self, session: Any) -> None:
        """Looks at this session from now on."""
        self._session, self._seen = session, -1
        self._wake.set()

    def wake(self) -> None:
        self._wake.set()

    def stop(self) -> None:
        self._stop.set()
        self._wake.set()
        self._shown.set()

    def hold(self) -> None:
        """Pauses the render until Blender has shown what it draws now: with processors for both, pictures of graphics
        drivers in software come several times later."""
        with self._holding:
            self._session.pause()
            self._shown.clear()
            self._held = True
        self._wake.set()
        bpy.app.timers.register(self.shown)  # runs when the window was drawn

    def shown(self) -> None:
        self._shown.set()

    def release(self) -> None:
        """Ends a hold at once."""
        with self._holding:
            if self._held:
                self._held = False
                self._session.resume()
                self._shown.set()

    def run(self) -> None:
        last = 0.0
        while not self._stop.is_set():
            self._wake.wait()
            self._wake.clear()
            while not self._stop.is_set():
                if self._held:
                    self._shown.wait(HOLD_SECONDS)
                    self.release()
                session = self._session
                if session is None:
                    break
                progress = session.progress()
                running = progress["state"] == "running"
                now = time.perf_counter()
                early = progress["samples"] <= 2
                if progress["generation"] != self._seen and (not running or early or now - last >= REDRAW_SECONDS):
                    self._seen, last = progress["generation"], now
                    if not self._redraw():
                        return
                if not running:
                    break
                session = None
                time.sleep(WATCH_SECONDS)

    def _redraw(self) -> bool:
        engine = self._engine()
        if engine is None:
            return False
        try:
            engine.tag_redraw()
        except ReferenceError:  # Blender freed the engine in the meantime
            return False
        return True


class Viewport:
    """One 3D viewport in rendered mode."""

    def __init__(self, engine: bpy.types.RenderEngine) -> None:
        self.native: NativeScene | None = None
        self.key = ("", "")  # under which the native scene rests when this viewport is closed
        self.session: Any = None
        self.picture: display.Picture | None = None
        self.generation = -1
        self.awaited = -1  # the picture of before the last edit; -1: a newer one is there
        self.waited = False  # whether a redraw has waited for that newer one already
        self.view: CameraView | None = None
        self.settings: dict[str, Any] = {}
        self.shading: Any = None  # scene's or studio's lights and world, as they were synced
        self.shown: tuple[Any, ...] | None = None  # what decides which objects this view shows, as it was last
        self.local_view: list[int] | None = None
        self.paused = False
        self.failure = ""
        self.watcher = Watcher(engine)
        self.watcher.start()

    def free(self) -> None:
        """Stops everything; Blender calls nothing afterwards. The native scene rests, with all that methods remember of
        it, until a viewport of the same layer opens."""
        self.watcher.stop()
        session, self.session = self.session, None
        native, self.native = self.native, None
        if session is not None:
            session.cancel()
            if native is not None:
                store.leave_resting(self.key, native)
        self.picture = None

    # Edits ----------------------------------------------------------------------------------------------------------

    def update(
        self, engine: bpy.types.RenderEngine, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph
    ) -> None:
        """Reads what changed in the scene."""
        if backend.afterglow is None:
            self.fail(engine, backend.problem)
            return
        try:
            self._update(engine, context, depsgraph)
            self.failure = ""
        except Exception as error:
            traceback.print_exc()
            self.fail(engine, str(error))

    def _update(self, engine: Any, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        if self.native is None:
            self.key = store.view_key(depsgraph)
            self.native = store.take_resting(self.key) or NativeScene()
        self.shown = None
        if self.session is None:
            self._sync(context, depsgraph)
            self._start(context, depsgraph)
        else:
            self._expect()
            with self.session.edit():
                self._sync(context, depsgraph)
                self._set_view(context, depsgraph)
                self.native.scene.commit("still")
            self.watcher.wake()
        self._tell_warnings()

    def _tell_warnings(self) -> None:
        for text in self.native.take_warnings():
            print("Afterglow:", text)

    def _expect(self) -> None:
        """From now on a newer picture is awaited."""
        self.watcher.release()
        self.awaited, self.waited = self.session.progress()["generation"], False

    def _sync(self, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        self.native.sync_with(depsgraph, context.space_data)
        self.shading = viewport_shading(context.space_data)

    def _start(self, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        self.view, self.settings = self._wanted(context, depsgraph)
        self.native.scene.set_camera(**self.view.camera)
        self.native.scene.commit("still")
        self.session = backend.afterglow.Session(self.native.scene, self.settings)
        self.session.start()
        self.watcher.watch(self.session)
        store.add_live(self)

    def _wanted(self, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> tuple[CameraView, dict[str, Any]]:
        """The view and the session's settings, as they are now in Blender."""
        scene, region, space = depsgraph.scene, context.region, context.space_data
        view = sync_camera_view(depsgraph, region, context.region_data, space, 1.0 / pixel_size(scene))
        for text in view.warnings:
            self.native.sync.warn(text)
        settings = session_settings(scene, viewport=True)
        settings.update(
            width=view.width,
            height=view.height,
            region=view.region,
            passes=["combined"],
            mist=mist_settings(scene),
            local_view=self._local_view(space, depsgraph),
        )
        return view, settings

    def _set_view(self, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        """Gives the session the view and settings where these differ from the last ones, by one restart."""
        view, settings = self._wanted(context, depsgraph)
        moved = not same_camera(view.camera, self.view.camera)
        relit = viewport_shading(context.space_data) != self.shading
        changed = {name: value for name, value in settings.items() if value != self.settings.get(name, _NOTHING)}
        self.view, self.settings = view, settings
        if moved or relit or changed:
            self._expect()
            with self.session.edit():
                if relit:
                    self._sync(context, depsgraph)
                if moved:
                    self.native.scene.set_camera(**view.camera)
                if changed:
                    self.session.update(changed)
                self.native.scene.commit("still")
            self.watcher.wake()
            self._tell_warnings()
        self._pause(depsgraph.scene.afterglow.preview_pause)

    def _local_view(self, space: bpy.types.SpaceView3D, depsgraph: bpy.types.Depsgraph) -> list[int] | None:
        """Handles of what this view shows; asked anew only after an edit or where the view's own choice changed."""
        shown = (space.local_view is not None, space.use_local_collections)
        if shown != self.shown:
            self.shown = shown
            self.local_view = self.native.sync.local_view(space, depsgraph) if any(shown) else None
        return self.local_view

    def _pause(self, wanted: bool) -> None:
        if wanted != self.paused:
            self.paused = wanted
            self.watcher.release()
            if wanted:
                self.session.pause()
            else:
                self.session.resume()
                self.watcher.wake()

    # What the method remembers ----------------------------------------------------------------------------------------

    def save_cache(self, path: str) -> None:
        self._at_rest(lambda: self.session.save_cache(path))

    def load_cache(self, path: str) -> None:
        self._at_rest(lambda: self.session.load_cache(path))

    def forget_cache(self) -> None:
        self._at_rest(self.session.forget_cache)

    def _at_rest(self, action: Callable[[], None]) -> None:
        """Does something while nothing renders, then starts anew."""
        self._expect()
        self.session.cancel()
        try:
            action()
        finally:
            self.session.start()
            self.watcher.wake()

    # Drawing --------------------------------------------------------------------------------------------------------

    def draw(self, engine: bpy.types.RenderEngine, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        """Draws the newest picture; starts anew first where the view changed."""
        if self.session is None:
            return
        try:
            self._set_view(context, depsgraph)
            self._draw(engine, context)
        except Exception as error:
            traceback.print_exc()
            self.fail(engine, str(error))

    def _await(self) -> dict[str, Any]:
        """The session's progress, after an edit as soon as its first picture is there, or without it a moment later:
        what is drawn then mostly is new, and no time goes into drawing an old picture once more."""
        end = time.perf_counter() + (0.0 if self.waited else AWAIT_SECONDS)
        progress = self.session.progress()
        while progress["generation"] == self.awaited and progress["state"] == "running" and time.perf_counter() < end:
            time.sleep(0.001)
            progress = self.session.progress()
        self.waited = True
        return progress

    def _draw(self, engine: Any, context: bpy.types.Context) -> None:
        progress = self._await()
        x0, y0, x1, y1 = self.view.region
        width, height = x1 - x0, y1 - y0
        if width <= 0 or height <= 0:
            return
        if progress["generation"] != self.generation and progress["generation"] > 0:
            if self.picture is None or (self.picture.width, self.picture.height) != (width, height):
                self.picture = display.Picture(width, height)
            self.session.read("combined", self.picture.pixels)
            self.picture.upload()
            self.generation = progress["generation"]
            if self.awaited >= 0 and progress["state"] == "running":
                self.watcher.hold()
            self.awaited = -1
        scale_x = context.region.width / self.view.width
        scale_y = context.region.height / self.view.height
        if self.picture is not None:
            self.picture.draw(x0 * scale_x, y0 * scale_y, width * scale_x, height * scale_y)
        engine.update_stats("Afterglow", view_status(self.session.statistics(), progress))

    def fail(self, engine: Any, text: str) -> None:
        """Tells what is wrong in the viewport's status; the last picture stays."""
        if text != self.failure:
            self.failure = text
            engine.update_stats("Afterglow", text)


def pixel_size(scene: bpy.types.Scene) -> int:
    """Pixels of the region for one rendered pixel, by Blender's own setting of the viewport's resolution."""
    setting = scene.render.preview_pixel_size
    if setting == "AUTO":
        return 2 if bpy.context.preferences.system.pixel_size > 1.5 else 1
    return int(setting)


def same_camera(one: dict[str, Any], other: dict[str, Any]) -> bool:
    """Whether two cameras are equal; their transforms are arrays."""
    if one.keys() != other.keys():
        return False
    return all(np.array_equal(one[name], other[name]) for name in one)


def view_status(statistics: dict[str, Any], progress: dict[str, Any]) -> str:
    """The viewport's status line: method, samples, believed error, what the cache holds and did, time."""
    parts = [str(statistics["method"]).replace("_", " ").title(), f"{progress['samples']} samples"]
    if progress.get("error") is not None:
        parts.append(f"error {progress['error']:.1%}")
    elif progress.get("noise") is not None:
        parts.append(f"noise {progress['noise']:.1%}")
    parts += cache_status(statistics)
    parts.append(f"{progress['elapsed']:.1f} s")
    if progress["state"] == "paused":
        parts.append("paused")
    return " | ".join(parts)


def cache_status(statistics: dict[str, Any]) -> list[str]:
    """What a method that remembers holds, and did at the last edit, in words."""
    values = statistics["values"]
    if "cells" in values:
        counts = [f"{int(values['cells']):,} cells", f"{values['cache_bytes'] / 2**20:.0f} MiB"]
        if values.get("cells_refused"):
            counts.append("memory full")
        return [", ".join(counts)]
    if "records" not in values:
        return []
    counts = [f"{int(values['records']):,} records"]
    for name, word in (("records_new", "new"), ("records_updated", "updated"), ("records_dropped", "dropped")):
        if values.get(name):
            counts.append(f"{int(values[name]):,} {word}")
    if values.get("records_refused"):
        counts.append("memory full")
    rays = values.get("visibility_rays_now")
    return [", ".join(counts)] + ([f"{int(rays):,} visibility rays"] if rays else [])
