# SPDX-License-Identifier: GPL-3.0-or-later
"""An evaluated mesh as arguments of `Scene.add_mesh`: positions, triangles, normals, UVs, colours, slots.

Blender's layouts differ by version (structs until 3.5, single attributes since); each array names both ways and `arrays.read`
checks the one that it finds. Nothing here loops over elements.
"""
from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .arrays import SRGB_TO_LINEAR, raw_view, read
from .nodes import GENERATED, TANGENTS, UVS
from .tangents import tangents

DOMAINS = {"POINT": "vertex", "CORNER": "corner", "FACE": "face"}
# data type of an attribute → (property, memory type, width, type of foreach_get)
ATTRIBUTES = {
    "FLOAT": ("value", np.float32, 1), "FLOAT_VECTOR": ("vector", np.float32, 3), "FLOAT2": ("vector", np.float32, 2),
    "FLOAT_COLOR": ("color", np.float32, 4), "INT": ("value", np.int32, 1), "INT8": ("value", np.int8, 1),
    "BOOLEAN": ("value", np.bool_, 1), "QUATERNION": ("value", np.float32, 4),
}


def fingerprint(mesh: Any) -> tuple[int, ...]:
    """Cheap signs that a mesh at a known address is another one than before."""
    return (getattr(mesh, "session_uid", 0), len(mesh.vertices), len(mesh.loops), len(mesh.polygons))


def read_mesh(mesh: Any, attributes: Iterable[str] = ()) -> dict[str, Any] | None:
    """Arguments of `Scene.add_mesh` without the name; None: no triangle. attributes: names that materials ask for, UVS
    among them where anything asks for UV maps."""
    mesh.calc_loop_triangles()
    if not len(mesh.loop_triangles):
        return None
    result = _read_triangles(mesh)
    result["positions"] = read(mesh.vertices, "co", np.float32, 3)
    result.update(_read_normals(mesh))
    result["uvs"], result["active_uv"] = _read_uvs(mesh) if UVS in attributes else ({}, "")
    result["attributes"], result["active_color"] = _read_attributes(mesh, set(attributes))
    for name in attributes:
        if name.startswith(TANGENTS):
            vertices = result["corner_vertices"][result["corners"]]
            found = tangents({**result, "triangles": vertices}, name[len(TANGENTS):])
            if found is not None:
                result["attributes"][name] = ("corner", found)
    if "vertex_normals" in result and result["smooth"].all():
        del result["smooth"]  # as it is where normals are given
    if not ({"smooth", "materials"} & set(result) or any(domain == "face" for domain, _ in result["attributes"].values())):
        del result["faces"]  # nobody asks which face a triangle is of
    return result


def _read_triangles(mesh: Any) -> dict[str, NDArray[Any]]:
    triangles, loops = mesh.loop_triangles, mesh.loops
    corners = read(triangles, "loops", np.int32, 3)
    vertices = read(loops, "vertex_index", np.int32, 1)[:, 0]
    if len(mesh.polygons) == len(triangles):  # nothing but triangles: Blender keeps their order
        faces = None
    elif hasattr(mesh, "loop_triangle_polygons"):
        faces = read(mesh.loop_triangle_polygons, "value", np.int32, 1)[:, 0]
    else:
        faces = read(triangles, "polygon_index", np.int32, 1, offset=12)[:, 0]
    result = {"corners": corners, "corner_vertices": vertices, "faces": faces}
    materials = _read_material_indices(mesh)
    if materials is not None and materials.any():
        result["materials"] = materials
    return result


def _read_material_indices(mesh: Any) -> NDArray[Any] | None:
    attribute = mesh.attributes.get("material_index")
    if attribute is not None and attribute.domain == "FACE":
        return read(attribute.data, "value", np.int32, 1)[:, 0]
    if len(mesh.materials) < 2 or not hasattr(mesh, "use_auto_smooth"):
        return None  # without the attribute all faces have the first slot
    return read(mesh.polygons, "material_index", np.int16, 1, offset=8, copied_as=np.int32)[:, 0]


