# SPDX-License-Identifier: GPL-3.0-or-later
"""Tangents for normal maps as the maps were baked with: MikkTSpace (Mikkelsen 2008, "Simulation of Wrinkled Surfaces
Revisited"), on the triangles that are rendered, as Cycles takes it.

Each triangle has one direction of growing u. At a corner the directions of all triangles that share vertex, normal, UV and
handedness there are averaged, each laid into the normal's plane and weighed by its angle at the corner.
"""
from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]


def unit(v: Floats) -> Floats:
    length = np.linalg.norm(v, axis=-1, keepdims=True)
    return np.divide(v, length, out=np.zeros_like(v), where=length > 0)


def corner_normals(mesh: dict[str, Any]) -> Floats:
    """(T, 3, 3): the normal at each corner of each triangle, of the face where it is flat. mesh: as `Scene.add_mesh` takes it."""
    points, triangles = mesh["positions"], mesh["triangles"]
    if mesh.get("corner_normals") is not None:
        return mesh["corner_normals"][mesh["corners"]]
    a, b, c = (points[triangles[:, k]] for k in range(3))
    flat = np.repeat(unit(np.cross(b - a, c - a))[:, None], 3, axis=1)
    if mesh.get("vertex_normals") is None:
        return flat
    smooth, faces = mesh.get("smooth"), mesh.get("faces")
    result = mesh["vertex_normals"][triangles]
    if smooth is not None:
        hard = ~smooth if faces is None else ~smooth[faces]
        result = np.where(hard[:, None, None], flat, result)
    return result


def tangents(mesh: dict[str, Any], uv_map: str) -> Floats | None:
    """(C, 4) by corner: the tangent in object space and the sign of the bitangent; None: there is no such map."""
    uvs = mesh["uvs"].get(uv_map or mesh["active_uv"])
    if uvs is None or not len(uvs):
        return None
    corners, triangles = mesh["corners"], mesh["triangles"]
    points, uv = mesh["positions"][triangles], uvs[corners]
    normals = corner_normals(mesh).astype(np.float32)
    edge1, edge2 = points[:, 1] - points[:, 0], points[:, 2] - points[:, 0]
    d1, d2 = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    area = d1[:, 0] * d2[:, 1] - d1[:, 1] * d2[:, 0]
    right = area > 0
    along = unit((edge1 * d2[:, 1:2] - edge2 * d1[:, 1:2]) * np.where(right, 1, -1)[:, None].astype(np.float32))
    along[area == 0] = 0
    laid = unit(along[:, None] - normals * (along[:, None] * normals).sum(-1, keepdims=True))
    sums = _averaged(laid * _angles(points, normals)[..., None], triangles, normals, uv, right)
    result = np.zeros((len(uvs), 4), np.float32)
    result[corners.ravel(), :3] = unit(sums)
    result[corners.ravel(), 3] = np.repeat(np.where(right, 1, -1), 3)
    return result


def _angles(points: Floats, normals: Floats) -> Floats:
    """(T, 3): the angle at each corner, between its edges as seen along its normal."""
    angles = np.empty(points.shape[:2], np.float32)
    for k in range(3):
        n = normals[:, k]
        before, after = points[:, k - 1] - points[:, k], points[:, (k + 1) % 3] - points[:, k]
        before, after = (unit(v - n * (v * n).sum(-1, keepdims=True)) for v in (before, after))
        angles[:, k] = np.arccos(np.clip((before * after).sum(-1), -1, 1))
    return angles


def _averaged(values: Floats, triangles: NDArray[Any], normals: Floats, uv: Floats, right: NDArray[np.bool_]) -> Floats:
    """(3T, 3): at each corner the sum over all corners that are the same point of the surface."""
    words = np.concatenate([triangles.reshape(-1, 1).astype(np.uint32),
                            np.ascontiguousarray(normals.reshape(-1, 3)).view(np.uint32),
                            np.ascontiguousarray(uv.reshape(-1, 2)).view(np.uint32),
                            np.repeat(right, 3).astype(np.uint32)[:, None]], axis=1)
    key = np.zeros(len(words), np.uint64)
    for column in words.T:  # 64 bits tell them apart
        key = (key ^ column) * np.uint64(0x9E3779B97F4A7C15)
        key ^= key >> np.uint64(29)
    _, group = np.unique(key, return_inverse=True)
    sums = np.stack([np.bincount(group, values.reshape(-1, 3)[:, axis]) for axis in range(3)], axis=-1)
    return sums[group].astype(np.float32)
