# SPDX-License-Identifier: GPL-3.0-or-later
"""Final renders and previews: one call renders one view layer of one frame, from reading Blender's data to the passes.

The native session renders in the background; this thread only looks at it, asks Blender every 20 ms whether the user
cancelled, and shows what is there. What goes wrong is reported in a sentence and the last good image comes back.
"""

from __future__ import annotations

import time
import traceback
from typing import Any

import bpy
import numpy as np

from . import backend, display, passes, store
from .native_scene import NativeScene
from .properties.scene import mist_settings, session_settings
from .sync import sync_camera_final

POLL_SECONDS = 0.02  # how often the user's wish to cancel is looked at
STATUS_SECONDS = 0.25  # how often progress is told
SHOW_SECONDS = 1.0  # how often the unfinished image is shown, at first; later more rarely

PREVIEW_SETTINGS = {
    "method": "PATH_TRACING",
    "samples": 96,
    "accuracy": 0.03,
    "time_limit": 0.0,
    "denoise": False,
    "seed": 0,
}


FORGETFUL = {"AUTO", "PATH_TRACING", "INSTANT_RADIOSITY"}  # methods that start anew in every frame


class RefusedError(Exception):
    """What Afterglow does not do; the text goes to the user as it is."""


def render(engine: bpy.types.RenderEngine, depsgraph: bpy.types.Depsgraph) -> None:
    """Renders the depsgraph's view layer. Never raises: errors go to Blender's report."""
    scene, layer = depsgraph.scene, depsgraph.view_layer.name
    try:
        refuse(engine, scene)
        render_layer(engine, depsgraph, scene, layer)
    except Exception as error:
        if not isinstance(error, RefusedError) and not isinstance(
            error, getattr(backend.afterglow, "Error", RefusedError)
        ):
            traceback.print_exc()
        print(f"Afterglow: error: {error}")
        engine.error_set(f"Afterglow: {error}")
        store.forget(scene)
        try:
            restore_last_image(engine, scene, layer)
        except Exception:
            traceback.print_exc()


def refuse(engine: bpy.types.RenderEngine, scene: bpy.types.Scene) -> None:
    """Raises RefusedError for what cannot be rendered at all."""
    if backend.afterglow is None:
        raise RefusedError(backend.problem)
    if scene.render.use_multiview and not engine.is_preview:
        raise RefusedError("stereoscopic images are not supported; switch off Stereoscopy in the output properties")


