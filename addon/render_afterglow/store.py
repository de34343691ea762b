# SPDX-License-Identifier: GPL-3.0-or-later
"""What outlives a RenderEngine object, keyed by scene: Blender makes a new engine object for every frame and mode
switch.

Native scenes, and with them what the methods remember of them, stay here: those of final renders between the frames of an
animation when "Persistent Data" is on or the method is one that remembers; those of viewports while no viewport uses them.
Statistics and the last good image of each layer stay until another file is opened.
"""

from __future__ import annotations

import weakref
from typing import Any

import bpy
import numpy as np
from bpy.app.handlers import persistent

from . import backend

# (scene's name, layer's name) → the native scene with what was read into it
_kept: dict[tuple[str, str], Any] = {}
# (scene's name, layer's name) → native scenes of viewports that were closed, for the next one that opens
_resting: dict[tuple[str, str], list[Any]] = {}
# viewports that render now
_live: weakref.WeakSet[Any] = weakref.WeakSet()
# scene's name → layer's name → statistics of the last render
_statistics: dict[str, dict[str, dict[str, Any]]] = {}
# (scene's name, layer's name) → pass name → pixels of the last image that was rendered without an error
_last_good: dict[tuple[str, str], dict[str, np.ndarray]] = {}


def scene_key(scene: bpy.types.Scene) -> str:
    """A scene's name with its library's: stable over undo and frames, unlike its address."""
    return scene.name_full


def kept(scene: bpy.types.Scene, layer: str) -> Any | None:
    return _kept.get((scene_key(scene), layer))


def keep(scene: bpy.types.Scene, layer: str, native: Any) -> None:
    _kept[(scene_key(scene), layer)] = native


def forget(scene: bpy.types.Scene) -> None:
    """Frees the native scenes of one scene."""
    key = scene_key(scene)
    for name in [name for name in _kept if name[0] == key]:
        del _kept[name]


def take_resting(key: tuple[str, str]) -> Any | None:
    """The native scene that the viewport closed last left, for a viewport alone; None: there is none."""
    resting = _resting.get(key)
    return resting.pop() if resting else None


def leave_resting(key: tuple[str, str], native: Any) -> None:
    """Keeps a closed viewport's native scene. One a layer: they are as large as the scene."""
    native.rest()
    _resting[key] = [native]


def add_live(view: Any) -> None:
    """A viewport renders from now on, until its object is gone or has no session."""
    _live.add(view)


def live_views(scene: bpy.types.Scene) -> list[Any]:
    """The scene's viewports that render now."""
    return [view for view in _live if view.session is not None and view.key[0] == scene_key(scene)]


def view_key(depsgraph: bpy.types.Depsgraph) -> tuple[str, str]:
    return scene_key(depsgraph.scene), depsgraph.view_layer.name


def record_statistics(scene: bpy.types.Scene, layer: str, statistics: dict[str, Any]) -> None:
    """Keeps what a render did, for the panel and for `afterglow.statistics(scene)`."""
    key = scene_key(scene)
    _statistics.setdefault(key, {})[layer] = statistics
    record = getattr(backend.afterglow, "record_statistics", None)
    if record is not None:
        record(key, statistics, layer)


def statistics(scene: bpy.types.Scene, layer: str | None = None) -> dict[str, Any] | None:
    """Statistics of the scene's last render, of the layer rendered last unless one is named."""
    layers = _statistics.get(scene_key(scene))
    if not layers:
        return None
    return layers.get(layer) if layer is not None else next(reversed(layers.values()))


def remember_image(scene: bpy.types.Scene, layer: str, images: dict[str, np.ndarray]) -> None:
    _last_good[(scene_key(scene), layer)] = images


def last_image(scene: bpy.types.Scene, layer: str) -> dict[str, np.ndarray] | None:
    return _last_good.get((scene_key(scene), layer))


def clear() -> None:
    _kept.clear()
    _resting.clear()
    _statistics.clear()
    forget_records = getattr(backend.afterglow, "forget_statistics", None)
    if forget_records is not None:
        forget_records()
    _last_good.clear()


@persistent
def clear_for_file(_path: object = None, *_rest: object) -> None:
    clear()


@persistent
def clear_resting(_path: object = None, *_rest: object) -> None:
    """Viewports of the file before are closed only while the next one is read."""
    _resting.clear()


@persistent
def forget_unused(scene: bpy.types.Scene, *_rest: object) -> None:
    """After an edit: nothing rests for a scene that another engine renders now, or that is gone."""
    if not _resting:
        return
    wanted = {scene_key(it) for it in bpy.data.scenes if it.render.engine == "AFTERGLOW"}
    for key in [key for key in _resting if key[0] not in wanted]:
        del _resting[key]


@persistent
def end_of_render(scene: bpy.types.Scene, *_rest: object) -> None:
    """After the last frame: what was kept between the frames for the method's sake alone goes."""
    if not scene.render.use_persistent_data:
        forget(scene)


def _handlers() -> tuple[tuple[list[Any], Any], ...]:
    handlers = bpy.app.handlers
    return (
        (handlers.load_pre, clear_for_file),
        (handlers.load_post, clear_resting),
        (handlers.depsgraph_update_post, forget_unused),
        (handlers.render_complete, end_of_render),
        (handlers.render_cancel, end_of_render),
    )


def register() -> None:
    for handlers, handler in _handlers():
        if handler not in handlers:
            handlers.append(handler)


def unregister() -> None:
    for handlers, handler in _handlers():
        if handler in handlers:
            handlers.remove(handler)
    clear()
