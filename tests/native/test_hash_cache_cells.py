# SPDX-License-Identifier: GPL-3.0-or-later
"""The paper's own structure: which cells are marked, against a separating-axis test of every cell; maps that find them."""

from __future__ import annotations

import afterglow
import numpy as np
import pytest
from afterglow import _native
from afterglow.scenes import Camera, Description, Mesh, look_at
from afterglow.scenes.native import Built
from afterglow.scenes.rooms import cornell_box, diffuse

SLACK = 1 / 512


def touches(triangle: np.ndarray, low: np.ndarray, grow: float) -> np.ndarray:
    """Which unit boxes with these lower corners, grown by `grow`, meet the triangle: 13 axes (Akenine-Möller 2001)."""
    center, half = low + 0.5, 0.5 + grow
    edges = np.roll(triangle, -1, axis=0) - triangle
    axes = [*np.eye(3), np.cross(edges[0], edges[1]), *(np.cross(e, a) for e in edges for a in np.eye(3))]
    meets = np.ones(len(low), bool)
    for axis in axes:
        if np.abs(axis).max() < 1e-12:
            continue
        at = triangle @ axis
        middle, reach = center @ axis, half * np.abs(axis).sum()
        meets &= (middle + reach >= at.min()) & (middle - reach <= at.max())
    return meets


def soup(triangles: np.ndarray) -> Built:
    scene = Description("soup", Camera(look_at((0, -3, 0), (0, 0, 0))))
    scene.materials["grey"] = diffuse((0.5, 0.5, 0.5))
    flat = triangles.reshape(-1, 3)
    scene.add("Soup", Mesh(flat, np.arange(len(flat)).reshape(-1, 3)), "grey")
    built = Built(scene)
    built.scene.commit()
    return built


def grid(built: Built, level: int) -> tuple[np.ndarray, float, np.ndarray]:
    """Lower corner, cell size, and the index of every cell (x, y, z)."""
    low, high = (np.asarray(v, np.float64) for v in built.scene.bounds)
    edge = float((high - low).max()) * 1.0001
    n = 1 << level
    cells = np.stack(np.meshgrid(*[np.arange(n)] * 3, indexing="ij"), -1).reshape(-1, 3)
    return (low + high) / 2 - edge / 2, edge / n, cells


@pytest.mark.parametrize("size", [0.01, 0.1, 1.0])
def test_marked_cells_are_those_that_triangles_touch(size: float) -> None:
    rng = np.random.default_rng(int(size * 100))
    triangles = rng.uniform(-1, 1, (24, 1, 3)) + size * rng.normal(size=(24, 3, 3))
    triangles[0] = triangles[0][:1]  # a point
    triangles[1, 2] = (triangles[1, 0] + triangles[1, 1]) / 2  # a line
    triangles[2, :, 2] = 0.25  # across an axis
    built = soup(triangles)
    level = 4
    corner, cell, cells = grid(built, level)
    found = _native.occupied_cells(built.scene, level, corner + (cells + 0.5) * cell)
    marked = found["index"][level] >= 0
    least, most = np.zeros(len(cells), bool), np.zeros(len(cells), bool)
    for t in triangles.astype(np.float32).astype(np.float64):
        if np.abs(np.cross(t[1] - t[0], t[2] - t[0])).max() == 0:
            continue  # the scene leaves out what has no area
        least |= touches((t - corner) / cell, cells.astype(float), -1e-4)
        most |= touches((t - corner) / cell, cells.astype(float), 2 * SLACK)
    assert least.sum() > 20 and not (least & ~marked).any() and marked.sum() == found["cells"][level]
    degenerate = 64  # cells that the point and the line may add
    assert (marked & ~most).sum() <= degenerate


def test_coarser_levels_are_the_finer_ones_halved() -> None:
    built = Built(cornell_box())
    built.scene.commit()
    levels = 5
    corner, cell, cells = grid(built, levels)
    found = _native.occupied_cells(built.scene, levels, corner + (cells + 0.5) * cell)
    occupied = (found["index"] >= 0).reshape(levels + 1, *[1 << levels] * 3)
    for level in range(levels + 1):
        n = 1 << levels - level
        m = 1 << level
        derived = occupied[levels].reshape(m, n, m, n, m, n).any((1, 3, 5))
        assert np.array_equal(derived.repeat(n, 0).repeat(n, 1).repeat(n, 2), occupied[level])
        index = found["index"][level]
        assert np.array_equal(np.unique(index[index >= 0]),
                              np.arange(found["cells"][level])), "data without holes, nothing shared"
    assert found["cells"][0] == 1


