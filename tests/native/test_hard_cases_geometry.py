# SPDX-License-Identifier: GPL-3.0-or-later
"""Geometry that should not be, and is: degenerate, non-finite, singular, inverted, huge, empty."""

import afterglow
import numpy as np
import pytest
from afterglow.scenes import native, node
from afterglow.scenes.shapes import bunny, flipped
from hard_cases import (
    Built,
    Camera,
    Description,
    Light,
    agree,
    background,
    ball_grid,
    ball_under_sky,
    diffuse,
    look_at,
    mean,
    one_quad,
    quad,
    render,
    scenes,
    sphere,
    translate,
)

WHITE = native.graph(diffuse((0.8, 0.8, 0.8)))
TRIANGLE = np.array([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], np.float32)


def bare_scene(sky: float = 1.0) -> afterglow.Scene:
    """A camera above z = 0 and an even sky."""
    scene = afterglow.Scene()
    scene.set_camera("perspective", look_at((0, 0, 3), (0, 0, 0), (0, 1, 0)), window=(-0.5, 0.5, -0.5, 0.5), clip=(0.01, 1e9))
    scene.set_world(native.graph(background((1, 1, 1), sky)))
    return scene


def show(scene: afterglow.Scene, samples: int = 4) -> np.ndarray:
    return render(scene, samples=samples).image


def add(scene: afterglow.Scene, name: str, positions: np.ndarray, triangles: object = ((0, 1, 2),), transform: object = None,
        **more: object) -> None:
    mesh = scene.add_mesh(name=name, positions=np.asarray(positions, np.float32),
                          triangles=np.asarray(triangles, np.int32), **more)
    place = np.eye(4)[None] if transform is None else np.asarray(transform, np.float64).reshape(-1, 4, 4)
    scene.add_instances(mesh, place, name=name, materials=[scene.add_material(WHITE, name=f"{name} material")])


def test_empty_scenes_render() -> None:
    scene = afterglow.Scene()
    scene.set_camera("perspective", np.eye(4), window=(-0.5, 0.5, -0.5, 0.5))
    scene.commit()
    assert show(scene)[..., :3].max() == 0.0
    scene.set_world(native.graph(background((0.25, 0.5, 1.0), 2.0)))
    scene.commit()
    np.testing.assert_allclose(show(scene)[5, 5, :3], (0.5, 1.0, 2.0), rtol=1e-5)


def test_a_scene_without_a_camera_is_seen_from_the_origin() -> None:
    scene = afterglow.Scene()
    scene.set_world(native.graph(background((1, 1, 1), 0.5)))
    scene.commit()
    np.testing.assert_allclose(show(scene)[..., :3], 0.5, rtol=1e-5)


def test_no_light_at_all_is_black() -> None:
    scene = one_quad()
    assert render(scene).image[..., :3].max() == 0.0


def test_nothing_in_view() -> None:
    scene = one_quad()
    scene.camera = Camera(look_at((0, 0, 2), (0, 0, 9), (0, 1, 0)))
    scene.lights = [Light("Lamp", "point", translate((0, 0, 1)), 10.0)]
    assert render(scene).image[..., :3].max() == 0.0


def test_one_triangle() -> None:
    scene = bare_scene()
    add(scene, "One", TRIANGLE)
    assert not scene.commit()["warnings"]
    np.testing.assert_allclose(show(scene, 256)[12, 12, :3], 0.8, rtol=0.02)


def test_an_empty_mesh_and_an_object_without_materials() -> None:
    scene = bare_scene()
    add(scene, "Empty", np.zeros((0, 3)), np.zeros((0, 3)))
    mesh = scene.add_mesh(name="Bare", positions=TRIANGLE, triangles=np.array([[0, 1, 2]], np.int32))
    scene.add_instances(mesh, np.eye(4)[None], name="Bare", materials=[])
    scene.commit()
    assert 0.5 < show(scene, 64)[12, 12, 0] < 1.0


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_non_finite_vertices_are_left_out_and_named(bad: float) -> None:
    scene = bare_scene()
    positions = np.concatenate([TRIANGLE, TRIANGLE + [0, 0, -1], [[bad, 0, 0]]])
    add(scene, "Broken", positions, [[0, 1, 2], [3, 4, 6]])
    warnings = scene.commit()["warnings"]
    assert any("Broken" in w for w in warnings), warnings
    np.testing.assert_allclose(show(scene, 256)[12, 12, :3], 0.8, rtol=0.02)
    assert not scene.commit()["warnings"], "a warning is said once"


