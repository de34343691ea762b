# SPDX-License-Identifier: GPL-3.0-or-later
"""Point clouds: every point is an instance of one small sphere, a subdivided icosahedron with smooth normals."""
from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

SUBDIVISIONS = 3  # 1280 triangles
DEFAULT_RADIUS = 0.01


def point_transforms(cloud: Any) -> NDArray[np.float64]:
    """(N, 4, 4): a unit sphere to each point's place and radius, in the object's space."""
    positions = cloud.attributes.get("position")
    count = len(positions.data) if positions is not None else 0
    points, radii = np.empty((count, 3), np.float32), np.full(count, DEFAULT_RADIUS, np.float32)
    if count:
        positions.data.foreach_get("vector", points.ravel())
        sizes = cloud.attributes.get("radius")
        if sizes is not None and sizes.data_type == "FLOAT":
            sizes.data.foreach_get("value", radii)
    result = np.zeros((count, 4, 4))
    result[:, (0, 1, 2), (0, 1, 2)] = radii[:, None]
    result[:, :3, 3], result[:, 3, 3] = points, 1.0
    return result[radii > 0]


@cache
def _sphere() -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    golden = (1 + 5**0.5) / 2
    points = [(-1, golden, 0), (1, golden, 0), (-1, -golden, 0), (1, -golden, 0), (0, -1, golden), (0, 1, golden),
              (0, -1, -golden), (0, 1, -golden), (golden, 0, -1), (golden, 0, 1), (-golden, 0, -1), (-golden, 0, 1)]
    triangles = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2), (10, 7, 6),
                 (7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5), (2, 4, 11), (6, 2, 10),
                 (8, 6, 7), (9, 8, 1)]
    for _ in range(SUBDIVISIONS):
        middles: dict[tuple[int, int], int] = {}

        def middle(a: int, b: int, middles: dict[tuple[int, int], int] = middles) -> int:
            key = (min(a, b), max(a, b))
            if key not in middles:
                points.append(tuple((x + y) / 2 for x, y in zip(points[a], points[b], strict=True)))
                middles[key] = len(points) - 1
            return middles[key]

        triangles = [part for a, b, c in triangles for ab, bc, ca in [(middle(a, b), middle(b, c), middle(c, a))]
                     for part in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]
    vertices = np.array(points, np.float32)
    return vertices / np.linalg.norm(vertices, axis=1, keepdims=True), np.array(triangles, np.int32)


def unit_sphere() -> dict[str, Any]:
    """Arguments of `Scene.add_mesh`."""
    points, triangles = _sphere()
    return {"positions": points, "triangles": triangles, "corners": None, "faces": None, "vertex_normals": points,
            "smooth": np.ones(len(triangles), np.bool_), "uvs": {}, "active_uv": "", "attributes": {}, "active_color": ""}
