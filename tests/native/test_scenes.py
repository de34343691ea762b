# SPDX-License-Identifier: GPL-3.0-or-later
"""The procedural scenes: sound meshes, the sizes that benchmarks count on, motion that is defined at every frame."""

import numpy as np
import pytest
from afterglow import scenes
from afterglow.scenes import native, shapes


@pytest.mark.parametrize("name", list(scenes.SCENES))
def test_every_scene_is_sound(name: str) -> None:
    scene = scenes.make(name)
    assert scene.objects and scene.frames[1] >= scene.frames[0]
    for key, mesh in scene.meshes.items():
        assert np.isfinite(mesh.positions).all(), key
        assert mesh.triangles.min() >= 0 and mesh.triangles.max() < len(mesh.positions), key
        corners = mesh.positions[mesh.triangles].astype(np.float64)
        area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        assert (area > 0).all(), key
        assert mesh.uvs is None or len(mesh.uvs) == 3 * len(mesh.triangles), key
        assert mesh.slots is None or len(mesh.slots) == len(mesh.triangles), key
    for item in scene.objects:
        assert item.mesh in scene.meshes and all(m in scene.materials for m in item.materials)
        slots = scene.meshes[item.mesh].slots
        assert len(item.materials) == (1 if slots is None else slots.max() + 1)
        for frame in (-3, 0, 1, 1.5, 100):
            assert np.isfinite(item.at(frame)).all()
    for key, material in scene.materials.items():
        graph = native.graph(material, {image: i for i, image in enumerate(scene.images)})
        assert graph["surface"] is not None, key
        for node in graph["nodes"]:
            for value in node["inputs"].values():
                if isinstance(value, tuple) and value and value[0] == "link":
                    assert 0 <= value[1] < len(graph["nodes"])


def test_sizes_that_benchmarks_count_on() -> None:
    assert 60_000 <= len(shapes.bunny().triangles) <= 80_000
    assert 70_000 <= scenes.make("pillared_hall").triangle_count <= 90_000
    assert 170_000 <= scenes.make("conference_room").triangle_count <= 230_000
    assert len(scenes.SCENES["bouncing_bunnies"](25, 8).objects) == 25 + 3
    assert len([o for o in scenes.make("spheres").objects if o.name.startswith("Ball")]) == 66


@pytest.mark.parametrize("mesh", [shapes.sphere(), shapes.box(), shapes.bunny(12), shapes.statue(24, 40), shapes.cylinder()])
def test_closed_shapes_look_outwards(mesh: scenes.Mesh) -> None:
    """The signed volume under outward triangles is positive, and every edge of a welded shape has two sides."""
    a, b, c = np.moveaxis(mesh.positions[mesh.triangles].astype(np.float64), 1, 0)
    assert np.einsum("ij,ij->i", a, np.cross(b, c)).sum() > 0
    if mesh.smooth:
        edges = np.sort(np.concatenate([mesh.triangles[:, [0, 1]], mesh.triangles[:, [1, 2]], mesh.triangles[:, [2, 0]]]), 1)
        assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()


def test_deforming_meshes_keep_their_triangles() -> None:
    scene = scenes.make("wobbling_cylinder")
    mesh = scene.meshes["Cylinder"]
    assert mesh.deform is not None
    one, two = mesh.deform(1), mesh.deform(7.5)
    assert one.shape == two.shape == mesh.positions.shape and np.abs(one - two).max() > 0.01


@pytest.mark.parametrize(("name", "moves"), [("conference_room", "Bunny"), ("pillared_hall", "Box"),
                                             ("office_with_blinds", "Rolling chair")])
def test_one_thing_moves_through_each_large_room(name: str, moves: str) -> None:
    """In every one of its 100 frames, and nothing else does."""
    scene = scenes.make(name)
    assert scene.frames == (1, 100)
    [item] = [item for item in scene.objects if item.move is not None]
    assert item.name == moves
    places = np.array([item.at(frame)[0] for frame in range(1, 101)])
    assert (np.abs(np.diff(places, axis=0)).max((1, 2)) > 1e-5).all()
    assert np.ptp(places[:, :3, 3], axis=0).max() > 0.5


def test_scaled_and_moved_scenes() -> None:
    scene = scenes.make("cornell_box")
    large, far = scene.scaled(1e4), scene.moved((1e5, 0, 0))
    assert large.lights[0].power == pytest.approx(scene.lights[0].power * 1e8)
    assert large.lights[0].size[0] == pytest.approx(scene.lights[0].size[0] * 1e4)
    np.testing.assert_allclose(np.linalg.det(large.lights[0].transform[:3, :3]), 1.0)
    np.testing.assert_allclose(large.camera.transform[:3, 3], scene.camera.transform[:3, 3] * 1e4)
    np.testing.assert_allclose(np.linalg.det(large.camera.transform[:3, :3]), 1.0)
    np.testing.assert_allclose(far.camera.transform[0, 3], 1e5)


def test_unknown_names_are_named() -> None:
    with pytest.raises(KeyError, match="cornell_box"):
        scenes.make("no such scene")


def test_blend_files_are_small(blend_files) -> None:
    """A repository that everybody clones: 300 KB each, more only where tens of thousands of triangles are the point."""
    large = {"cornell_statue", "conference_room", "bouncing_bunnies", "wobbling_cylinder", "kite"}
    for name in scenes.BLEND_FILES:
        path = blend_files / f"{name}.blend"
        assert path.is_file(), f"{path} is absent: write it by blend_files/make.py"
        assert path.stat().st_size <= (2048 if name in large else 300) * 1024, name
    assert sum(path.stat().st_size for path in blend_files.glob("*.blend")) <= 10 * 1024**2