@pytest.mark.parametrize("index", [-1, 3, 2**31 - 1])
def test_indices_out_of_range_are_left_out_and_named(index: int) -> None:
    scene = bare_scene()
    add(scene, "Wild", TRIANGLE, [[0, 1, 2], [0, 1, index]])
    warnings = scene.commit()["warnings"]
    assert any("Wild" in w for w in warnings), warnings
    assert show(scene)[12, 12, 0] > 0


@pytest.mark.parametrize("key", ["corner_normals", "vertex_normals", "uvs", "attributes"])
@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_non_finite_corner_data(key: str, bad: float) -> None:
    scene = bare_scene()
    width = 2 if key == "uvs" else 3
    values = np.full((3, width), bad, np.float32)
    more = {"uvs": {"uvs": {"UV": values}}, "attributes": {"attributes": {"Color": ("vertex", values)}}}.get(key, {key: values})
    add(scene, "Odd", TRIANGLE, smooth=np.array([True]), **more)
    scene.commit()
    assert show(scene)[12, 12, 0] > 0


def test_wrong_shapes_are_refused() -> None:
    scene = afterglow.Scene()
    with pytest.raises(afterglow.InvalidInput):
        scene.add_mesh(name="Flat", positions=np.zeros((3, 2), np.float32), triangles=np.zeros((1, 3), np.int32))
    with pytest.raises(afterglow.InvalidInput):
        scene.add_mesh(name="Quads", positions=np.zeros((4, 3), np.float32), triangles=np.zeros((1, 4), np.int32))
    mesh = scene.add_mesh(name="Fine", positions=TRIANGLE, triangles=np.array([[0, 1, 2]], np.int32))
    with pytest.raises(afterglow.InvalidInput):
        scene.add_instances(mesh, np.eye(3)[None], name="Small matrix")
    with pytest.raises(afterglow.InvalidHandle):
        scene.add_instances(mesh + 1000, np.eye(4)[None], name="No mesh")
    with pytest.raises(afterglow.InvalidHandle):
        scene.remove_mesh(mesh + 1000)
    with pytest.raises(afterglow.InvalidInput):
        scene.add_light("laser", np.eye(4), name="Laser", color=(1, 1, 1), power=1.0)


@pytest.mark.parametrize("settings", [{"width": 0}, {"height": -3}, {"samples": -1}, {"method": "MAGIC"}, {"threads": -1},
                                      {"region": (5, 5, 5, 5)}, {"accuracy": float("nan")}, {"no_such_setting": 1},
                                      {"max_bounces": -1}, {"pixel_filter": "ROUND"}])
def test_wrong_settings_are_refused(settings: dict) -> None:
    built = Built(scenes.make("cornell_box"))
    with pytest.raises(afterglow.InvalidInput):
        render(built, **settings)


@pytest.mark.parametrize("matrix", [np.zeros((4, 4)), np.diag([0.0, 0, 0, 1]), np.diag([1.0, 1, 0, 1]), np.full((4, 4), np.nan),
                                    np.diag([np.inf, 1, 1, 1])], ids=["zeros", "scale_0", "flat", "nan", "inf"])
def test_singular_and_non_finite_transforms_are_left_out_and_named(matrix: np.ndarray) -> None:
    scene = bare_scene()
    add(scene, "Good", TRIANGLE)
    add(scene, "Crushed", TRIANGLE + [0, 0, 1], transform=matrix)
    warnings = scene.commit()["warnings"]
    assert any("Crushed" in w for w in warnings), warnings
    assert not any("Good" in w for w in warnings)
    np.testing.assert_allclose(show(scene, 256)[12, 12, :3], 0.8, rtol=0.02)