def test_space_is_split_among_maps_where_keys_end() -> None:
    """8192³: eight maps. Around each triangle the cells are those that the triangle–box test finds, in every map."""
    level, rng = 13, np.random.default_rng(8)
    n = 1 << level
    triangles = rng.uniform(-1, 1, (40, 1, 3)) + 0.002 * rng.normal(size=(40, 3, 3))
    triangles[:, :, 2] += np.linspace(-0.9, 0.9, 40)[:, None] - triangles[:, :1, 2]
    built = soup(triangles)
    low, high = (np.asarray(v, np.float64) for v in built.scene.bounds)
    edge = float((high - low).max()) * 1.0001
    corner, cell = (low + high) / 2 - edge / 2, edge / n
    asked = []
    for t in triangles.astype(np.float32).astype(np.float64):
        inside = (t - corner) / cell
        first, last = np.floor(inside.min(0)).astype(int) - 2, np.floor(inside.max(0)).astype(int) + 2
        cells = np.stack(np.meshgrid(*[np.arange(a, b + 1) for a, b in zip(first, last, strict=True)], indexing="ij"), -1)
        cells = cells.reshape(-1, 3)
        asked.append((inside, cells[((cells >= 0) & (cells < n)).all(1)]))
    every = np.concatenate([cells for _, cells in asked])
    found = _native.occupied_cells(built.scene, level, corner + (every + 0.5) * cell)
    marked, at = found["index"][level] >= 0, 0
    for inside, cells in asked:
        own = marked[at:at + len(cells)]
        at += len(cells)
        least, most = (touches(inside, cells.astype(float), grown) for grown in (-0.01, 0.02))
        assert least.sum() > 3 and not (least & ~own).any() and not (own & ~most).any()
    assert found["maps"] == [1] * 13 + [8] and set((every[marked, 2] // 1024).tolist()) == set(range(8))
    assert len(np.unique(found["index"][level][marked])) == found["cells"][level], "nothing else is marked"


def test_every_surface_that_a_ray_meets_lies_in_a_marked_cell() -> None:
    built = Built(cornell_box("glossy"))
    built.scene.commit()
    rng = np.random.default_rng(1)
    origins = np.broadcast_to(np.array([0.0, 0.0, 1.0]), (4000, 3))
    directions = rng.normal(size=(4000, 3))
    hit = built.scene.intersect(origins, directions)
    met = np.isfinite(hit["distance"])
    unit = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    points = (origins + unit * hit["distance"][:, None])[met]
    one = _native.occupied_cells(built.scene, 9, points, threads=1)
    two = _native.occupied_cells(built.scene, 9, points, threads=2)
    assert len(points) > 1000 and (one["index"] >= 0).all()
    assert np.array_equal(one["index"], two["index"])


def test_nothing_and_wrong_input() -> None:
    scene = afterglow.Scene()
    scene.commit()
    assert _native.occupied_cells(scene, 3, np.zeros((0, 3)))["cells"] == [0, 0, 0, 0]
    with pytest.raises(afterglow.InvalidInput):
        _native.occupied_cells(scene, 15, np.zeros((0, 3)))


@pytest.mark.parametrize("usage", [0.25, 0.9, 1.1])
def test_a_map_that_is_too_small_grows_until_all_fit(usage: float) -> None:
    """Insertions fail first: each failure takes other hash functions and one per cent more slots. None is lost or mistaken."""
    rng = np.random.default_rng(5)
    keys = rng.choice(2**30, 5000, replace=False).astype(np.uint32)
    others = np.setdiff1d(rng.choice(2**30, 5000).astype(np.uint32), keys)
    found = _native.cuckoo_map(keys, usage, np.concatenate([keys, others]))
    assert found["found"] == list(range(len(keys))) + [-1] * len(others)
    assert found["attempts"] > 1 if usage < 1 else found["attempts"] == 1
    slots = found["bytes"] / 12
    assert len(keys) < slots < 1.12 * len(keys)


def test_maps_of_few_and_of_neighbouring_keys() -> None:
    for keys in ([], [0], list(range(17)), [2**32 - 2 - i for i in range(100)], list(range(0, 2**20, 2**12))):
        assert _native.cuckoo_map(keys, 1.1, [*keys, 2**31])["found"] == [*range(len(keys)), -1]


def test_look_ups_are_measured() -> None:
    speeds = _native.measure_lookups(20_000, 50_000)
    assert min(speeds[name] for name in ("table", "map", "reads")) > 1e4
    assert speeds["table_bytes"] >= 20_000 * 20 and speeds["map_bytes"] > 20_000 * 16 - 200
    with pytest.raises(afterglow.InvalidInput, match="cells"):
        _native.measure_lookups(0, 10)