def _read_smooth(mesh: Any) -> NDArray[Any]:
    sharp = mesh.attributes.get("sharp_face")
    if sharp is not None and sharp.domain == "FACE":
        return ~read(sharp.data, "value", np.bool_, 1)[:, 0]
    if not hasattr(mesh, "use_auto_smooth"):
        return np.ones(len(mesh.polygons), np.bool_)
    smooth = np.empty(len(mesh.polygons), np.bool_)
    mesh.polygons.foreach_get("use_smooth", smooth)
    return smooth


def _read_normals(mesh: Any) -> dict[str, Any]:
    """Corner normals speak for themselves: with them, flat faces are smooth ones with equal normals."""
    if hasattr(mesh, "normals_domain"):  # since 4.1 the mesh itself knows how much its normals hold
        split = mesh.normals_domain == "CORNER"
    else:
        split = mesh.use_auto_smooth
    if not split:
        smooth = _read_smooth(mesh)
        if not smooth.any():
            return {"smooth": smooth}
        return {"smooth": smooth, "vertex_normals": read(mesh.vertex_normals, "vector", np.float32, 3)}
    if hasattr(mesh, "calc_normals_split"):
        mesh.calc_normals_split()
        normals = np.empty((len(mesh.loops), 3), np.float32)
        mesh.loops.foreach_get("normal", normals.ravel())
        mesh.free_normals_split()
    else:
        normals = read(mesh.corner_normals, "vector", np.float32, 3)
    return {"corner_normals": normals}


def _read_uvs(mesh: Any) -> tuple[dict[str, NDArray[Any]], str]:
    uvs, active = {}, ""
    for layer in mesh.uv_layers:
        new = hasattr(layer, "uv")
        data = layer.uv if new else layer.data
        if len(data) != len(mesh.loops):
            continue
        uvs[layer.name] = read(data, "vector" if new else "uv", np.float32, 2)
        if layer.active_render:
            active = layer.name
    return uvs, active or next(iter(uvs), "")


def _read_attributes(mesh: Any, wanted: set[str]) -> tuple[dict[str, tuple[str, NDArray[Any]]], str]:
    result: dict[str, tuple[str, NDArray[Any]]] = {}
    colors = mesh.color_attributes
    index = getattr(colors, "render_color_index", -1)
    active = colors[index].name if 0 <= index < len(colors) else ""
    if "" in wanted and active:
        wanted = wanted | {active}
    for name in sorted(wanted):
        attribute = mesh.attributes.get(name) if name else None
        if attribute is None or attribute.domain not in DOMAINS or not len(attribute.data):
            continue
        if attribute.data_type == "BYTE_COLOR":
            result[name] = (DOMAINS[attribute.domain], _read_byte_colors(attribute.data))
        elif attribute.data_type in ATTRIBUTES:
            field, dtype, width = ATTRIBUTES[attribute.data_type]
            values = read(attribute.data, field, dtype, width)
            result[name] = (DOMAINS[attribute.domain], np.asarray(values, np.float32))
    if GENERATED in wanted and GENERATED not in result:
        result[GENERATED] = ("vertex", _read_generated(mesh))
    return result, active


def _read_generated(mesh: Any) -> NDArray[np.float32]:
    """Places in the undeformed mesh's texture space, 0 to 1."""
    points = np.empty((len(mesh.vertices), 3), np.float32)
    mesh.vertices.foreach_get("undeformed_co", points.ravel())
    middle, half = np.array(mesh.texspace_location[:], np.float32), np.array(mesh.texspace_size[:], np.float32)
    return (points - middle) * (np.float32(0.5) / np.where(half == 0, np.float32(1), half)) + np.float32(0.5)


def _read_byte_colors(data: Any) -> NDArray[np.float32]:
    codes = raw_view(data, np.uint8, 4)
    middle = len(data) // 2
    if codes is not None and np.allclose(codes[middle] / 255.0, data[middle].color_srgb, atol=1e-3):
        colors = SRGB_TO_LINEAR[codes]
        colors[:, 3] = codes[:, 3] / np.float32(255)
        return colors
    colors = np.empty((len(data), 4), np.float32)
    data.foreach_get("color", colors.ravel())
    return colors