def render_layer(
    engine: bpy.types.RenderEngine, depsgraph: bpy.types.Depsgraph, scene: bpy.types.Scene, layer: str
) -> None:
    started = time.perf_counter()
    prefix = f"Layer '{layer}' | " if len(scene.view_layers) > 1 and not engine.is_preview else ""
    engine.update_stats("", prefix + "Reading the scene")
    remembers = engine.is_animation and scene.afterglow.method not in FORGETFUL
    persistent = (scene.render.use_persistent_data or remembers) and not engine.is_preview
    native = store.kept(scene, layer) if persistent else None
    goes_on = native is not None
    if native is None:
        native = NativeScene()
    if persistent:
        store.keep(scene, layer, native)

    native.sync_with(depsgraph)
    view = sync_camera_final(engine, depsgraph)
    if view is None:
        raise RefusedError(f"the scene '{scene.name}' has no camera: add one, or make one the scene's camera")
    native.scene.set_camera(**view.camera)
    seconds = {"sync": time.perf_counter() - started}
    if engine.test_break():
        return
    wanted = list(passes.wanted(depsgraph.view_layer)) if not engine.is_preview else [passes.COMBINED]
    if bpy.app.background and not scene.render.use_persistent_data and not engine.is_preview:
        # All is read. Blender's evaluated copies are as large as ours; in the interface they are still wanted.
        engine.free_blender_memory()
        del depsgraph
    engine.update_stats("", prefix + "Building the scene")
    # What moves in an animation leaves the common BVH, which else would be built anew for every frame.
    changes = native.scene.commit(flatten="still" if goes_on else True)
    seconds["commit"] = time.perf_counter() - started - seconds["sync"]
    warnings = native.take_warnings() + list(view.warnings) + list(changes["warnings"])

    settings = session_settings(scene, viewport=False)
    if engine.is_preview:
        settings.update(PREVIEW_SETTINGS)
    settings.update(
        width=view.width,
        height=view.height,
        region=view.region,
        passes=[item.native for item in wanted],
        mist=mist_settings(scene),
    )
    settings["carry_over"] = bool(settings["carry_over"] and persistent)
    session = backend.afterglow.Session(native.scene, settings)
    cancelled = False
    try:
        cancelled, images = run(engine, session, wanted, view.region, layer, prefix)
        statistics = session.statistics()
    finally:
        session.cancel()
    statistics = dict(statistics)
    statistics["seconds"] = {**seconds, **statistics.get("seconds", {})}
    statistics["bytes"] = {**native.scene.bytes, **statistics.get("bytes", {})}
    statistics["wall_time"] = time.perf_counter() - started
    statistics["cancelled"] = cancelled
    statistics["frame"] = scene.frame_current
    warnings += [text for text in statistics.get("warnings", ()) if text not in warnings]
    statistics["warnings"] = warnings
    if not engine.is_preview:
        store.record_statistics(scene, layer, statistics)
        if not cancelled and not bpy.app.background:
            store.remember_image(scene, layer, images)
        for text in warnings:
            engine.report({"WARNING"}, f"Afterglow: {text}")
    engine.update_stats("", prefix + "Finished")


def run(
    engine: bpy.types.RenderEngine,
    session: Any,
    wanted: list[passes.Pass],
    region: tuple[int, int, int, int],
    layer: str,
    prefix: str,
) -> tuple[bool, dict[str, np.ndarray]]:
    """Runs the session to its end, showing what is there. Returns whether the user cancelled (what was rendered is
    kept) and the passes by Blender's names."""
    x0, y0, x1, y1 = region
    for item in wanted[1:]:
        engine.add_pass(item.name, len(item.channels), item.channels, layer=layer)
    result = engine.begin_result(0, 0, x1 - x0, y1 - y0, layer=layer)
    show = not bpy.app.background
    generation, next_status, show_every = -1, 0.0, SHOW_SECONDS
    next_show = time.perf_counter() + 0.3
    cancelled = False
    try:
        session.start()
        while not session.wait(POLL_SECONDS):
            if engine.test_break():
                session.cancel()
                cancelled = True
                break
            now = time.perf_counter()
            if now < next_status and not (show and now >= next_show):
                continue
            progress = session.progress()
            if now >= next_status:
                next_status = now + STATUS_SECONDS
                engine.update_progress(progress["fraction"])
                engine.update_stats("", prefix + status_text(progress))
            if show and now >= next_show and progress["generation"] != generation and progress["samples"] > 0:
                generation = progress["generation"]
                write(result, layer, session, wanted[:1])
                engine.update_result(result)
                show_every = min(show_every * 1.5, 10.0)
                next_show = time.perf_counter() + show_every
        images = write(result, layer, session, wanted)
    except BaseException:
        engine.end_result(result, cancel=True)
        raise
    engine.update_progress(1.0)
    engine.end_result(result)
    if not engine.is_preview:
        stamp(engine.get_result(), layer, session.statistics())
    return cancelled, images


def write(result: Any, layer: str, session: Any, wanted: list[passes.Pass]) -> dict[str, np.ndarray]:
    """Copies the wanted passes into Blender's result; gives them back by Blender's name."""
    images: dict[str, np.ndarray] = {}
    by_name = {item.name: item for item in result.layers[0].passes}
    for item in wanted:
        target = by_name.get(item.name)
        if target is None:
            continue
        images[item.name] = session.read(item.native)
        display.write_pass(target, images[item.name])
    return images


