# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene's tables: handles, change log, checks and repairs, the origin. Random series of edits are held against a
simple model."""

from __future__ import annotations

import random
from typing import Any

import numpy as np
import pytest

GREY = {"nodes": [{"type": "diffuse_bsdf", "name": "d", "params": {}, "inputs": {"color": (0.5, 0.5, 0.5)}}],
        "surface": ("link", 0, "shader")}
ROUNDING = 2.0**-22  # Embree divides by an approximation that processors round each in its own way
SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32)
TWO = np.array([[0, 1, 2], [0, 2, 3]], np.int32)


@pytest.fixture(scope="module")
def ag(library):
    import afterglow

    return afterglow


def square(scene: Any, name: str = "square", **more: Any) -> int:
    return scene.add_mesh(name=name, **({"positions": SQUARE, "triangles": TWO} | more))


def at(x: float = 0.0, y: float = 0.0, z: float = 0.0, scale: Any = 1.0) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, :3] = np.asarray(scale) if np.ndim(scale) == 2 else matrix[:3, :3] * scale
    matrix[:3, 3] = x, y, z
    return matrix


def down(scene: Any, x: float, y: float, height: float = 10.0) -> dict[str, np.ndarray]:
    return scene.intersect(np.array([[x, y, height]]), np.array([[0.0, 0.0, -1.0]]))


# -- arrays ------------------------------------------------------------------------------------------------------------

def test_strided_and_other_typed_arrays_are_the_same_mesh(ag) -> None:
    wide = np.zeros((4, 8), np.float32)
    wide[:, 1:7:2] = SQUARE
    variants = [
        {"positions": wide[:, 1:7:2]},
        {"positions": SQUARE.astype(np.float64)},
        {"positions": np.asfortranarray(SQUARE)},
        {"positions": SQUARE.tolist()},
        {"triangles": TWO.astype(np.uint32)},
        {"triangles": TWO.astype(np.int64)},
        {"triangles": TWO.astype(np.uint8)},
        {"triangles": np.repeat(TWO, 2, axis=0)[::2]},
        {"corners": np.arange(6, dtype=np.int32).reshape(2, 3), "uvs": {"map": np.zeros((6, 2), np.float32)}},
    ]
    for variant in variants:
        scene = ag.Scene()
        scene.add_instances(square(scene, **variant), at(), name="o")
        assert scene.commit()["warnings"] == []
        hit = down(scene, 0.25, 0.5)
        assert hit["triangle"][0] == 1 and abs(hit["distance"][0] - 10.0) <= 10.0 * ROUNDING


@pytest.mark.parametrize("side", [1, 400])  # 400: long enough for several threads
def test_triangles_may_be_given_by_corners(ag, side: int) -> None:
    """Quads as Blender has them: corners in order of faces, two triangles a face."""
    y, x = np.mgrid[0 : side + 1, 0 : side + 1].astype(np.float32)
    points = np.stack([x.ravel(), y.ravel(), np.zeros(x.size, np.float32)], -1)
    first = (np.arange(side)[:, None] * (side + 1) + np.arange(side)).ravel()
    vertices = np.stack([first, first + 1, first + side + 2, first + side + 1], -1).ravel().astype(np.int32)
    corners = (4 * np.arange(side * side)[:, None] + np.array([0, 1, 2, 0, 2, 3])).reshape(-1, 3).astype(np.int32)
    wide = np.zeros((len(vertices), 2), np.int32)
    wide[:, 0] = vertices
    scene, expected = ag.Scene(), ag.Scene()
    expected.add_instances(expected.add_mesh(name="m", positions=points, triangles=vertices[corners]), at(), name="o")
    for given in (vertices, wide[:, 0]):
        mesh = scene.add_mesh(name="m", positions=points, corners=corners, corner_vertices=given)
        scene.add_instances(mesh, at(z=-2.0 if given is vertices else 0.0), name="o")
    assert scene.commit()["warnings"] == [] == expected.commit()["warnings"]
    for ax, ay in np.random.default_rng(1).random((50, 2)) * side:
        found, wanted = down(scene, ax, ay), down(expected, ax, ay)
        assert all(found[key][0] == wanted[key][0] for key in ("triangle", "distance"))


def test_corners_without_a_vertex_take_their_triangles_along(ag) -> None:
    scene = ag.Scene()
    corners = np.array([[0, 1, 2], [0, 2, 7]], np.int32)
    mesh = scene.add_mesh(name="broken", positions=SQUARE, corners=corners, corner_vertices=np.arange(4, dtype=np.int32))
    scene.add_instances(mesh, at(), name="o")
    warnings = scene.commit()["warnings"]
    assert len(warnings) == 1 and "mesh 'broken'" in warnings[0]
    assert down(scene, 0.75, 0.25)["triangle"][0] == 0
    with pytest.raises(ag.Error, match="corner_vertices"):
        scene.add_mesh(name="bad", positions=SQUARE, corners=corners)


@pytest.mark.parametrize(("arguments", "words"), [
    ({"positions": SQUARE[:, :2]}, ["mesh 'bad'", "positions", "(4, 2)"]),
    ({"positions": None}, ["mesh 'bad'", "positions"]),
    ({"positions": np.array([["a", "b", "c"]])}, ["mesh 'bad'", "positions"]),
    ({"triangles": TWO.astype(np.float32)}, ["mesh 'bad'", "triangles", "integers"]),
    ({"triangles": TWO.ravel()}, ["mesh 'bad'", "triangles"]),
    ({"corner_normals": np.zeros((5, 3), np.float32)}, ["mesh 'bad'", "corner_normals", "5", "6"]),
    ({"vertex_normals": np.zeros((5, 3), np.float32)}, ["mesh 'bad'", "vertex_normals", "5", "4"]),
    ({"smooth": np.zeros(3, bool)}, ["mesh 'bad'", "smooth", "3", "2"]),
    ({"materials": np.zeros(3, np.int32)}, ["mesh 'bad'", "materials", "3", "2"]),
    ({"faces": np.zeros(3, np.int32)}, ["mesh 'bad'", "faces", "3", "2"]),
    ({"uvs": {"map": np.zeros((4, 2), np.float32)}}, ["mesh 'bad'", "UV map 'map'", "4", "6"]),
    ({"uvs": {"map": np.zeros((6, 3), np.float32)}}, ["mesh 'bad'", "UV map 'map'", "(6, 3)"]),
    ({"attributes": {"a": ("edge", np.zeros(4))}}, ["mesh 'bad'", "attribute 'a'", "edge"]),
    ({"attributes": {"a": ("vertex", np.zeros((3, 3)))}}, ["mesh 'bad'", "attribute 'a'", "3", "4"]),
    ({"attributes": {"a": np.zeros(4)}}, ["mesh 'bad'", "attribute 'a'"]),
    ({"previous_positions": SQUARE[:3]}, ["mesh 'bad'", "previous_positions", "3", "4"]),
    ({"colour": 1}, ["colour"]),
])
def test_wrong_arrays_are_refused_by_name(ag, arguments: dict[str, Any], words: list[str]) -> None:
    scene = ag.Scene()
    with pytest.raises(ag.InvalidInput) as caught:
        square(scene, "bad", **arguments)
    for word in words:
        assert word in str(caught.value)


def test_instances_and_lights_refuse_wrong_arguments(ag) -> None:
    scene = ag.Scene()
    mesh = square(scene)
    for call in (
        lambda: scene.add_instances(mesh, np.eye(3), name="o"),
        lambda: scene.add_instances(mesh, at(), name="o", randoms=np.zeros(2)),
        lambda: scene.add_instances(mesh, at(), name="o", colour=(1, 1, 1, 1)),
        lambda: scene.add_light("lamp", at(), name="l", color=(1, 1, 1), power=1.0),
        lambda: scene.add_light("point", at(), name="l", color=(1, 1, 1), power=float("nan")),
        lambda: scene.add_light("point", at() * np.nan, name="l", color=(1, 1, 1), power=1.0),
        lambda: scene.set_camera("fisheye", at(), window=(-1, 1, -1, 1)),
        lambda: scene.set_camera("perspective", at(), window=(-1, 1, 1, 1)),
        lambda: scene.set_camera("perspective", at(), window=(-1, 1, -1, 1), clip=(2.0, 1.0)),
        lambda: scene.add_material({"nodes": [{"name": "no type"}]}, name="m"),
        lambda: scene.add_material({"nodes": [], "surface": ("link", 3, "shader")}, name="m"),
        lambda: scene.add_material([], name="m"),
        lambda: scene.add_image(5, name="i"),
        lambda: scene.add_image(np.zeros((2, 2, 5), np.float32), name="i"),
        lambda: scene.intersect(np.zeros((2, 3)), np.zeros((3, 3))),
    ):
        with pytest.raises(ag.InvalidInput):
            call()


def test_unknown_handles(ag) -> None:
    scene = ag.Scene()
    mesh = square(scene)
    for call in (
        lambda: scene.add_instances(mesh + 1, at(), name="o"),
        lambda: scene.remove_mesh(0),
        lambda: scene.remove_material(1),
        lambda: scene.set_light(1, power=1.0),
        lambda: scene.remove_image(7),
        lambda: scene.set_transforms(np.array([1], np.uint32), at()[None]),
        lambda: scene.set_instances(np.array([1], np.uint32), name="x"),
    ):
        with pytest.raises(ag.InvalidHandle) as caught:
            call()
        assert isinstance(caught.value, KeyError) and isinstance(caught.value, ag.Error)


# -- repairs -----------------------------------------------------------------------------------------------------------

@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_a_non_finite_vertex_takes_its_triangles_along(ag, value: float) -> None:
    scene = ag.Scene()
    positions = SQUARE.copy()
    positions[3, 1] = value
    scene.add_instances(square(scene, "broken", positions=positions), at(), name="o")
    warnings = scene.commit()["warnings"]
    assert len(warnings) == 1 and "mesh 'broken'" in warnings[0] and "positions" in warnings[0] and "index 3" in warnings[0]
    assert down(scene, 0.75, 0.25)["triangle"][0] == 0
    assert down(scene, 0.25, 0.75)["instance"][0] == 0
    assert np.isfinite(scene.bounds).all()
    assert scene.commit()["warnings"] == []  # said once


@pytest.mark.parametrize("index", [4, -1, 2**31 - 1, 2**40])
def test_an_index_out_of_range_takes_its_triangle_along(ag, index: int) -> None:
    scene = ag.Scene()
    triangles = TWO.astype(np.int64)
    triangles[1, 2] = index
    scene.add_instances(square(scene, "broken", triangles=triangles), at(), name="o")
    warnings = scene.commit()["warnings"]
    assert len(warnings) == 1 and "mesh 'broken'" in warnings[0] and "triangles" in warnings[0]
    assert down(scene, 0.75, 0.25)["triangle"][0] == 0
    assert down(scene, 0.25, 0.75)["instance"][0] == 0


def test_a_vertex_that_becomes_finite_again_brings_its_triangle_back(ag) -> None:
    scene = ag.Scene()
    broken = SQUARE.copy()
    broken[3] = np.nan
    mesh = square(scene, positions=broken)
    scene.add_instances(mesh, at(), name="o")
    scene.commit()
    scene.set_mesh(mesh, positions=SQUARE)
    assert scene.commit()["warnings"] == []
    assert down(scene, 0.25, 0.75)["triangle"][0] == 1
    scene.set_mesh(mesh, positions=broken)
    assert len(scene.commit()["warnings"]) == 1
    assert down(scene, 0.25, 0.75)["instance"][0] == 0
    assert down(scene, 0.75, 0.25)["triangle"][0] == 0


def test_non_finite_normals_uvs_and_corners_are_mended(ag) -> None:
    scene = ag.Scene()
    normals = np.tile(np.array([0, 0, 1], np.float32), (6, 1))
    normals[0, 0] = np.nan
    uvs = np.zeros((6, 2), np.float32)
    uvs[2, 1] = np.inf
    corners = np.arange(6, dtype=np.int32).reshape(2, 3)
    corners[1, 1] = 99
    scene.add_instances(square(scene, "m", corner_normals=normals, uvs={"map": uvs}, corners=corners), at(), name="o")
    text = " ".join(scene.commit()["warnings"])
    for word in ("corner_normals", "UV map 'map'", "corners"):
        assert word in text
    found = scene.surface(np.array([[0.5, 0.4, 1.0]]), np.array([[0.0, 0.0, -1.0]]))
    assert np.isfinite(found["normal"]).all() and np.isfinite(found["uv"]).all()


@pytest.mark.parametrize(("matrix", "left_out"), [
    (at(scale=0.0), True),
    (at(scale=[1, 1, 0]), True),
    (at(scale=np.nan), True),
    (at(x=np.inf), True),
    (at(scale=[[1, 1, 0], [1, 1, 0], [0, 0, 1]]), True),
    (at(scale=-1.0), False),
    (at(scale=[1, 1, 1e-6]), False),
    (at(scale=1e-4), False),
    (at(scale=1e6), False),
])
def test_transforms_that_cannot_be_used(ag, matrix: np.ndarray, left_out: bool) -> None:
    scene = ag.Scene()
    handles = scene.add_instances(square(scene), np.stack([at(x=50.0, z=5.0), matrix]), name="thing")
    warnings = scene.commit()["warnings"]
    assert len(warnings) == left_out
    assert not left_out or "object 'thing'" in warnings[0]
    assert down(scene, 50.5, 0.5)["instance"][0] == handles[0]
    if left_out:  # it comes back with a transform that can be used
        scene.set_transforms(handles[1:], at(x=-50.0)[None])
        assert scene.commit()["warnings"] == []
        assert down(scene, -49.5, 0.5)["instance"][0] == handles[1]


def test_empty_meshes_and_scenes(ag) -> None:
    scene = ag.Scene()
    scene.commit()
    assert down(scene, 0, 0)["instance"][0] == 0
    for arguments in ({"triangles": TWO[:0]}, {"positions": SQUARE[:0], "triangles": TWO[:0]},
                      {"positions": SQUARE[:0], "triangles": TWO}):
        scene.add_instances(square(scene, "empty", **arguments), at(), name="o")
    scene.commit()
    assert down(scene, 0.5, 0.5)["instance"][0] == 0


def test_degenerate_and_duplicate_triangles_are_harmless(ag) -> None:
    scene = ag.Scene()
    triangles = np.array([[0, 0, 0], [0, 1, 1], [0, 1, 2], [0, 1, 2], [2, 1, 0], [0, 2, 3]], np.int32)
    scene.add_instances(square(scene, triangles=triangles), at(), name="o")
    assert scene.commit()["warnings"] == []
    grid = np.stack(np.meshgrid(np.linspace(0.05, 0.95, 30), np.linspace(0.03, 0.97, 30), [1.0]), -1).reshape(-1, 3)
    hit = scene.intersect(grid, np.tile([0.0, 0.0, -1.0], (len(grid), 1)))
    assert (abs(hit["distance"] - 1.0) <= ROUNDING).all() and (hit["triangle"] >= 2).all()


def test_removed_mesh_leaves_its_instances_out(ag) -> None:
    scene = ag.Scene()
    mesh = square(scene)
    scene.add_instances(mesh, at(), name="orphan")
    scene.commit()
    scene.remove_mesh(mesh)
    assert any("orphan" in text for text in scene.commit()["warnings"])
    assert down(scene, 0.5, 0.5)["instance"][0] == 0


# -- materials ---------------------------------------------------------------------------------------------------------

def material_at(scene: Any, x: float, y: float) -> int:
    found = scene.surface(np.array([[x, y, 5.0]]), np.array([[0.0, 0.0, -1.0]]))
    assert found["valid"][0]
    return int(found["material"][0])


def test_material_slots(ag) -> None:
    scene = ag.Scene()
    a, b = (scene.add_material(GREY, name=name) for name in "ab")
    mesh = square(scene, faces=[1, 0], materials=np.array([0, 1], np.int32))
    handles = scene.add_instances(mesh, np.stack([at(), at(x=2), at(x=4), at(x=6)]), name="o", materials=[a, b])
    scene.set_instances(handles[1:2], materials=[b])
    scene.set_instances(handles[2:3], materials=[])
    scene.set_instances(handles[3:], materials=[0, b])
    scene.commit()
    assert (material_at(scene, 0.75, 0.25), material_at(scene, 0.25, 0.75)) == (b, a)  # triangle 0 is of face 1
    assert (material_at(scene, 2.75, 0.25), material_at(scene, 2.25, 0.75)) == (b, b)  # the last slot stands for more
    assert (material_at(scene, 4.75, 0.25), material_at(scene, 4.25, 0.75)) == (0, 0)  # the default grey
    assert (material_at(scene, 6.75, 0.25), material_at(scene, 6.25, 0.75)) == (b, 0)
    scene.remove_material(b)
    c = scene.add_material(GREY, name="c")
    assert c not in (a, b)
    scene.commit()
    assert (material_at(scene, 0.75, 0.25), material_at(scene, 0.25, 0.75)) == (0, a)


# -- origin ------------------------------------------------------------------------------------------------------------

def test_origin_stays_zero_near_it_and_follows_far_scenes(ag) -> None:
    scene = ag.Scene()
    handle = scene.add_instances(square(scene), at(x=3.0), name="o")
    scene.commit()
    assert scene.origin == (0.0, 0.0, 0.0)
    for distance in (1e3, 1e6, 1e9):
        scene.set_transforms(handle, at(x=distance, y=-distance)[None])
        scene.commit()
        origin = np.array(scene.origin)
        assert np.abs(origin - [distance, -distance, 0.0]).max() < 8.0
        assert (np.array(scene.origin) % 1.0 == 0.0).all()
        assert scene.changes_since(scene.version - 1)["origin"]
        hit = scene.intersect(np.array([[distance + 0.25, -distance + 0.5, 10.0]]), np.array([[0.0, 0.0, -1.0]]))
        assert hit["triangle"][0] == 1
        assert np.allclose(hit["barycentric"][0], (0.25, 0.25), atol=1e-6)  # 32-bit world coordinates would lose this
    scene.set_transforms(handle, at(x=3.0)[None])
    scene.commit()
    assert scene.origin == (0.0, 0.0, 0.0)


def test_origin_is_a_function_of_the_bounds_alone(ag) -> None:
    random = np.random.default_rng(3)
    wandering = ag.Scene()
    handle = wandering.add_instances(square(wandering), at(), name="o")
    for _ in range(20):
        matrix = at(*(10.0 ** random.uniform(0, 7) * random.normal(size=3)))
        wandering.set_transforms(handle, matrix[None])
        wandering.commit()
        fresh = ag.Scene()
        fresh.add_instances(square(fresh), matrix, name="o")
        fresh.commit()
        assert fresh.origin == wandering.origin and fresh.bounds == wandering.bounds


# -- changes -----------------------------------------------------------------------------------------------------------

def test_commit_without_edits_changes_nothing(ag) -> None:
    scene = ag.Scene()
    scene.add_instances(square(scene), at(), name="o")
    first = scene.commit()
    again = scene.commit()
    assert again["version"] == first["version"] == scene.version
    assert again["instances"] == again["meshes"] == 0 and not again["everything"]
    assert scene.changes_since(99)["everything"]


def test_log_is_bounded_and_says_so(ag) -> None:
    scene = ag.Scene()
    handle = scene.add_instances(square(scene), at(), name="o")
    scene.commit()
    for step in range(300):
        scene.set_transforms(handle, at(x=step + 1.0)[None])
        scene.commit()
    assert scene.version == 301
    assert scene.changes_since(0)["everything"]
    assert not scene.changes_since(100)["everything"] and scene.changes_since(100)["instances_moved"] == [handle[0]]


KINDS = ("meshes", "instances", "materials", "lights")


class Model:
    """What the tables should hold, and each commit's snapshot: handle → value, by kind."""

    def __init__(self) -> None:
        self.now: dict[str, dict[int, Any]] = {kind: {} for kind in KINDS}
        self.moves: dict[int, Any] = {}
        self.snapshots = [self.copy()]

    def copy(self) -> tuple[dict[str, dict[int, Any]], dict[int, Any]]:
        return {kind: dict(table) for kind, table in self.now.items()}, dict(self.moves)