def test_scale_of_minus_one_changes_nothing() -> None:
    scene, mirrored = ball_under_sky(diffuse((0.5, 0.5, 0.5))), ball_under_sky(diffuse((0.5, 0.5, 0.5)))
    for item in (scene, mirrored):
        item.lights = [Light("Sun", "sun", look_at((0, -1, 1), (0, 0, 0)), 3.0)]
    mirrored.objects[0].transforms = np.diag([-1.0, 1, 1, 1])[None]
    agree(mean(scene), mean(mirrored), 2e-3)


def test_scale_of_1_1_1e_6_is_a_flat_disk() -> None:
    scene = ball_under_sky(diffuse((0.5, 0.5, 0.5)))
    scene.objects[0].transforms = np.diag([1.0, 1, 1e-6, 1])[None]
    scene.camera = Camera(look_at((0, 0, 4), (0, 0, 0), (0, 1, 0)), np.radians(39))
    image = render(scene, samples=128).image
    np.testing.assert_allclose(image[12, 12, :3], 0.5, rtol=0.05)


def test_needles_and_zero_area_and_duplicate_triangles() -> None:
    scene = bare_scene()
    add(scene, "Floor", np.array([[-9, -9, -1], [9, -9, -1], [0, 12, -1]]))
    needle = np.array([[-1, 0, 0], [1, 0, 0], [0, 1e-6, 0]])
    add(scene, "Needle", needle)
    add(scene, "Point", np.zeros((3, 3)))
    add(scene, "Line", np.array([[0, 0, 0.1], [1, 0, 0.1], [2, 0, 0.1]]))
    add(scene, "Same corner", TRIANGLE, [[0, 0, 1], [2, 2, 2]])
    add(scene, "Twice", np.array([[-9, -9, -1], [9, -9, -1], [0, 12, -1]]))
    scene.commit()
    image = show(scene, 128)
    np.testing.assert_allclose(image[4, 12, :3], 0.8, rtol=0.06)


def test_needles_as_lamps() -> None:
    """Emissive triangles without area neither shine nor break the light selection."""
    scene = bare_scene(0.0)
    add(scene, "Floor", np.array([[-9, -9, -1], [9, -9, -1], [0, 12, -1]]))
    lamp = scene.add_material(native.graph(node("emission", color=(1.0, 1.0, 1.0), strength=5.0)), name="lamp")
    positions = np.array([[0, 0, 0.5], [0, 0, 0.5], [0, 0, 0.5], [-1, 0, 0.5], [1, 0, 0.5], [0, 1e-7, 0.5]], np.float32)
    mesh = scene.add_mesh(name="Lamp", positions=positions, triangles=np.array([[0, 1, 2], [3, 4, 5]], np.int32))
    scene.add_instances(mesh, np.eye(4)[None], name="Lamp", materials=[lamp])
    scene.commit()
    assert show(scene)[..., :3].max() < 10


def test_inverted_and_disagreeing_normals() -> None:
    scene = ball_under_sky(diffuse((0.5, 0.5, 0.5)))
    scene.meshes["Ball"] = flipped(scene.meshes["Ball"])
    agree(mean(scene), mean(ball_under_sky(diffuse((0.5, 0.5, 0.5)))), 5e-3)
    bare = bare_scene()
    for i, normal in enumerate([(0, 0, -1), (1, 0, 0), (0, 0, 0), (0.999, 0, -0.04)]):
        normals = np.tile(np.array(normal, np.float32), (3, 1))
        add(bare, f"Bent {i}", TRIANGLE + [0, 0, -0.1 * i], corner_normals=normals, smooth=np.array([True]))
    bare.commit()
    assert show(bare, 64)[..., :3].max() <= 1.6


