# SPDX-License-Identifier: GPL-3.0-or-later
"""The viewport's studio light in place of the scene's world, as Blender's own viewport offers it."""
from __future__ import annotations

from typing import Any

from .nodes import Graph, solid_graph


def studio_world(shading: tuple[Any, ...], materials: Any) -> dict[str, Any]:
    """Keyword arguments of `Scene.set_world` for the studio light of `viewport_shading`."""
    _, _, path, rotation, strength = shading
    handle = materials.file_image(path) if path else None
    if handle is None:
        return {"graph": solid_graph("background", (0.05, 0.05, 0.05), strength=1.0)}
    graph: Graph = {"nodes": [
        {"type": "texture_coordinate", "name": "", "params": {"object_to_world": None}, "inputs": {}},
        {"type": "mapping", "name": "", "params": {"kind": "point"},
         "inputs": {"vector": ("link", 0, "generated"), "rotation": (0.0, 0.0, rotation)}},
        {"type": "environment_texture", "name": "", "params": {"image": handle, "interpolation": "linear",
                                                               "projection": "equirectangular"},
         "inputs": {"vector": ("link", 1, "vector")}},
        {"type": "background", "name": "", "params": {}, "inputs": {"color": ("link", 2, "color"), "strength": strength}}],
        "surface": ("link", 3, "shader")}
    return {"graph": graph}
