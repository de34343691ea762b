# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes, instances and lights of one native scene, from one walk over the depsgraph's object instances.

Instances that share parent, object and mesh are one group: per instance only its matrix and its random number are read. A
mesh that several objects share (none of them modifies it) is at one address in evaluated data and is read once.
"""
from __future__ import annotations

import zlib
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .attributes import Owner, random_of_name
from .lights import is_portal, read_light
from .materials import MaterialTable, digest
from .meshes import fingerprint, read_mesh
from .nodes import GENERATED, TANGENTS, UVS
from .points import point_transforms, unit_sphere
from .visibility import object_visibility

# what else is no mesh is shown by nothing (cameras, empties) or comes a second time as a mesh (curves, text, surfaces)
LEFT_OUT = {"VOLUME": "volumes", "CURVES": "hair curves"}
GroupKey = tuple[int, int, int]  # addresses of the original object and of the original parent (0: none), number among those


@dataclass
class MeshUse:
    """A mesh as one walk meets it; read after the walk, when it is known what all of its users' materials ask for."""
    data: Any
    key: GroupKey               # of the first group that shows it
    name: str                   # of that group's object
    original_data: int          # address
    maker: Any = None           # the object to ask by `to_mesh`, where the data are not a mesh to be read as it is
    wanted: set[str] = field(default_factory=set)
    is_points: bool = False     # a point cloud: a small sphere stands for each point


@dataclass
class MeshEntry:
    handle: int | None          # None: nothing to see
    key: GroupKey               # of the first group that showed it
    address: int
    original_data: int          # as in MeshUse
    fingerprint: tuple[int, ...]
    names: frozenset[str]       # attributes that it has and that were asked for
    topology: int | None = None     # checksums, made when it is read a second time
    shape: int | None = None


@dataclass
class Group:
    owner: int                  # address of the original object that Blender shows or hides
    address: int                # of the evaluated mesh
    properties: dict[str, Any]
    materials: tuple[int, ...]  # keys of the material table
    handles: NDArray[np.uint32] = field(default_factory=lambda: np.empty(0, np.uint32))
    transforms: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 4, 4)))
    randoms: NDArray[np.uint32] = field(default_factory=lambda: np.empty(0, np.uint32))
    mesh_handle: int | None = None
    shown: dict[str, Any] | None = None    # properties that the native scene has
    points: NDArray[np.float64] | None = None  # (N, 4, 4): where in the object's space the mesh stands, if not once


@dataclass
class LightEntry:
    handle: int
    kind: str
    key: bytes
    images: set[int]


class Walk:
    """What one walk has gathered for a group."""

    def __init__(self, key: GroupKey, group: Group | None) -> None:
        self.key, self.group = key, group
        self.matrices: list[Any] = []
        self.randoms: list[int] = []


def stack_matrices(matrices: list[Any]) -> NDArray[np.float64]:
    """(N, 4, 4) of mathutils matrices: by the buffer protocol where they have it, else row by row."""
    if not matrices:
        return np.empty((0, 4, 4))
    try:
        joined = np.frombuffer(b"".join(matrices), np.float32).reshape(-1, 4, 4)
        return joined.transpose(0, 2, 1).astype(np.float64) if COLUMNS_FIRST else joined.astype(np.float64)
    except TypeError:
        flat = chain.from_iterable(chain.from_iterable(matrices))
        return np.fromiter(flat, np.float64, len(matrices) * 16).reshape(-1, 4, 4)


def _columns_first() -> bool:
    from mathutils import Matrix
    try:
        return np.frombuffer(b"".join([Matrix.Translation((1, 2, 3))]), np.float32)[3] == 0.0
    except TypeError:
        return False


COLUMNS_FIRST = _columns_first()


