# SPDX-License-Identifier: GPL-3.0-or-later
"""Rules for texture nodes and for everything that becomes a table: colour ramps and curves, sampled as Blender samples them.

A texture node's own mapping (the panel that the Python interface still offers) is folded into a 3×4 matrix.
"""
from __future__ import annotations

from math import cos, sin
from typing import Any

import numpy as np

from .compiler import Compiler, NodeView, Source, is_link, snake

Outputs = dict[str, Source]
TABLE = 256  # entries of a ramp or curve, as in Cycles
MAGENTA = (1.0, 0.0, 1.0)


def texture_mapping(node: Any) -> np.ndarray | None:
    """The node's own mapping as a 3×4 matrix, None where it does nothing."""
    mapping = getattr(node, "texture_mapping", None)
    if mapping is None:
        return None
    axes = [getattr(mapping, "mapping_" + axis) for axis in "xyz"]
    move, turn, scale = tuple(mapping.translation), tuple(mapping.rotation), tuple(mapping.scale)
    if axes == ["X", "Y", "Z"] and move == (0, 0, 0) and turn == (0, 0, 0) and scale == (1, 1, 1):
        return None
    choose = np.zeros((3, 3))
    for row, axis in enumerate(axes):
        if axis != "NONE":
            choose[row, "XYZ".index(axis)] = 1.0
    sizes = np.diag([s if s != 0.0 or mapping.vector_type == "NORMAL" else 1.0 for s in scale])
    (cx, cy, cz), (sx, sy, sz) = map(cos, turn), map(sin, turn)
    rotation = (np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]]) @ np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
                @ np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]]))
    result = np.zeros((3, 4))
    kind = mapping.vector_type
    if kind == "TEXTURE":  # the inverse of moving the texture
        inverse = np.linalg.inv(rotation @ sizes)
        result[:, :3], result[:, 3] = inverse, -inverse @ move
    elif kind == "NORMAL":
        result[:, :3] = rotation @ np.linalg.inv(sizes)
    else:
        result[:, :3], result[:, 3] = rotation @ sizes, move if kind == "POINT" else (0, 0, 0)
    result[:, :3] = result[:, :3] @ choose
    return result.astype(np.float32)


def image_texture_node(compiler: Compiler, view: NodeView) -> Outputs:
    node = view.node
    if node.image is None:  # as missing as a file that is gone
        return {"Color": MAGENTA, "Alpha": 1.0}
    handle = compiler.context.image(node.image, node.image_user)
    index = compiler.add("image_texture", node.name, {"vector": view.input("Vector")}, image=handle,
                         interpolation=node.interpolation.lower(), extension=node.extension.lower(),
                         projection=node.projection.lower(), projection_blend=node.projection_blend,
                         mapping=texture_mapping(node), unassociate=unassociates(view))
    return {"Color": ("link", index, "color"), "Alpha": ("link", index, "alpha")}


def unassociates(view: NodeView) -> bool:
    """Whether the colour is divided by alpha: only where alpha itself is used, too, and stands for coverage."""
    image = view.node.image
    data = getattr(image.colorspace_settings, "is_data", image.colorspace_settings.name in {"Non-Color", "Raw"})
    return view.output_linked("Alpha") and not data and image.alpha_mode not in {"CHANNEL_PACKED", "NONE"}


def environment_texture_node(compiler: Compiler, view: NodeView) -> Outputs:
    node = view.node
    if node.image is None:
        return {"Color": MAGENTA}
    handle = compiler.context.image(node.image, node.image_user)
    return {"Color": compiler.link("color", "environment_texture", node.name, {"vector": view.input("Vector")}, image=handle,
                                   interpolation=node.interpolation.lower(), projection=node.projection.lower(),
                                   mapping=texture_mapping(node))}


def param_of(value: Any) -> Any:
    """A node's property as a parameter: words in lower case, vectors as plain tuples."""
    if isinstance(value, str):
        return value.lower()
    return value if isinstance(value, (bool, int, float)) else tuple(value)


def procedural(kind: str, params: dict[str, str]) -> Any:
    """params: native name → the node's property; values in lower case, numbers as they are."""
    def rule(compiler: Compiler, view: NodeView) -> Outputs:
        node = view.node
        given = {snake(name): value for name, value in view.inputs()}
        values = {native: getattr(node, name) for native, name in params.items() if hasattr(node, name)}
        index = compiler.add(kind, node.name, given, mapping=texture_mapping(node),
                             **{key: param_of(value) for key, value in values.items()})
        return {socket.identifier: ("link", index, snake(socket.identifier)) for socket in node.outputs}
    return rule


