# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes made by arithmetic: quads, boxes, spheres, lathes, a bunny-like creature, a statue.

Every function returns a `Mesh` whose triangles look outwards (counter-clockwise seen from outside).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .description import Matrix, Mesh


def quad(a: Any, b: Any, c: Any, d: Any, tiles: tuple[float, float] = (1.0, 1.0)) -> Mesh:
    """Two triangles over four corners in order; uv runs from a (0, 0) to c (tiles)."""
    uv = np.array([(0, 0), (tiles[0], 0), tiles, (0, tiles[1])], np.float32)
    triangles = np.array([(0, 1, 2), (0, 2, 3)])
    return Mesh(np.array([a, b, c, d]), triangles, uvs=uv[triangles.ravel()])


def box(low: Any = (-0.5, -0.5, -0.5), high: Any = (0.5, 0.5, 0.5), inward: bool = False) -> Mesh:
    """Twelve triangles; uv covers each side once."""
    x0, y0, z0 = low
    x1, y1, z1 = high
    sides = [
        quad((x0, y1, z0), (x1, y1, z0), (x1, y0, z0), (x0, y0, z0)),
        quad((x0, y0, z1), (x1, y0, z1), (x1, y1, z1), (x0, y1, z1)),
        quad((x0, y0, z0), (x1, y0, z0), (x1, y0, z1), (x0, y0, z1)),
        quad((x1, y1, z0), (x0, y1, z0), (x0, y1, z1), (x1, y1, z1)),
        quad((x0, y1, z0), (x0, y0, z0), (x0, y0, z1), (x0, y1, z1)),
        quad((x1, y0, z0), (x1, y1, z0), (x1, y1, z1), (x1, y0, z1)),
    ]
    result = join(*sides)
    return flipped(result) if inward else result


def join(*meshes: Mesh, slots: list[int] | None = None) -> Mesh:
    """One mesh of several; `slots` gives the material slot of each part."""
    offsets = np.cumsum([0] + [len(m.positions) for m in meshes])
    uvs = None
    if all(m.uvs is not None for m in meshes):
        uvs = np.concatenate([m.uvs for m in meshes if m.uvs is not None])
    per_face = None
    if slots is not None:
        per_face = np.concatenate([np.full(len(m.triangles), s, np.int32) for m, s in zip(meshes, slots)])
    return Mesh(
        np.concatenate([m.positions for m in meshes]),
        np.concatenate([m.triangles + o for m, o in zip(meshes, offsets)]),
        smooth=all(m.smooth for m in meshes),
        uvs=uvs,
        slots=per_face,
    )


def transformed(mesh: Mesh, matrix: Matrix) -> Mesh:
    positions = mesh.positions @ matrix[:3, :3].T + matrix[:3, 3]
    result = Mesh(positions.astype(np.float32), mesh.triangles, mesh.smooth, mesh.uvs, mesh.slots, mesh.colors)
    return flipped(result) if np.linalg.det(matrix[:3, :3]) < 0 else result


def flipped(mesh: Mesh) -> Mesh:
    """The same surface looking the other way."""
    uvs = None if mesh.uvs is None else mesh.uvs.reshape(-1, 3, 2)[:, ::-1].reshape(-1, 2)
    return Mesh(mesh.positions, mesh.triangles[:, ::-1], mesh.smooth, uvs, mesh.slots, mesh.colors)


def grid(width: float, depth: float, columns: int, rows: int, height: Any = None) -> Mesh:
    """A sheet in x, y around the origin, looking up; height(x, y) lifts it."""
    x, y = np.meshgrid(np.linspace(-width / 2, width / 2, columns + 1), np.linspace(-depth / 2, depth / 2, rows + 1))
    z = np.zeros_like(x) if height is None else height(x, y)
    uv = np.stack([x / width + 0.5, y / depth + 0.5], -1).reshape(-1, 2).astype(np.float32)
    triangles = _grid_triangles(columns, rows, False)
    return Mesh(np.stack([x, y, z], -1), triangles, height is not None, uv[triangles.ravel()])


def lathe(profile: Any, segments: int = 32, smooth: bool = True) -> Mesh:
    """Turns a line of (radius, z) points about the z axis; the line runs from bottom to top."""
    points = np.asarray(profile, np.float64)
    angle = np.linspace(0, 2 * math.pi, segments + 1)[:-1]
    x, y = points[:, :1] * np.cos(angle), points[:, :1] * np.sin(angle)
    z = np.repeat(points[:, 1:], segments, 1)
    return _welded(np.stack([x, y, z], -1).reshape(-1, 3), _grid_triangles(segments, len(points) - 1, True), smooth)


def cylinder(radius: float = 0.5, height: float = 1.0, segments: int = 32, rings: int = 1, caps: bool = True) -> Mesh:
    """Upright, standing on z = 0. Without caps the side is smooth."""
    z = np.linspace(0.0, height, rings + 1)
    if not caps:
        return lathe([(radius, v) for v in z], segments)
    profile = [(0.0, 0.0), (radius, 0.0), *[(radius, v) for v in z], (radius, height), (0.0, height)]
    return lathe(profile, segments, smooth=False)


