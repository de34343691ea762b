# SPDX-License-Identifier: GPL-3.0-or-later
"""Keeps one native scene equal to one depsgraph: first everything, later only what was changed.

Blender's identities (original datablocks, instance parents) are mapped to native handles. What changed is decided by the
depsgraph's transform and geometry flags and by comparing with what was synced, because shading flags are over-reported and
deletions are not reported at all.
"""
from __future__ import annotations

import time
import weakref
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from . import visibility
from .lights import read_world
from .materials import MaterialTable, digest
from .objects import ObjectTable
from .studio import studio_world


@dataclass
class SyncReport:
    """What one sync did: counts of what was added or changed, seconds by stage, warnings that each name an object."""

    meshes: int = 0
    instances: int = 0
    moved: int = 0
    materials: int = 0
    images: int = 0
    lights: int = 0
    removed: int = 0
    world: bool = False
    everything: bool = False
    seconds: dict[str, float] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)

    @property
    def changed(self) -> bool:
        return bool(self.meshes or self.instances or self.moved or self.materials or self.images or self.lights
                    or self.removed or self.world)


@dataclass
class Updates:
    """What the depsgraph says: originals (by address) whose geometry may differ, others that may differ at all."""

    everything: bool
    geometry: set[int] = field(default_factory=set)
    others: set[int] = field(default_factory=set)
    materials: set[int] = field(default_factory=set)
    images: set[int] = field(default_factory=set)
    objects: bool = False      # the list of objects has to be walked
    only_moved: bool = True    # nothing but transforms changed: names, slots, flags need no look
    moved: list[Any] = field(default_factory=list)  # evaluated objects whose transforms changed
    trees: bool = False        # a node group changed: every graph is looked at
    world: bool = False


# kinds of datablocks whose changes no object has to be asked about
APART = ("MATERIAL", "WORLD", "NODETREE", "IMAGE", "TEXTURE", "CAMERA", "BRUSH", "WORKSPACE", "SCREEN", "WINDOWMANAGER", "ACTION",
         "PALETTE", "TEXT", "SOUND")


def kind_of(datablock: Any) -> str:
    return getattr(datablock, "id_type", None) or _KINDS.get(type(datablock).__name__, type(datablock).__name__.upper())


_KINDS = {"ShaderNodeTree": "NODETREE", "CompositorNodeTree": "NODETREE", "GeometryNodeTree": "GEOMETRY",
          "TextureNodeTree": "NODETREE"}


def read_updates(depsgraph: Any, everything: bool) -> Updates:
    updates = Updates(everything)
    count = 0
    for update in depsgraph.updates:
        count += 1
        datablock = update.id
        kind, address = kind_of(datablock), datablock.original.as_pointer()
        if kind == "MATERIAL":
            updates.materials.add(address)
        elif kind == "IMAGE":
            updates.images.add(address)
        elif kind == "NODETREE":  # a tree that belongs to a datablock comes with its owner
            updates.trees = updates.trees or not getattr(datablock, "is_embedded_data", False)
        elif kind == "WORLD":
            updates.world = True
        if kind in APART:
            continue
        updates.objects = True
        if update.is_updated_geometry:
            updates.geometry.add(address)
        if kind != "OBJECT" or update.is_updated_geometry or update.is_updated_shading or not update.is_updated_transform:
            updates.only_moved = False
        else:
            updates.moved.append(datablock)
        updates.others.add(address)
    if not count:
        updates.everything = True
    return updates


def weakly(method: Callable[..., None]) -> Callable[..., None]:
    """The method without its object's life: a scene whose parts point back to it would stay in memory, meshes and all,
    until Python looks for cycles."""
    reference = weakref.WeakMethod(method)

    def call(*arguments: Any) -> None:
        found = reference()
        if found is not None:
            found(*arguments)

    return call


