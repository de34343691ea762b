# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights and worlds as the native scene takes them: units as Blender's users know them, node trees as graphs or folded."""
from __future__ import annotations

from collections.abc import Callable
from math import pi, sin
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from .nodes import Context, Graph, compile_tree, constant_emission, solid_graph
from .visibility import world_visibility

KINDS = {"POINT": "point", "SPOT": "spot", "SUN": "sun", "AREA": "area"}


def uses_nodes(owner: Any) -> bool:
    """`use_nodes` is on its way out: a tree that is there counts where the switch no longer is."""
    return getattr(owner, "node_tree", None) is not None and bool(getattr(owner, "use_nodes", True))


def light_area(light: Any, scale: tuple[float, float]) -> float:
    """What Blender divides a light's power by when it is normalised (m², or sr for a sun)."""
    if light.type == "AREA":
        x = light.size * scale[0]
        y = (light.size_y if light.shape in {"RECTANGLE", "ELLIPSE"} else light.size) * scale[1]
        return x * y * (pi / 4 if light.shape in {"DISK", "ELLIPSE"} else 1.0)
    if light.type == "SUN":
        return pi * sin(light.angle / 2) ** 2 if light.angle > 0 else 1.0
    return 4 * pi * light.shadow_soft_size**2 if light.shadow_soft_size > 0 else 4.0


def is_portal(light: Any) -> bool:
    return light.type == "AREA" and bool(getattr(getattr(light, "cycles", None), "is_portal", False))


def read_light(light: Any, transform: NDArray[np.float64], context: Context, visibility: int) -> dict[str, Any]:
    """Keyword arguments of `Scene.add_light`."""
    cycles = getattr(light, "cycles", None)
    color, power = np.array(light.color[:3], float), float(light.energy)
    power *= 2.0 ** float(getattr(light, "exposure", 0.0))
    if light.type == "AREA" and bpy.app.version < (4, 0, 0):
        power *= np.pi / 4.0  # Cycles 3.4 divides an area lamp's power by 4 m², 4.5 and 5.0 by pi (measured)
    if getattr(light, "use_temperature", False):
        color *= np.array(light.temperature_color[:3])
    if not getattr(light, "normalize", True):
        scale = tuple(np.linalg.norm(transform[:3, axis]) for axis in (0, 1))
        power *= light_area(light, scale)
    result: dict[str, Any] = {
        "kind": KINDS[light.type], "transform": transform, "name": light.name, "power": power, "visibility": visibility,
        "cast_shadow": bool(getattr(cycles, "cast_shadow", getattr(light, "use_shadow", True))),
        "multiple_importance": bool(getattr(cycles, "use_multiple_importance_sampling", True)),
    }
    if bpy.app.version < (4, 0, 0):  # spots and suns meant something else (measured in 3.4)
        result["version"] = 1
    if light.type in {"POINT", "SPOT"}:
        result["radius"] = light.shadow_soft_size
        result["soft_falloff"] = bool(getattr(light, "use_soft_falloff", True))
    if light.type == "SPOT":
        result["spot_size"], result["spot_blend"] = light.spot_size, light.spot_blend
    if light.type == "SUN":
        result["angle"] = light.angle
    if light.type == "AREA":
        result["shape"] = light.shape.lower()
        height = light.size_y if light.shape in {"RECTANGLE", "ELLIPSE"} else light.size
        result["size"] = (light.size, height)
        result["spread"] = getattr(light, "spread", pi)
    if uses_nodes(light):
        graph = compile_tree(light.node_tree, "light", context)
        folded = constant_emission(graph)
        if folded is None:
            result["graph"] = graph
        else:
            color *= np.array(folded)
    result["color"] = tuple(map(float, color))
    return result


def read_world(world: Any, context_of: Callable[[Any], Context]) -> dict[str, Any]:
    """Keyword arguments of `Scene.set_world`."""
    if world is None:
        return {"graph": None}
    if uses_nodes(world):
        graph: Graph | None = compile_tree(world.node_tree, "world", context_of(world))
        if graph["surface"] is None:
            graph = None
    else:
        graph = solid_graph("background", tuple(world.color), strength=1.0)
    cycles = getattr(world, "cycles", None)
    resolution = getattr(cycles, "sample_map_resolution", 0) if getattr(cycles, "sampling_method", "") == "MANUAL" else 0
    return {"graph": graph, "visibility": world_visibility(world), "importance_resolution": int(resolution)}
