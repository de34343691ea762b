# SPDX-License-Identifier: GPL-3.0-or-later
"""What outlives a RenderEngine object, keyed by scene: Blender makes a new engine object for every frame and mode
switch.

Native scenes of final renders stay here between the frames of an animation when "Persistent Data" is on; statistics and
the last good image of each layer stay until another file is opened.
"""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
from bpy.app.handlers import persistent

from . import backend

# (scene's name, layer's name) → the native scene with what was read into it
_kept: dict[tuple[str, str], Any] = {}
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
    _statistics.clear()
    forget_records = getattr(backend.afterglow, "forget_statistics", None)
    if forget_records is not None:
        forget_records()
    _last_good.clear()


@persistent
def clear_for_file(_path: object = None, *_rest: object) -> None:
    clear()


def register() -> None:
    if clear_for_file not in bpy.app.handlers.load_pre:
        bpy.app.handlers.load_pre.append(clear_for_file)


def unregister() -> None:
    if clear_for_file in bpy.app.handlers.load_pre:
        bpy.app.handlers.load_pre.remove(clear_for_file)
    clear()