def status_text(progress: dict[str, Any]) -> str:
    """One line for Blender's status: stage, samples, believed error, time that remains."""
    parts = [str(progress.get("stage") or "Rendering")]
    if progress.get("samples"):
        parts.append(f"{progress['samples']} samples")
    if progress.get("error") is not None:
        parts.append(f"error {progress['error']:.2%}")
    elif progress.get("noise") is not None:
        parts.append(f"noise {progress['noise']:.2%}")
    if progress.get("remaining") is not None:
        parts.append(f"remaining {clock(progress['remaining'])}")
    return " | ".join(parts)


def clock(seconds: float) -> str:
    """Seconds as Blender shows them: 01:05.20, or 2:01:05 above an hour."""
    minutes, rest = divmod(max(0.0, seconds), 60)
    hours, minutes = divmod(int(minutes), 60)
    return f"{hours}:{minutes:02d}:{int(rest):02d}" if hours else f"{minutes:02d}:{rest:05.2f}"


def stamp(result: Any, layer: str, statistics: dict[str, Any]) -> None:
    """Writes what the render did into the image's metadata, as `afterglow.<layer>.<name>`; `result` is the whole
    frame's."""
    if not hasattr(result, "stamp_data_add_field"):
        return
    fields = {
        "method": statistics.get("method"),
        "samples": statistics.get("samples"),
        "threads": statistics.get("threads"),
        "dropped": statistics.get("dropped"),
        "denoiser": statistics.get("denoiser"),
    }
    error = statistics.get("believed_error")
    if error is not None:
        fields["believed_error"] = f"{error:.6f}"
    elif statistics.get("noise") is not None:
        fields["noise"] = f"{statistics['noise']:.6f}"
    for stage, seconds in (statistics.get("seconds") or {}).items():
        fields[f"seconds.{stage}"] = f"{seconds:.3f}"
    for kind, count in (statistics.get("rays") or {}).items():
        fields[f"rays.{kind}"] = count
    memory = statistics.get("bytes")
    if isinstance(memory, dict):
        memory = sum(value for value in memory.values() if isinstance(value, int))
    fields["bytes"] = memory
    for name, value in fields.items():
        if value is not None and value != "":
            result.stamp_data_add_field(f"afterglow.{layer}.{name}", str(value))


def restore_last_image(engine: bpy.types.RenderEngine, scene: bpy.types.Scene, layer: str) -> None:
    """After a failure: the last good image comes back into the result where it has the same size, else an empty one.
    There must be one: Blender 3.4 to 5.0 crash when they write an OpenEXR file of a result without a picture. Never
    another frame's picture in an animation, whose files must not lie."""
    width, height = result_size(engine, scene)
    images = store.last_image(scene, layer) or {}
    if (
        engine.is_preview
        or engine.is_animation
        or any(pixels.shape[:2] != (height, width) for pixels in images.values())
    ):
        images = {}
    known = {item.name: item for item in passes.PASSES}
    for name in images:
        if name in known:
            item = known[name]
            engine.add_pass(name, len(item.channels), item.channels, layer=layer)
    result = engine.begin_result(0, 0, width, height, layer=layer)
    by_name = {item.name: item for item in result.layers[0].passes}
    for name, pixels in images.items():
        if name in by_name:
            display.write_pass(by_name[name], pixels)
    engine.end_result(result)


def result_size(engine: bpy.types.RenderEngine, scene: bpy.types.Scene) -> tuple[int, int]:
    """Width and height of the rectangle that Blender wants, by the same arithmetic."""
    width, height, render = engine.resolution_x, engine.resolution_y, scene.render
    if render.use_border and not engine.is_preview:
        return (
            max(1, int(render.border_max_x * width) - int(render.border_min_x * width)),
            max(1, int(render.border_max_y * height) - int(render.border_min_y * height)),
        )
    return width, height
