# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials and images of one native scene: compiled when first used, compared when reported, removed when unused."""
from __future__ import annotations

import pickle
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import bpy

from .attributes import NOBODY, Owner, property_of
from .images import read_image, signature
from .lights import uses_nodes
from .nodes import Context, Graph, compile_tree, names_of_attributes, solid_graph

DEFAULT = 0  # the key of Blender's default surface: an empty slot
HOLLOW = 1   # added to an address, which is even: the variant of a material for points, invisible from inside


def digest(value: Any) -> bytes:
    """Equal for equal graphs and arguments; arrays by content."""
    return pickle.dumps(value, protocol=5)


def default_graph() -> Graph:
    """Blender's surface for an empty slot: grey and diffuse, since 5.0 the Principled BSDF as it comes."""
    if bpy.app.version < (5, 0, 0):
        return solid_graph("diffuse_bsdf", (0.8, 0.8, 0.8))
    node = {"type": "principled", "name": "", "params": {"distribution": "multi_ggx", "version": 2},
            "inputs": {"base_color": (0.8, 0.8, 0.8), "roughness": 0.5, "ior": 1.5}}
    return {"nodes": [node], "surface": ("link", 0, "shader")}


def hollow_graph(graph: Graph) -> Graph:
    """The same from outside, nothing from inside: Blender's points are spheres that a ray leaves unseen."""
    if graph["surface"] is None:
        return graph
    first = len(graph["nodes"])
    nodes = [*graph["nodes"], {"type": "geometry", "name": "", "params": {}, "inputs": {}},
             {"type": "transparent_bsdf", "name": "", "params": {}, "inputs": {"color": (1.0, 1.0, 1.0)}},
             {"type": "mix_shader", "name": "", "params": {}, "inputs": {
                 "fac": ("link", first, "backfacing"), "shader": graph["surface"], "shader_001": ("link", first + 1, "shader")}}]
    return {"nodes": nodes, "surface": ("link", first + 2, "shader")}


@dataclass
class Material:
    handle: int
    key: bytes
    images: set[int]
    attributes: set[str]


@dataclass
class Image:
    handle: int | None
    key: Any