def test_smooth_normals_do_not_change_a_furnace_much() -> None:
    """A coarse smooth sphere within an even furnace: shading normals must not make light."""
    from afterglow.scenes.rooms import furnace

    scene = furnace(0.5)
    coarse = sphere(0.3, 8, 4)
    scene.add("Coarse", coarse, "furnace", transform=translate((0, 0.4, 0)))
    value, error = mean(scene, samples=64, max_bounces=64, diffuse_bounces=64)
    assert abs(value - 1) < 0.01 + 4 * error


def test_sheets_in_one_plane_do_not_turn_black_or_bright() -> None:
    """Two objects in exactly the same place, and one a hair above: the light is that of one."""
    def two(gap: float) -> Description:
        scene = one_quad(diffuse((0.8, 0.8, 0.8)))
        scene.world = background((1, 1, 1))
        scene.add("Second", quad((-3, -3, gap), (3, -3, gap), (3, 3, gap), (-3, 3, gap)), "surface")
        return scene

    for gap in (0.0, 1e-7, 1e-5):
        value, error = mean(two(gap), samples=64)
        assert abs(value - 0.8) < 0.012 + 4 * error, gap


def ten_thousand_instances() -> tuple[Built, np.ndarray]:
    scene, places = ball_grid()
    return Built(scene), places


def test_ten_thousand_instances() -> None:
    built, places = ten_thousand_instances()
    assert render(built, samples=4).image[..., :3].mean() > 0.1
    assert sum(built.scene.bytes.values()) < 64e6
    places[:, 2, 3] = 100.0  # behind the camera
    built.scene.set_transforms(built.instances["Ball"], places)
    built.scene.commit()
    assert render(built, samples=4).image[..., :3].mean() > 0.99


@pytest.mark.timing
def test_ten_thousand_instances_move_at_once() -> None:
    built, places = ten_thousand_instances()
    built.scene.commit()
    places[:, 2, 3] = 1.0
    built.scene.set_transforms(built.instances["Ball"], places)
    assert built.scene.commit()["seconds"] < 1.0


def test_a_hundred_lights_equal_their_sum() -> None:
    """The mean with a hundred lamps is the sum of the means with each quarter of them."""
    scene = scenes.SCENES["many_lights"](100)
    whole = mean(scene, samples=64, repeats=6)
    lights, total, variance = scene.lights, 0.0, 0.0
    for i in range(4):
        scene.lights = lights[i::4]
        part = mean(scene, samples=64, repeats=6)
        total, variance = total + part.value, variance + part.error**2
    assert abs(whole.value - total) < 4.5 * np.hypot(whole.error, variance**0.5) + 2e-3 * total


@pytest.mark.slow
def test_two_million_triangles() -> None:
    scene = Description("large", Camera(look_at((0, -3, 1), (0, 0, 0.5)), 0.7))
    scene.materials["m"] = diffuse((0.6, 0.6, 0.6))
    scene.world = background((1, 1, 1))
    scene.add("Bunny", bunny(410), "m")
    assert scene.triangle_count > 2_000_000
    built = Built(scene)
    assert render(built, samples=4).image[..., :3].mean() > 0.1


def test_extreme_light_values_are_refused_or_finite() -> None:
    for power in (np.nan, np.inf, -np.inf):
        scene = one_quad()
        scene.lights = [Light("Broken lamp", "point", translate((0, 0, 1)), float(power))]
        try:
            built = Built(scene)
        except afterglow.InvalidInput as error:
            assert "Broken lamp" in str(error)
            continue
        assert any("Broken lamp" in w for w in built.changes["warnings"]), built.changes["warnings"]
        render(built)


def test_non_finite_materials_and_worlds_stay_finite() -> None:
    for value in (np.nan, np.inf, -5.0, 1e38):
        scene = one_quad(diffuse((value, 0.5, 0.5)))
        scene.world = background((1, 1, 1))
        render(scene, samples=4)
        scene = one_quad()
        scene.world = background((1, value, 1))
        render(scene, samples=4)
        scene.add("Lamp", sphere(0.2, 8, 4), "lamp", transform=translate((0, 0, 1)))
        scene.materials["lamp"] = node("emission", color=(1.0, 1.0, 1.0), strength=value)
        render(scene, samples=4)


