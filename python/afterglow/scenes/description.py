# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene as plain data: meshes as numpy arrays, materials as trees of nodes, lights, a camera, motion as functions.

One description is written to the native module (`native.py`) and to Blender (`blender.py`), so that a test of the kernel
and a .blend file speak of the same scene. Lengths are metres, angles radians, light scene-linear Rec. 709, z is up.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

Color = tuple[float, float, float]
Matrix = NDArray[np.float64]
Motion = Callable[[float], Matrix]
Deformation = Callable[[float], NDArray[np.float32]]


@dataclass(eq=False)
class Node:
    """One shader node: the module's type name, its inputs (a value or another node) and its parameters.

    `output` names the output that a user of this node reads; "" takes the first. A node that is used twice is one node.
    """

    type: str
    inputs: dict[str, Any] = field(default_factory=dict)
    params: dict[str, Any] = field(default_factory=dict)
    output: str = ""

    def out(self, name: str) -> Output:
        return Output(self, name)


@dataclass(eq=False)
class Output:
    """A named output of a node."""

    node: Node
    name: str


@dataclass(eq=False)
class Picture:
    """Pixels of an image texture, (height, width, 4) float32, row 0 at the bottom. colorspace: "sRGB", "linear", "non-color"."""

    pixels: NDArray[np.float32]
    colorspace: str = "sRGB"


@dataclass(eq=False)
class Mesh:
    """positions (V, 3); triangles (T, 3); uvs (3T, 2) or None; slots (T,) material slot of each triangle or None."""

    positions: NDArray[np.float32]
    triangles: NDArray[np.int32]
    smooth: bool = False
    uvs: NDArray[np.float32] | None = None
    slots: NDArray[np.int32] | None = None
    colors: NDArray[np.float32] | None = None  # (V, 4), attribute "Color"
    deform: Deformation | None = None

    def __post_init__(self) -> None:
        self.positions = np.ascontiguousarray(self.positions, np.float32).reshape(-1, 3)
        self.triangles = np.ascontiguousarray(self.triangles, np.int32).reshape(-1, 3)


@dataclass(eq=False)
class Object:
    """A mesh at one or more places. `move` gives the (4, 4) transform of its only place at a frame."""

    name: str
    mesh: str
    transforms: NDArray[np.float64] = field(default_factory=lambda: np.eye(4)[None])
    materials: tuple[str, ...] = ()
    move: Motion | None = None
    camera_visible: bool = True
    pass_index: int = 0

    def __post_init__(self) -> None:
        self.transforms = np.asarray(self.transforms, np.float64).reshape(-1, 4, 4)

    def at(self, frame: float) -> NDArray[np.float64]:
        return self.transforms if self.move is None else np.asarray(self.move(frame), np.float64).reshape(-1, 4, 4)


@dataclass(eq=False)
class Light:
    """kind "point", "spot", "sun" or "area"; power in Blender's units (W, for the sun W/m²); looks along its local −z."""

    name: str
    kind: str
    transform: Matrix
    power: float
    color: Color = (1.0, 1.0, 1.0)
    radius: float = 0.0
    angle: float = 0.0
    spot_size: float = math.pi / 4
    spot_blend: float = 0.15
    shape: str = "square"
    size: tuple[float, float] = (1.0, 1.0)
    spread: float = math.pi
    move: Motion | None = None

    def at(self, frame: float) -> Matrix:
        return self.transform if self.move is None else np.asarray(self.move(frame), np.float64)


@dataclass(eq=False)
class Camera:
    """Looks along its local −z, y up. `angle` is the field of view over the image's longer side (`width` when orthographic)."""

    transform: Matrix
    angle: float = math.radians(40.0)
    kind: str = "perspective"
    width: float = 2.0
    clip: tuple[float, float] = (0.01, 1000.0)
    aperture_radius: float = 0.0
    focus_distance: float = 1.0
    move: Motion | None = None

    def at(self, frame: float) -> Matrix:
        return self.transform if self.move is None else np.asarray(self.move(frame), np.float64)

    def window(self, width: int, height: int) -> tuple[float, float, float, float]:
        """(left, right, bottom, top) at distance 1 for an image of this many pixels."""
        half = self.width / 2 if self.kind == "orthographic" else math.tan(self.angle / 2)
        longer = max(width, height)
        return -half * width / longer, half * width / longer, -half * height / longer, half * height / longer