def noise_node(compiler: Compiler, view: NodeView) -> Outputs:
    """Noise Texture; Musgrave (gone in 4.1) is one of its kinds."""
    node = view.node
    musgrave = node.bl_idname == "ShaderNodeTexMusgrave"
    given = {snake(name): value for name, value in view.inputs()}
    if musgrave:
        dimension, lacunarity = view.input("Dimension"), view.input("Lacunarity")
        given["roughness"] = compiler.math("power", lacunarity, compiler.math("multiply", dimension, -1.0))
        detail = view.input("Detail")
        given["detail"] = compiler.math("subtract", detail, 1.0) if is_link(detail) else max(detail - 1.0, 0.0)
        given.pop("dimension", None)
    kind = (node.musgrave_type if musgrave else getattr(node, "noise_type", "FBM")).lower()
    params = {"dimensions": getattr(node, "musgrave_dimensions", "3D") if musgrave else node.noise_dimensions,
              "noise_type": kind, "normalize": False if musgrave else getattr(node, "normalize", True),
              "mapping": texture_mapping(node)}
    index = compiler.add("noise_texture", node.name, given, **params)
    return {socket.identifier: ("link", index, snake(socket.identifier)) for socket in node.outputs}


def texture_coordinate_node(compiler: Compiler, view: NodeView) -> Outputs:
    target = view.node.object
    matrix = compiler.context.matrix(target) if target is not None else None
    index = compiler.add("texture_coordinate", view.node.name, object_to_world=matrix)
    return {socket.identifier: ("link", index, snake(socket.identifier)) for socket in view.node.outputs}


def color_ramp_node(compiler: Compiler, view: NodeView) -> Outputs:
    ramp = view.node.color_ramp
    table = np.array([tuple(ramp.evaluate(i / (TABLE - 1))) for i in range(TABLE)], np.float32)
    index = compiler.add("color_ramp", view.node.name, {"fac": view.input("Fac")}, table=table,
                         interpolate=ramp.interpolation != "CONSTANT")
    return {"Color": ("link", index, "color"), "Alpha": ("link", index, "alpha")}


def curve_table(mapping: Any, curves: int, combined: int | None = None) -> tuple[np.ndarray, tuple[float, float]]:
    """(TABLE, curves) samples over the range of the curves' points; combined: the curve that all others are applied to."""
    mapping.initialize()
    points = [point.location[0] for curve in mapping.curves for point in curve.points]
    low, high = min(points, default=0.0), max(points, default=1.0)
    if not high > low:
        high = low + 1.0
    columns = []
    for index in range(curves):
        column = []
        for i in range(TABLE):
            x = low + (high - low) * i / (TABLE - 1)
            if combined is not None:
                x = mapping.evaluate(mapping.curves[combined], x)
            column.append(mapping.evaluate(mapping.curves[index], x))
        columns.append(column)
    return np.array(columns, np.float32).T.copy(), (low, high)


def curve_node(kind: str, curves: int, combined: int | None, source: str, target: str) -> Any:
    def rule(compiler: Compiler, view: NodeView) -> Outputs:
        mapping = view.node.mapping
        table, span = curve_table(mapping, curves, combined)
        given = {"fac": view.input("Fac", "Factor"), source.lower(): view.input(source)}
        return {target: compiler.link(target.lower(), kind, view.node.name, given, table=table, range=span,
                                      extrapolate=mapping.extend == "EXTRAPOLATED")}
    return rule


RULES = {
    "ShaderNodeTexImage": image_texture_node,
    "ShaderNodeTexEnvironment": environment_texture_node,
    "ShaderNodeTexCoord": texture_coordinate_node,
    "ShaderNodeTexChecker": procedural("checker_texture", {}),
    "ShaderNodeTexNoise": noise_node,
    "ShaderNodeTexMusgrave": noise_node,
    "ShaderNodeTexVoronoi": procedural("voronoi_texture", {"dimensions": "voronoi_dimensions", "feature": "feature",
                                                           "distance": "distance", "normalize": "normalize"}),
    "ShaderNodeTexWave": procedural("wave_texture", {"wave_type": "wave_type", "profile": "wave_profile",
                                                     "bands_direction": "bands_direction",
                                                     "rings_direction": "rings_direction"}),
    "ShaderNodeTexGradient": procedural("gradient_texture", {"gradient_type": "gradient_type"}),
    "ShaderNodeTexMagic": procedural("magic_texture", {"depth": "turbulence_depth"}),
    "ShaderNodeTexBrick": procedural("brick_texture", {"offset": "offset", "offset_frequency": "offset_frequency",
                                                       "squash": "squash", "squash_frequency": "squash_frequency"}),
    "ShaderNodeTexWhiteNoise": procedural("white_noise_texture", {"dimensions": "noise_dimensions"}),
    "ShaderNodeTexSky": procedural("sky_texture", {
        "sky_type": "sky_type", "turbidity": "turbidity", "ground_albedo": "ground_albedo", "sun_disc": "sun_disc",
        "sun_size": "sun_size", "sun_intensity": "sun_intensity", "sun_elevation": "sun_elevation",
        "sun_rotation": "sun_rotation", "altitude": "altitude", "air_density": "air_density", "dust_density": "dust_density",
        "aerosol_density": "aerosol_density", "ozone_density": "ozone_density", "sun_direction": "sun_direction"}),
    "ShaderNodeValToRGB": color_ramp_node,
    "ShaderNodeRGBCurve": curve_node("rgb_curve", 3, 3, "Color", "Color"),
    "ShaderNodeVectorCurve": curve_node("vector_curve", 3, None, "Vector", "Vector"),
    "ShaderNodeFloatCurve": curve_node("float_curve", 1, None, "Value", "Value"),
}