def random_edit(scene: Any, model: Model, random: random.Random, stamp: int) -> None:
    """stamp: unique, so that every edit makes a value that never was before."""
    now = model.now
    kind = random.choice(KINDS)
    action = random.choice(("add", "add", "edit", "edit", "remove", "move"))
    handle = random.choice(list(now[kind])) if now[kind] else None
    if action == "add":
        if kind == "meshes":
            new = square(scene, str(stamp))
        elif kind == "materials":
            new = scene.add_material(GREY, name=str(stamp))
        elif kind == "lights":
            new = scene.add_light("point", at(), name=str(stamp), color=(1, 1, 1), power=1.0)
        else:
            if not now["meshes"]:
                return
            new = int(scene.add_instances(random.choice(list(now["meshes"])), at(), name=str(stamp))[0])
            model.moves[new] = 0
        assert all(new not in snapshot[kind] for snapshot, _ in model.snapshots), "a handle was given twice"
        now[kind][new] = stamp
    elif handle is None:
        return
    elif action == "remove":
        if kind == "meshes":
            return  # its instances would change, too; has a test of its own
        getattr(scene, {"instances": "remove_instances", "materials": "remove_material",
                        "lights": "remove_light"}[kind])(np.array([handle], np.uint32) if kind == "instances" else handle)
        del now[kind][handle]
        model.moves.pop(handle, None) if kind == "instances" else None
    elif action == "move" and kind == "instances":
        scene.set_transforms(np.array([handle], np.uint32), at(x=stamp)[None])
        model.moves[handle] = stamp
    else:
        if kind == "meshes":
            scene.set_mesh(handle, name=str(stamp), positions=SQUARE, triangles=TWO)
        elif kind == "materials":
            scene.set_material(handle, GREY, name=str(stamp))
        elif kind == "lights":
            scene.set_light(handle, power=float(stamp))
        else:
            scene.set_instances(np.array([handle], np.uint32), object_index=stamp)
        now[kind][handle] = stamp