@dataclass
class MaterialTable:
    scene: Any
    warn: Callable[[str], None]
    table: dict[int, Material] = field(default_factory=dict)   # address of the original material
    images: dict[Any, Image] = field(default_factory=dict)     # (address of the original image, path of the frame)
    attributes_changed: bool = False                           # a known material may ask objects for others than before
    moving: set[int] = field(default_factory=set)              # materials that read an object's matrix
    _dirty: set[int] = field(default_factory=set)
    _everything: bool = False
    _dirty_images: set[int] = field(default_factory=set)
    _fresh: set[Any] = field(default_factory=set)
    _frame: int = 0
    _report: Any = None
    _reads_matrix: bool = False
    # Materials that ask for properties of the object that shows them: one of the native scene for each of those.
    personal: set[int] = field(default_factory=set)
    _variants: dict[tuple[int, int, int], int] = field(default_factory=dict)
    _reads_owner: bool = False
    _owner: Owner = NOBODY
    _view: tuple[Any, ...] = ()

    # -- one sync

    def begin(self, depsgraph: Any, updates: Any, report: Any) -> None:
        """Recompiles at once the known materials that may differ; others when an object asks for them."""
        self._report, self._dirty_images = report, updates.images
        self._everything = (updates.everything or updates.trees or bool(updates.images)
                            or depsgraph.scene.frame_current != self._frame)
        self._frame = depsgraph.scene.frame_current
        self._view = (depsgraph.view_layer_eval, depsgraph.scene_eval, depsgraph.scene_eval.world)
        self._fresh, self.attributes_changed = set(), False
        self._dirty = set(updates.materials)
        if not self._everything and not self._dirty and not self.moving:
            return
        self.attributes_changed = any(address < 0 for address in self.table)  # variants are compiled as objects are walked
        for original in bpy.data.materials:
            for address in (original.as_pointer(), original.as_pointer() + HOLLOW):
                if address in self.table and (self._everything or original.as_pointer() in self._dirty or address in self.moving):
                    self._compile(address, original.evaluated_get(depsgraph), "")

    def end(self, used: set[int], used_images: set[int], report: Any) -> None:
        """Removes what nothing uses any more."""
        for address in [a for a in self.table if a not in used]:
            self.scene.remove_material(self.table.pop(address).handle)
            self.moving.discard(address)
            report.removed += 1
        handles = set(used_images)
        for material in self.table.values():
            handles |= material.images
        for key in [k for k, image in self.images.items() if image.handle not in handles]:
            image = self.images.pop(key)
            if image.handle is not None:
                self.scene.remove_image(image.handle)

    # -- materials

    def handle(self, material: Any, user: str, hollow: bool = False, owner: Owner = NOBODY) -> tuple[int, int]:
        """(key, handle) of an evaluated material, None for an empty slot. user: an object for warnings."""
        original = DEFAULT if material is None else material.original.as_pointer()
        address = original + (HOLLOW if hollow else 0)
        known = self.table.get(address)
        if address not in self.personal and (
                known is None or (address not in self._fresh and (self._everything or original in self._dirty))):
            known = self._compile(address, material, user)
        if address in self.personal:
            address = self._variants.setdefault((address, *owner.key), -1 - len(self._variants))
            known = self.table.get(address) if address in self._fresh else None
            if known is None:
                known = self._compile(address, material, user, owner, hollow)
        return address, known.handle

    def _compile(self, address: int, material: Any, user: str, owner: Owner = NOBODY, hollow: bool = False) -> Material:
        self._fresh.add(address)
        self._reads_matrix = self._reads_owner = False
        self._owner = owner
        graph, arguments = self._read(material, user)
        if hollow if address < 0 else address & HOLLOW:
            graph = hollow_graph(graph)
        if address >= 0:
            (self.personal.add if self._reads_owner else self.personal.discard)(address)
        (self.moving.add if self._reads_matrix else self.moving.discard)(address)
        key, known = digest((graph, arguments)), self.table.get(address)
        if known is not None and known.key == key:
            return known
        names = names_of_attributes(graph)
        if known is not None and known.attributes != names:
            self.attributes_changed = True
        if known is not None:
            self.scene.set_material(known.handle, graph, **arguments)
            handle = known.handle
        else:
            handle = self.scene.add_material(graph, **arguments)
        self.table[address] = Material(handle, key, self.images_of(graph), names)
        self._report.materials += 1
        return self.table[address]

    def _read(self, material: Any, user: str) -> tuple[Graph, dict[str, Any]]:
        if material is None:
            return default_graph(), {"name": "Default Surface"}
        context = self.context(f"Material '{material.name}'" + (f" (object '{user}')" if user else ""))
        if uses_nodes(material):
            try:
                graph = compile_tree(material.node_tree, "material", context)
            except Exception as error:  # a broken tree must not end the render
                context.warn_once(f"its nodes cannot be read ({error}): shown grey")
                graph = solid_graph("diffuse_bsdf", (0.8, 0.8, 0.8))
        else:
            graph = solid_graph("diffuse_bsdf", tuple(material.diffuse_color))
        cycles = getattr(material, "cycles", None)
        sampling = getattr(cycles, "sample_as_light", True) and getattr(cycles, "emission_sampling", "AUTO") != "NONE"
        return graph, {"name": material.name, "pass_index": material.pass_index, "emission_sampling": bool(sampling)}

    def context(self, owner: str) -> Context:
        return Context(image=lambda image, user: self.image(image, user, owner), warn=self.warn, matrix=self._matrix, owner=owner,
                       attribute=self._attribute)

    def _attribute(self, kind: str, name: str) -> tuple[float, ...] | None:
        """A property of the object that shows the material, of what made it an instance, or of the view layer."""
        if kind == "VIEW_LAYER":
            self._reads_matrix = True  # nobody tells when it changes: read again with each sync
            return property_of(self._view, name)
        self._reads_owner = True
        # instances wear their maker's colour
        return property_of(self._owner.places(kind == "INSTANCER" or name == "color"), name)

    def _matrix(self, ob: Any) -> list[list[float]]:
        self._reads_matrix = True
        return [[float(x) for x in row] for row in ob.matrix_world.inverted_safe()]

    # -- images

    def image(self, image: Any, image_user: Any, owner: str) -> int | None:
        """An image's handle, added or replaced when it is not what it was; None: missing, it shows magenta."""
        original = image.original or image
        path = ""
        if image.source == "SEQUENCE" and image_user is not None:
            path = image.filepath_from_user(image_user=image_user)
        key = (original.as_pointer(), path)
        sign, known = signature(image, self._frame), self.images.get(key)
        if known is not None and known.key == sign and (original.as_pointer() not in self._dirty_images or key in self._fresh):
            if known.handle is None:
                self._missing(image, owner)
            return known.handle
        self._fresh.add(key)
        found = None
        try:
            found = read_image(image, image_user)
        except (OSError, RuntimeError, ValueError) as error:
            self.warn(f"{owner}: image '{image.name}' cannot be read ({error}): shown magenta")
        if found is None:
            self._missing(image, owner)
        self.images[key] = Image(self._store(known, found), sign)
        return self.images[key].handle

    def _missing(self, image: Any, owner: str) -> None:
        self.warn(f"{owner}: image '{image.name}' is missing ({image.filepath or image.source.lower()}): shown magenta")

    def _store(self, known: Image | None, found: Any) -> int | None:
        handle = known.handle if known is not None else None
        if found is None:
            return None
        self._report.images += 1
        if handle is not None:
            self.scene.set_image(handle, found[0], **found[1])
            return handle
        return self.scene.add_image(found[0], **found[1])

    def file_image(self, path: str) -> int | None:
        """An image by its file's name alone: studio lights."""
        key = ("file", path)
        if key not in self.images:
            self.images[key] = Image(self.scene.add_image(path, name=path, colorspace="linear"), None)
        return self.images[key].handle

    @staticmethod
    def images_of(graph: Graph | None) -> set[int]:
        return {node["params"]["image"] for node in graph["nodes"] if node["params"].get("image") is not None} if graph else set()