@dataclass(eq=False)
class Description:
    """A whole scene. `frames` is the range in which something moves, `resolution` the image it was made for."""

    name: str
    camera: Camera
    meshes: dict[str, Mesh] = field(default_factory=dict)
    materials: dict[str, Node] = field(default_factory=dict)
    objects: list[Object] = field(default_factory=list)
    lights: list[Light] = field(default_factory=list)
    images: dict[str, Picture] = field(default_factory=dict)
    world: Node | None = None
    frames: tuple[int, int] = (1, 1)
    resolution: tuple[int, int] = (256, 256)
    settings: dict[str, Any] = field(default_factory=dict)

    def add(self, name: str, mesh: Mesh, *materials: str, transform: Any = None, **kwargs: Any) -> Object:
        """Adds a mesh and an object of the same name that shows it."""
        self.meshes[name] = mesh
        item = Object(name, name, np.eye(4) if transform is None else transform, materials, **kwargs)
        self.objects.append(item)
        return item

    @property
    def triangle_count(self) -> int:
        """Triangles as the eye counts them: instances each on their own."""
        return sum(len(self.meshes[o.mesh].triangles) * len(o.transforms) for o in self.objects)

    def scaled(self, factor: float) -> Description:
        """The same scene `factor` times as large, lit so that the image stays the same. Motion is left out."""
        grow = scale(factor)
        result = self.transformed(grow)
        for light in result.lights:
            light.transform = light.transform @ scale(1.0 / factor)
            light.radius *= factor
            light.size = (light.size[0] * factor, light.size[1] * factor)
            if light.kind != "sun":
                light.power *= factor * factor
        result.camera.transform = result.camera.transform @ scale(1.0 / factor)
        result.camera.width *= factor
        result.camera.aperture_radius *= factor
        result.camera.focus_distance *= factor
        result.camera.clip = (self.camera.clip[0] * factor, self.camera.clip[1] * factor)
        return result

    def moved(self, offset: tuple[float, float, float]) -> Description:
        """The same scene somewhere else. Motion is left out."""
        return self.transformed(translate(offset))

    def transformed(self, matrix: Matrix) -> Description:
        """A copy with `matrix` before every transform, camera and lights included. Motion is left out."""
        from dataclasses import replace

        return replace(
            self,
            camera=replace(self.camera, transform=matrix @ self.camera.transform, move=None),
            objects=[replace(o, transforms=matrix @ o.transforms, move=None) for o in self.objects],
            lights=[replace(light, transform=matrix @ light.transform, move=None) for light in self.lights],
        )


def translate(offset: Any) -> Matrix:
    matrix = np.eye(4)
    matrix[:3, 3] = offset
    return matrix


def scale(factor: Any) -> Matrix:
    matrix = np.eye(4)
    matrix[[0, 1, 2], [0, 1, 2]] = factor
    return matrix


def rotate(angle: float, axis: str = "z") -> Matrix:
    """Right-handed rotation about a coordinate axis."""
    a, b = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    matrix = np.eye(4)
    matrix[a, a] = matrix[b, b] = math.cos(angle)
    matrix[a, b], matrix[b, a] = -math.sin(angle), math.sin(angle)
    return matrix


def look_at(eye: Any, target: Any, up: Any = (0.0, 0.0, 1.0)) -> Matrix:
    """A transform at `eye` whose local −z points to `target`: cameras and lights."""
    eye = np.asarray(eye, np.float64)
    back = eye - np.asarray(target, np.float64)
    back /= np.linalg.norm(back)
    right = np.cross(np.asarray(up, np.float64), back)
    if np.linalg.norm(right) < 1e-9:
        right = np.cross((0.0, 1.0, 0.0), back)
    right /= np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3, 0], matrix[:3, 1], matrix[:3, 2], matrix[:3, 3] = right, np.cross(back, right), back, eye
    return matrix


def node(kind: str, params: Mapping[str, Any] | None = None, **inputs: Any) -> Node:
    """Short for Node: `node("diffuse_bsdf", color=(0.8, 0.8, 0.8))`."""
    return Node(kind, dict(inputs), dict(params or {}))