def check_changes(scene: Any, model: Model, version: int) -> None:
    changes = scene.changes_since(version)
    assert not changes["everything"]
    then, then_moves = model.snapshots[version]
    for kind in KINDS:
        now = model.now[kind]
        edited = "meshes_replaced" if kind == "meshes" else f"{kind}_edited"
        assert changes[f"{kind}_added"] == sorted(set(now) - set(then[kind]))
        assert changes[f"{kind}_removed"] == sorted(set(then[kind]) - set(now))
        assert changes[edited] == sorted(h for h in set(now) & set(then[kind]) if now[h] != then[kind][h])
    moved = [h for h, place in model.moves.items() if h in then_moves and then_moves[h] != place]
    assert changes["instances_moved"] == sorted(moved)


@pytest.mark.parametrize("seed", range(6))
def test_random_edits_against_a_model(ag, seed: int) -> None:
    generator = random.Random(seed)
    scene, model, stamp = ag.Scene(), Model(), 0
    while len(model.snapshots) < 60:
        before = model.copy()
        for _ in range(generator.randrange(1, 8)):
            stamp += 1
            random_edit(scene, model, generator, stamp)
        scene.commit()
        if model.copy() == before:
            while len(model.snapshots) <= scene.version:  # added and removed again: a version may pass, or not
                model.snapshots.append(model.copy())
            continue
        model.snapshots.append(model.copy())
        assert scene.version == len(model.snapshots) - 1
        check_changes(scene, model, scene.version - 1)
        check_changes(scene, model, generator.randrange(scene.version + 1))