def sphere(radius: float = 1.0, segments: int = 32, rings: int = 16) -> Mesh:
    angle = np.linspace(-math.pi / 2, math.pi / 2, rings + 1)
    r = radius * np.cos(angle)
    r[[0, -1]] = 0.0
    return lathe(np.stack([r, radius * np.sin(angle)], -1), segments)


def cube_sphere(divisions: int) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Unit directions (V, 3) and triangles of a cube's grid blown up to a sphere: 12 · divisions² triangles, no poles."""
    steps = np.tan(np.linspace(-math.pi / 4, math.pi / 4, divisions + 1))
    u, v = np.meshgrid(steps, steps)
    one = np.ones_like(u)
    sides = [(u, v, one), (-u, v, -one), (one, u, v), (-one, -u, v), (v, one, u), (-v, -one, u)]
    points = np.concatenate([np.stack(side, -1).reshape(-1, 3) for side in sides])
    faces = _grid_triangles(divisions, divisions, False)
    triangles = np.concatenate([faces + i * (divisions + 1) ** 2 for i in range(6)])
    for i in range(6):  # every side looks outwards, whatever the handedness of its two axes
        part = triangles[i * len(faces) : (i + 1) * len(faces)]
        a, b, c = points[part[0]]
        if np.dot(np.cross(b - a, c - a), a) < 0:
            part[:] = part[:, ::-1]
    mesh = _welded(points, triangles, smooth=True)
    exact = mesh.positions.astype(np.float64)
    return exact / np.linalg.norm(exact, axis=1, keepdims=True), mesh.triangles


def bunny(divisions: int = 76) -> Mesh:
    """A creature with a body, a head, two ears and a tail, 12 · divisions² triangles (76: 69,312), one unit high, on z = 0.

    A sphere whose radius has a bump for each part: what counts for a benchmark is that it is fine, curved and hides itself.
    """
    directions, triangles = cube_sphere(divisions)

    def bump(axis: Any, sharpness: float) -> NDArray[np.float64]:
        axis = np.asarray(axis, np.float64) / np.linalg.norm(axis)
        return np.exp(sharpness * (directions @ axis - 1.0))

    radius = 0.5 + 0.32 * bump((0.75, 0, 0.62), 9) + 0.55 * bump((0.38, 0.26, 0.95), 60) + 0.55 * bump((0.38, -0.26, 0.95), 60)
    radius += 0.14 * bump((-1, 0, -0.1), 40) + 0.12 * bump((0.5, 0.45, -0.8), 30) + 0.12 * bump((0.5, -0.45, -0.8), 30)
    wave = np.sin(23 * directions[:, 0] + 5 * directions[:, 2]) * np.sin(19 * directions[:, 1]) * np.sin(21 * directions[:, 2])
    points = directions * (radius * (1 + 0.012 * wave))[:, None] * (1.0, 0.8, 1.0)
    points[:, 2] -= points[:, 2].min()
    return Mesh(points / points[:, 2].max(), triangles, smooth=True)


def statue(segments: int = 136, rings: int = 220) -> Mesh:
    """A twisted, fluted figure on a plinth, about one unit high, 2 · segments · (rings − 1) triangles (59,568)."""
    t = np.linspace(0, 1, rings + 1)
    outline = 0.13 + 0.05 * np.cos(7.5 * t) + 0.04 * np.sin(17 * t) * t - 0.09 * t**6
    outline = np.where(t < 0.08, 0.26, np.where(t < 0.12, 0.22, outline))
    outline[[0, -1]] = 0.0
    angle = np.linspace(0, 2 * math.pi, segments + 1)[:-1]
    flutes = 1 + 0.08 * np.sin(6 * angle[None] + 9 * t[:, None]) * np.clip((t[:, None] - 0.12) * 6, 0, 1)
    x = outline[:, None] * flutes * np.cos(angle) + 0.05 * np.sin(6 * t[:, None]) * np.clip((t[:, None] - 0.12) * 3, 0, 1)
    y = outline[:, None] * flutes * np.sin(angle)
    points = np.stack([x, y, np.repeat(t[:, None], segments, 1)], -1).reshape(-1, 3)
    return _welded(points, _grid_triangles(segments, rings, True), smooth=True)


def _grid_triangles(columns: int, rows: int, closed: bool) -> NDArray[np.int32]:
    """Two triangles a cell of a grid of vertices in rows; closed: the last column joins the first."""
    stride = columns if closed else columns + 1
    column, row = np.meshgrid(np.arange(columns), np.arange(rows))
    right = (column + 1) % stride
    a, b = row * stride + column, row * stride + right
    c, d = (row + 1) * stride + right, (row + 1) * stride + column
    lower, upper = np.stack([a, b, c], -1), np.stack([a, c, d], -1)
    return np.stack([lower, upper], 2).reshape(-1, 3).astype(np.int32)


def _welded(points: NDArray[np.float64], triangles: NDArray[np.int32], smooth: bool) -> Mesh:
    """Joins vertices that stand in one place (poles, seams) and drops the triangles that have no area then."""
    size = np.ptp(points, axis=0).max()
    keys, index = np.unique(np.round(points / size * 1e6).astype(np.int64), axis=0, return_inverse=True)
    merged = np.zeros((len(keys), 3))
    merged[index.ravel()] = points
    triangles = index.ravel()[triangles]
    corners = merged[triangles]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    return Mesh(merged, triangles[area > 1e-12 * size * size], smooth)