@pytest.mark.parametrize(("value", "shines"), [(1e25, True), (1e36, False), (3e38, False)])
def test_light_beyond_the_film_is_dropped_and_counted(value: float, shines: bool) -> None:
    """Sums of 32-bit floats must hold it, in every pass; the rest of the picture stays as it is."""
    passes = ["diffuse_direct", "diffuse_indirect", "diffuse_color", "emission", "environment", "albedo", "error", "batches"]
    scene = one_quad()
    scene.world = background((1, 1, 1))
    dark = render(scene, samples=64, passes=passes)
    scene.add("Lamp", sphere(0.2, 8, 4), "lamp", transform=translate((0, 0, 1)))
    scene.materials["lamp"] = node("emission", color=(1.0, 1.0, 1.0), strength=value)
    bright = render(scene, samples=64, passes=passes)
    assert dark.statistics["dropped"] == 0
    assert (bright.statistics["dropped"] == 0) == shines
    assert (bright.image[..., :3].max() > 1e20) == shines
    if not shines:
        assert bright.image[..., :3].mean() < 1.1 * dark.image[..., :3].mean()


def test_odd_graphs_render_and_warn_once() -> None:
    graphs = {
        "unknown": {"nodes": [{"type": "no_such_node", "name": "x", "params": {}, "inputs": {}}],
                    "surface": ("link", 0, "shader")},
        "nothing": {"nodes": [], "surface": None},
    }
    for name, graph in graphs.items():
        scene = bare_scene()
        mesh = scene.add_mesh(name="Mesh", positions=TRIANGLE, triangles=np.array([[0, 1, 2]], np.int32))
        scene.add_instances(mesh, np.eye(4)[None], name="Thing", materials=[scene.add_material(graph, name=name)])
        warnings = scene.commit()["warnings"]
        if name == "unknown":
            assert any("no_such_node" in w for w in warnings), warnings
        show(scene)
    cycle = {"nodes": [{"type": "mix_shader", "name": "a", "params": {}, "inputs": {"shader": ("link", 0, "shader")}}],
             "surface": ("link", 0, "shader")}
    scene = bare_scene()
    mesh = scene.add_mesh(name="Mesh", positions=TRIANGLE, triangles=np.array([[0, 1, 2]], np.int32))
    try:
        scene.add_instances(mesh, np.eye(4)[None], name="Thing", materials=[scene.add_material(cycle, name="round and round")])
        warnings = scene.commit()["warnings"]
    except afterglow.InvalidInput as error:
        assert "round and round" in str(error)
    else:
        assert any("round and round" in w for w in warnings), warnings
        show(scene)


def test_removed_things_are_gone() -> None:
    built = Built(scenes.make("cornell_box"))
    built.scene.remove_instances(built.instances["Tall"])
    built.scene.remove_light(built.lights["Lamp"])
    built.scene.commit()
    assert render(built).image[..., :3].max() == 0.0
    with pytest.raises(afterglow.InvalidHandle):
        built.scene.set_light(built.lights["Lamp"], power=1.0)
        built.scene.commit()


def test_a_missing_image_is_magenta_and_named() -> None:
    scene = bare_scene()
    image = scene.add_image("/nowhere/missing.png", name="Missing image")
    graph = native.graph(node("emission", color=node("image_texture", {"image": "x"})), {"x": image})
    mesh = scene.add_mesh(name="Mesh", positions=TRIANGLE, triangles=np.array([[0, 1, 2]], np.int32))
    scene.add_instances(mesh, np.eye(4)[None], name="Thing", materials=[scene.add_material(graph, name="m")])
    warnings = scene.commit()["warnings"]
    assert any("Missing image" in w or "missing.png" in w for w in warnings), warnings
    np.testing.assert_allclose(show(scene, 64)[12, 12, :3], (1, 0, 1), atol=0.02)