class SceneSync:
    """Fills one native `Scene`. `log(level, text)` takes each new warning once, level "warning" or "info".

    One SceneSync belongs to one depsgraph at a time; pass full=True where another one takes over."""

    def __init__(self, scene: Any, log: Callable[[str, str], None] | None = None) -> None:
        self.scene, self.log = scene, log
        self.said: set[str] = set()
        self.report = SyncReport()
        self.materials = MaterialTable(scene, weakly(self.warn))
        self.objects = ObjectTable(scene, self.materials, weakly(self.warn))
        self.world: bytes | None = None
        self.world_images: set[int] = set()
        self.shading: Any = None
        self.first = True

    def warn(self, text: str) -> None:
        """A warning is told once in the life of this scene."""
        if text in self.said:
            return
        self.said.add(text)
        self.report.warnings.append(text)
        if self.log is not None:
            self.log("warning", text)

    def sync(self, depsgraph: Any, *, view_layer: Any = None, view: Any = None, full: bool = False) -> SyncReport:
        """Edits the native scene until it equals the depsgraph; does not commit. view: the SpaceView3D whose shading
        (scene lights, scene world) counts, None for a final render. full: read everything again."""
        self.report = report = SyncReport()
        start = time.perf_counter()
        updates = read_updates(depsgraph, full or self.first)
        report.everything = updates.everything
        layer = view_layer or depsgraph.view_layer_eval
        shading = viewport_shading(view)
        if shading != self.shading:
            self.shading, updates.objects, updates.only_moved, updates.world = shading, True, False, True
        report.seconds["updates"] = self._lap(start)

        if view is None and depsgraph.scene.render.use_motion_blur:
            self.warn(f"Scene '{depsgraph.scene.name}': motion blur is not supported yet: rendered sharp")
        if view is None and any(getattr(layer, f"use_pass_cryptomatte_{kind}", False)
                                for kind in ("object", "material", "asset")):
            self.warn(f"View layer '{layer.name}': Cryptomatte is not supported yet: its passes are left out")
        self.materials.begin(depsgraph, updates, report)
        report.seconds["materials"] = self._lap(start, report)
        shows_uvs = view is None and bool(getattr(layer, "use_pass_uv", False))
        if updates.everything or updates.objects or self.materials.attributes_changed or shows_uvs != self.objects.shows_uvs:
            self.objects.shows_uvs = shows_uvs
            self.objects.update(depsgraph, layer, updates, report, lights=shading is None or shading[0])
        report.seconds["objects"] = self._lap(start, report)
        self._update_world(depsgraph, layer, report)
        self.materials.end(self.objects.used_materials(), self.objects.used_images() | self.world_images, report)
        report.seconds["world"] = self._lap(start, report)
        report.seconds["total"] = time.perf_counter() - start
        self.first = False
        return report

    @staticmethod
    def _lap(start: float, report: SyncReport | None = None) -> float:
        return time.perf_counter() - start - (sum(report.seconds.values()) if report else 0.0)

    def _update_world(self, depsgraph: Any, layer: Any, report: SyncReport) -> None:
        if self.shading is not None and not self.shading[1]:
            arguments = studio_world(self.shading, self.materials)
            world = None
        else:
            world = getattr(layer, "world_override", None) or depsgraph.scene.world
            arguments = read_world(world, lambda owner: self.materials.context(f"World '{owner.name}'"))
        self.world_images = self.materials.images_of(arguments["graph"])
        key = digest(arguments)
        if key != self.world:
            self.scene.set_world(**arguments)
            self.world, report.world = key, True

    def local_view(self, view: Any, depsgraph: Any) -> list[int] | None:
        """Handles of the instances that a SpaceView3D shows (local view, hidden collections); None: all of them."""
        hidden = {ob.original.as_pointer() for ob in depsgraph.objects if not ob.visible_in_viewport_get(view)}
        if not hidden:
            return None
        return np.concatenate([np.empty(0, np.uint32), *(
            group.handles for group in self.objects.groups.values()
            if group.owner not in hidden and len(group.handles))]).tolist()


def viewport_shading(view: Any) -> tuple[Any, ...] | None:
    """(scene lights, scene world, studio light file, its rotation, its strength) of a viewport; None: as in a render."""
    if view is None or view.shading.type not in {"RENDERED", "MATERIAL"}:
        return None
    shading, rendered = view.shading, view.shading.type == "RENDERED"
    lights = shading.use_scene_lights_render if rendered else shading.use_scene_lights
    world = shading.use_scene_world_render if rendered else shading.use_scene_world
    if lights and world:
        return None
    light = getattr(shading, "selected_studio_light", None)
    return (lights, world, light.path if light else "", shading.studiolight_rotate_z, shading.studiolight_intensity)


__all__ = ["SceneSync", "SyncReport", "Updates", "visibility"]