class ObjectTable:
    def __init__(self, scene: Any, materials: MaterialTable, warn: Callable[[str], None]) -> None:
        self.scene, self.materials, self.warn = scene, materials, warn
        self.meshes: dict[GroupKey, MeshEntry] = {}
        self.groups: dict[GroupKey, Group] = {}
        self.lights: dict[GroupKey, LightEntry] = {}
        self.shows_uvs = False  # the view layer has a pass of them: every mesh is read with its UV maps

    def used_materials(self) -> set[int]:
        return set(chain.from_iterable(group.materials for group in self.groups.values()))

    def used_images(self) -> set[int]:
        return set(chain.from_iterable(light.images for light in self.lights.values()))

    # -- the walk

    def update(self, depsgraph: Any, layer: Any, updates: Any, report: Any, lights: bool) -> None:
        self.layer, self.updates, self.report = layer, updates, report
        self.counts: dict[tuple[int, int], int] = {}
        self.uses: dict[int, MeshUse] = {}
        self.next_lights: set[GroupKey] = set()
        self.override = getattr(layer, "material_override", None)
        if self.materials.personal:  # what moved may drive a property that a material asks for, and nobody tells of that
            updates.only_moved = False
        only_moved = updates.only_moved and not (updates.everything or self.materials.attributes_changed)
        if only_moved and self._move(updates.moved):
            return
        walks: dict[tuple[int, int, int], Walk] = {}
        for instance in depsgraph.object_instances:
            if not instance.show_self:
                continue
            ob = instance.object
            data = ob.data
            if data is None:
                continue
            parent = instance.parent.original.as_pointer() if instance.is_instance else 0
            key = (ob.original.as_pointer(), parent, data.as_pointer())
            walk = walks.get(key)
            if walk is None:
                walk = self._begin(instance, ob, data, key, lights)
                if walk is not LIGHT:
                    walks[key] = walk
            if walk.group is not None:
                walk.matrices.append(instance.matrix_world.copy())
                walk.randoms.append(instance.random_id if instance.is_instance else random_of_name(ob.name))
        self._finish([walk for walk in walks.values() if walk.group is not None])

    def _move(self, moved: list[Any]) -> bool:
        """Moves objects without a walk, where nothing but objects that stand once and make no others moved."""
        addresses = {ob.original.as_pointer(): ob for ob in moved}
        found: dict[int, list[Group]] = {}
        for (owner, parent, _), group in self.groups.items():
            if parent in addresses or (owner in addresses and (parent or group.points is not None)):
                return False
            if owner in addresses:
                found.setdefault(owner, []).append(group)
        for address, ob in addresses.items():
            groups = found.get(address, [])
            if (ob.type == "LIGHT" or ob.instance_type != "NONE" or ob.particle_systems or len(groups) > 1
                    or any(len(group.transforms) != 1 for group in groups)):
                return False
        for address, groups in found.items():
            for group in groups:
                transforms = stack_matrices([addresses[address].matrix_world.copy()])
                if len(group.handles) and not np.array_equal(transforms, group.transforms):
                    self.scene.set_transforms(group.handles, transforms)
                    self.report.moved += 1
                group.transforms = transforms
        return True

    def _begin(self, instance: Any, ob: Any, data: Any, addresses: tuple[int, int, int], lights: bool) -> Walk:
        """First sight of a group: its mesh and what all of its instances share."""
        kind = ob.type
        if kind == "LIGHT":
            if lights:
                self._light(instance, ob, data, self._number(addresses))
            return LIGHT
        if kind in {"MESH", "META", "POINTCLOUD"}:
            key = self._number(addresses)
            use = self.uses.get(addresses[2])
            if use is None:
                temporary = kind == "META" or getattr(data, "is_editmode", False)
                maker = (instance.instance_object if instance.is_instance else ob) if temporary else None
                # an instance's object is gone after this step of the walk: nothing but its data may be kept
                original = ob.original.data
                use = self.uses[addresses[2]] = MeshUse(data, key, ob.name, original.as_pointer() if original else 0, maker,
                                                        is_points=kind == "POINTCLOUD")
            walk = Walk(key, self._group(instance, ob, data, key, use))
            walk.group.points = point_transforms(data) if use.is_points else None
            return walk
        if kind in LEFT_OUT:
            self.warn(f"Object '{ob.name}': {LEFT_OUT[kind]} are not supported yet: left out")
        return NOTHING

    def _number(self, addresses: tuple[int, int, int]) -> GroupKey:
        """Stable where addresses are not: objects and parents, and which of their meshes or lights it is."""
        pair = addresses[:2]
        number = self.counts.get(pair, 0)
        self.counts[pair] = number + 1
        return (*pair, number)

    def _slots(self, ob: Any, data: Any) -> list[Any]:
        """A material or None for each slot, linked to the object or to the data."""
        if self.override is not None:
            return [self.override]
        slots = list(getattr(data, "materials", ()))
        if ob.data == data:
            for i, slot in enumerate(ob.material_slots):
                if slot.link == "OBJECT":
                    slots[i:i + 1] = [slot.material]
        return slots or [None]

    def _group(self, instance: Any, ob: Any, data: Any, key: GroupKey, use: MeshUse) -> Group:
        old = self.groups.get(key)
        if old is not None and self.updates.only_moved and not self.updates.everything:
            group = old
            group.address = data.as_pointer()
        else:
            self._warn_of(ob)
            parent = instance.parent if instance.is_instance else None
            pairs = [self.materials.handle(material, ob.name, use.is_points, Owner(ob, parent))
                     for material in self._slots(ob, data)]
            bits, holdout, catcher = object_visibility(ob, parent, self.layer)
            if catcher:
                self.warn(f"Object '{ob.name}': shadow catchers are not supported yet: shown as an ordinary object")
            properties = {"name": ob.name, "materials": tuple(handle for _, handle in pairs), "object_index": ob.pass_index,
                          "visibility": bits, "holdout": holdout, "shadow_catcher": catcher, "color": tuple((parent or ob).color)}
            group = Group(key[1] or key[0], data.as_pointer(), properties, tuple(address for address, _ in pairs))
            if old is not None:
                group.handles, group.transforms, group.randoms = old.handles, old.transforms, old.randoms
                group.mesh_handle, group.shown = old.mesh_handle, old.shown
        for address in group.materials:
            use.wanted |= self.materials.table[address].attributes
        return group

    def _warn_of(self, ob: Any) -> None:
        """What an object asks for and does not get."""
        if any(system.settings.type == "HAIR" and system.settings.render_type == "PATH" for system in ob.particle_systems):
            self.warn(f"Object '{ob.name}': hair is not supported yet: left out")
        linking = getattr(ob, "light_linking", None)
        if linking is not None and (linking.receiver_collection or linking.blocker_collection):
            self.warn(f"Object '{ob.name}': light linking is not supported yet: every light reaches every object")

    def _finish(self, walks: list[Walk]) -> None:
        groups = {walk.key: walk.group for walk in walks}
        for key, group in self.groups.items():
            if key not in groups:
                self._remove_group(group)
        meshes = self._update_meshes()
        for walk in walks:
            try:
                self._store_group(walk, meshes[walk.group.address].handle)
            except Exception as error:  # the render goes on without the object
                self.warn(f"Object '{walk.group.properties['name']}': cannot be shown ({error}): left out")
        self.groups = groups
        kept = {entry.handle for entry in meshes.values()}
        for entry in self.meshes.values():
            if entry.handle is not None and entry.handle not in kept:
                self.scene.remove_mesh(entry.handle)
                self.report.removed += 1
        self.meshes = {entry.key: entry for entry in meshes.values()}
        for key in [key for key in self.lights if key not in self.next_lights]:
            self.scene.remove_light(self.lights.pop(key).handle)
            self.report.removed += 1

    # -- meshes

    def _update_meshes(self) -> dict[int, MeshEntry]:
        """The mesh at each address that the walk has met: as it was, read anew, or new."""
        # Another depsgraph may have another mesh at the same address: what everything is read for goes by its users.
        entries = () if self.updates.everything else self.meshes.values()
        by_address = {(entry.address, entry.original_data): entry for entry in entries}
        at_place = {address: by_address.get((address, use.original_data)) for address, use in self.uses.items()}
        result: dict[int, MeshEntry] = {}
        claimed = {id(entry) for entry in at_place.values() if entry is not None}
        for address, use in self.uses.items():
            known = at_place[address]
            names = self._names(use)
            if known is not None and self._is_clean(known, use, names):
                known.key = use.key
                result[address] = known
                continue
            if known is None:
                known = self.meshes.get(use.key)
                if known is not None and id(known) in claimed:
                    known = None
            if known is not None:
                claimed.add(id(known))
                known = None if known.handle is None else known
            result[address] = self._read_mesh(use, address, names, known)
        return result

    def _is_clean(self, known: MeshEntry, use: MeshUse, names: frozenset[str]) -> bool:
        geometry = self.updates.geometry
        return (not self.updates.everything and known.fingerprint == fingerprint_of(use) and known.names == names
                and not geometry.intersection((*use.key[:2], use.original_data)))

    def _names(self, use: MeshUse) -> frozenset[str]:
        attributes = getattr(use.data, "attributes", ())
        wanted = use.wanted | {UVS} if self.shows_uvs else use.wanted
        return frozenset(name for name in wanted if name in ("", GENERATED, UVS) or name.startswith(TANGENTS)
                         or name in attributes)

    def _read_mesh(self, use: MeshUse, address: int, names: frozenset[str], known: MeshEntry | None) -> MeshEntry:
        entry = MeshEntry(known.handle if known else None, use.key, address, use.original_data, fingerprint_of(use), names)
        arguments = None
        try:
            mesh = use.data if use.maker is None else use.maker.to_mesh()
            if use.is_points:
                arguments = unit_sphere()
            elif mesh is not None:
                arguments = read_mesh(mesh, names)
            if arguments is not None:
                self._store_mesh(entry, known, arguments, use.name)
        except Exception as error:  # the render goes on without the object
            self.warn(f"Object '{use.name}': its mesh cannot be used ({error}): left out")
            entry.handle = None
        finally:
            if use.maker is not None:
                use.maker.to_mesh_clear()
        if arguments is None:
            entry.handle = None
        return entry

    def _store_mesh(self, entry: MeshEntry, known: MeshEntry | None, arguments: dict[str, Any], name: str) -> None:
        """Adds a mesh, deforms it where only points and normals differ, does nothing where nothing does."""
        if known is None:
            self.report.meshes += 1
            entry.handle = self.scene.add_mesh(name=name, **arguments)
            return
        points = {key: arguments[key] for key in ("positions", "corner_normals", "vertex_normals") if key in arguments}
        entry.topology, entry.shape = topology(arguments), checksum(points.values())
        same = known.topology == entry.topology
        if same and known.shape == entry.shape:
            return
        self.report.meshes += 1
        self.scene.set_mesh(entry.handle, **(points if same else arguments))

    # -- groups

    def _remove_group(self, group: Group) -> None:
        if len(group.handles):
            self.scene.remove_instances(group.handles)
            self.report.removed += len(group.handles)
        group.handles, group.mesh_handle = np.empty(0, np.uint32), None

    def _store_group(self, walk: Walk, mesh: int | None) -> None:
        group = walk.group
        transforms = stack_matrices(walk.matrices)
        randoms = np.array(walk.randoms, np.int64).astype(np.uint32)
        if group.points is not None:
            randoms = np.repeat(randoms, len(group.points))
            transforms = (transforms[:, None] @ group.points[None]).reshape(-1, 4, 4)
        if group.mesh_handle != mesh or not np.array_equal(randoms, group.randoms):
            self._remove_group(group)
            if mesh is not None and len(transforms):
                group.handles = self.scene.add_instances(
                    mesh, transforms, randoms=(randoms / np.float64(0xFFFFFFFF)).astype(np.float32), **group.properties)
                self.report.instances += len(transforms)
            group.mesh_handle = mesh
        elif len(group.handles):
            moved = (transforms != group.transforms).any((1, 2))
            if moved.any():
                self.scene.set_transforms(group.handles[moved], transforms[moved])
                self.report.moved += int(moved.sum())
            changed = {name: value for name, value in group.properties.items() if group.shown[name] != value}
            if changed:
                self.scene.set_instances(group.handles, **changed)
                self.report.instances += len(group.handles)
        group.transforms, group.randoms, group.shown = transforms, randoms, group.properties

    # -- lights

    def _light(self, instance: Any, ob: Any, data: Any, key: GroupKey) -> None:
        if is_portal(data):
            return
        bits, _, _ = object_visibility(ob, instance.parent if instance.is_instance else None, self.layer)
        transform = stack_matrices([instance.matrix_world.copy()])[0]
        try:
            arguments = read_light(data, transform, self.materials.context(f"Light '{ob.name}'"), bits)
            arguments["name"] = ob.name
            self._store_light(key, arguments)
        except Exception as error:  # the render goes on without the light
            self.warn(f"Light '{ob.name}': cannot be used ({error}): left out")
            self.next_lights.discard(key)

    def _store_light(self, key: GroupKey, arguments: dict[str, Any]) -> None:
        self.next_lights.add(key)
        images, sign, known = self.materials.images_of(arguments.get("graph")), digest(arguments), self.lights.get(key)
        if known is not None and known.key == sign:
            return
        kind = arguments["kind"]
        self.report.lights += 1
        if known is not None and known.kind == kind:
            given = {name: value for name, value in arguments.items() if name != "kind"}
            self.scene.set_light(known.handle, **{"graph": None, **given})
            handle = known.handle
        else:
            if known is not None:
                self.scene.remove_light(self.lights.pop(key).handle)
            handle = self.scene.add_light(**arguments)
        self.lights[key] = LightEntry(handle, kind, sign, images)


NOTHING, LIGHT = Walk((0, 0, 0), None), Walk((0, 0, 0), None)


def fingerprint_of(use: MeshUse) -> tuple[int, ...]:
    return (0,) if use.maker is not None or use.is_points else fingerprint(use.data)


def checksum(arrays: Iterable[NDArray[Any] | None], start: int = 0) -> int:
    for array in arrays:
        if array is not None:
            start = zlib.crc32(np.ascontiguousarray(array).view(np.uint8).reshape(-1), start)
    return start


def topology(arguments: dict[str, Any]) -> int:
    """A checksum of everything in a mesh but its positions and normals."""
    names = ("triangles", "corners", "corner_vertices", "faces", "materials", "smooth")
    words = repr((list(arguments["uvs"]), arguments["active_uv"], list(arguments["attributes"]), arguments["active_color"],
                  len(arguments["positions"]), [name in arguments for name in ("corner_normals", "vertex_normals")]))
    return checksum([*(arguments.get(name) for name in names), *arguments["uvs"].values(),
                     *(values for _, values in arguments["attributes"].values())], zlib.crc32(words.encode()))
