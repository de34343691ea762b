# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes a description into an `afterglow.Scene` and keeps the handles, so that a later frame is a few edits."""

from __future__ import annotations

from typing import Any

import numpy as np

from .description import Description, Light, Node, Output


def graph(root: Node, images: dict[str, int] | None = None) -> dict[str, Any]:
    """The module's graph of a tree of nodes; a node that is used twice stands in it once."""
    nodes: list[dict[str, Any]] = []
    index: dict[int, int] = {}

    def add(item: Node) -> int:
        if id(item) in index:
            return index[id(item)]
        inputs: dict[str, Any] = {}
        for name, value in item.inputs.items():
            if isinstance(value, Node):
                inputs[name] = ("link", add(value), value.output or FIRST_OUTPUT.get(value.type, "shader"))
            elif isinstance(value, Output):
                inputs[name] = ("link", add(value.node), value.name)
            else:
                inputs[name] = value if isinstance(value, (int, float)) else tuple(float(v) for v in value)
        params = dict(item.params)
        if "image" in params and images is not None:
            params["image"] = images[params["image"]]
        if item.type == "principled":
            params.setdefault("version", 2)
            params.setdefault("distribution", "multi_ggx")
        nodes.append({"type": item.type, "name": item.type, "params": params, "inputs": inputs})
        index[id(item)] = len(nodes) - 1
        return index[id(item)]

    top = add(root)
    return {"nodes": nodes, "surface": ("link", top, "shader")}


FIRST_OUTPUT = {
    "image_texture": "color", "environment_texture": "color", "checker_texture": "color", "texture_coordinate": "generated",
    "mapping": "vector", "bump": "normal", "normal_map": "normal", "color_attribute": "color", "fresnel": "fac",
    "layer_weight": "fresnel", "rgb": "color", "value": "value", "math": "value", "vector_math": "vector",
    "gradient_texture": "color", "combine": "color", "separate": "red", "geometry": "position", "mix": "result",
}


class Built:
    """A description in a native scene: `scene`, and the handles of its objects, lights, meshes, materials and images."""

    def __init__(self, description: Description, frame: float | None = None) -> None:
        from .. import ALL_RAYS, CAMERA, Scene

        self.description = description
        self.scene = scene = Scene()
        start = description.frames[0] if frame is None else frame
        self.images = {n: scene.add_image(p.pixels, name=n, colorspace=p.colorspace) for n, p in description.images.items()}
        self.materials = {n: scene.add_material(graph(m, self.images), name=n) for n, m in description.materials.items()}
        self.meshes: dict[str, int] = {}
        for name, mesh in description.meshes.items():
            faces = len(mesh.triangles)
            self.meshes[name] = scene.add_mesh(
                name=name,
                positions=mesh.positions if mesh.deform is None else mesh.deform(start),
                triangles=mesh.triangles,
                smooth=np.full(faces, mesh.smooth),
                materials=np.zeros(faces, np.int32) if mesh.slots is None else mesh.slots,
                uvs=None if mesh.uvs is None else {"UVMap": mesh.uvs},
                active_uv="" if mesh.uvs is None else "UVMap",
                attributes=None if mesh.colors is None else {"Color": ("vertex", mesh.colors)},
                active_color="" if mesh.colors is None else "Color",
            )
        self.instances: dict[str, Any] = {}
        for item in description.objects:
            self.instances[item.name] = scene.add_instances(
                self.meshes[item.mesh],
                item.at(start),
                name=item.name,
                materials=[self.materials[m] for m in item.materials],
                object_index=item.pass_index,
                visibility=ALL_RAYS if item.camera_visible else ALL_RAYS & ~CAMERA,
            )
        self.lights = {light.name: scene.add_light(**_light_arguments(light, start)) for light in description.lights}
        if description.world is not None:
            scene.set_world(graph(description.world, self.images))
        self.set_camera(description.resolution, start)
        self.changes = scene.commit()

    def set_camera(self, resolution: tuple[int, int], frame: float) -> None:
        """Fits the camera's window to an image of this many pixels."""
        camera = self.description.camera
        self.scene.set_camera(
            camera.kind, camera.at(frame), window=camera.window(*resolution), clip=camera.clip,
            aperture_radius=camera.aperture_radius, focus_distance=camera.focus_distance,
        )

    def move_to(self, frame: float, resolution: tuple[int, int] | None = None) -> Any:
        """Edits what differs at another frame, commits, and returns the changes."""
        for item in self.description.objects:
            if item.move is not None:
                self.scene.set_transforms(self.instances[item.name], item.at(frame))
        for name, mesh in self.description.meshes.items():
            if mesh.deform is not None:
                self.scene.set_mesh(self.meshes[name], positions=mesh.deform(frame))
        for light in self.description.lights:
            if light.move is not None:
                self.scene.set_light(self.lights[light.name], transform=light.at(frame))
        if self.description.camera.move is not None:
            self.set_camera(resolution or self.description.resolution, frame)
        self.changes = self.scene.commit()
        return self.changes


def _light_arguments(light: Light, frame: float) -> dict[str, Any]:
    arguments: dict[str, Any] = dict(kind=light.kind, transform=light.at(frame), name=light.name, color=light.color,
                                     power=light.power)
    if light.kind in ("point", "spot"):
        arguments["radius"] = light.radius
    if light.kind == "spot":
        arguments.update(spot_size=light.spot_size, spot_blend=light.spot_blend)
    if light.kind == "sun":
        arguments["angle"] = light.angle
    if light.kind == "area":
        arguments.update(shape=light.shape, size=light.size, spread=light.spread)
    return arguments