def test_memory_is_told(ag) -> None:
    scene = ag.Scene()
    scene.add_instances(square(scene), at(), name="o")
    scene.commit()
    told = scene.bytes
    assert told["meshes"] >= SQUARE.nbytes + TWO.nbytes and told["instances"] > 0 and told["bvh"] > 0


def test_a_mesh_given_anew_invalidates_no_more_than_what_changed(ag) -> None:
    scene = ag.Scene()
    rng = np.random.default_rng(3)
    arrays: dict[str, Any] = dict(
        positions=rng.random((30, 3), dtype=np.float32), triangles=np.arange(30, dtype=np.int32).reshape(10, 3),
        uvs={"map": rng.random((30, 2), dtype=np.float32)}, active_uv="map", materials=np.arange(10) % 2)
    mesh = scene.add_mesh(name="rag", **arrays)
    scene.add_instances(mesh, np.eye(4)[None], name="rag")
    scene.commit()

    def changes_of(**given: Any) -> set[str]:
        version = scene.version
        scene.set_mesh(mesh, name="rag", **{**arrays, **given})
        scene.commit()
        return {name for name, value in scene.changes_since(version).items() if value and name != "version"}

    assert changes_of() == set()
    assert changes_of(positions=arrays["positions"] + np.float32(0.1)) == {"meshes_deformed", "instances_deformed"}
    assert changes_of(positions=arrays["positions"] + np.float32(0.1)) == set()
    assert changes_of(uvs={"map": 1 - arrays["uvs"]["map"]}) == {"meshes_replaced"}
    assert changes_of(materials=np.zeros(10, int)) == {"meshes_replaced"}
