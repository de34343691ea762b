# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes that should not be, in the HashCache: its mean light against the path tracer's or against what arithmetic says."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from afterglow.scenes import SCENES, Camera, Description, Light, Mesh, look_at, node, translate
from afterglow.scenes.native import Built, graph
from afterglow.scenes.rooms import background, diffuse, emission, furnace
from afterglow.scenes.shapes import box, flipped, join, quad, sphere, transformed
from hard_cases import Mean, agree, ball_grid, mean
from test_hash_cache import Live, indirect

PATHS: dict[str, Any] = dict(size=16, diffuse_bounces=4, max_bounces=12, caustics_reflective=False, caustics_refractive=False)
CELLS: dict[str, Any] = {**PATHS, "method": "HASH_CACHE"}


def room(*things: Mesh) -> Description:
    """A closed room of two metres, a lamp under its ceiling, and what else stands in it."""
    scene = Description("room", Camera(look_at((0, -0.9, 0.1), (0, 1, -0.2)), math.radians(80)))
    scene.materials.update(white=diffuse((0.7, 0.7, 0.7)), red=diffuse((0.8, 0.2, 0.1)), lamp=emission(4.0))
    scene.add("Room", box((-1, -1, -1), (1, 1, 1), inward=True), "white")
    scene.add("Lamp", quad((-0.2, -0.2, 0.9), (-0.2, 0.2, 0.9), (0.2, 0.2, 0.9), (0.2, -0.2, 0.9)), "lamp")
    for i, thing in enumerate(things):
        scene.add(f"Thing {i}", thing, "red")
    return scene


def needles(count: int = 500) -> Description:
    """Of a length of a metre and a width of a thousandth of a millimetre."""
    rng = np.random.default_rng(1)
    ends = rng.uniform(-0.9, 0.9, (count, 2, 3))
    third = ends[:, :1] + 1e-6 * rng.normal(size=(count, 1, 3))
    corners = np.concatenate([ends, third], 1).reshape(-1, 3)
    return room(Mesh(corners, np.arange(3 * count).reshape(-1, 3)))


def degenerate() -> Description:
    """Points, lines, triangles twice in one place, edges that three triangles share, half of the sides inverted."""
    corners = np.array([[-0.5, 0, -1], [0.5, 0, -1], [0.5, 0, 0], [-0.5, 0, 0], [0, 0.5, -0.5], [0, -0.5, -0.5]], float)
    triangles = [[0, 1, 2], [0, 1, 2], [0, 2, 3], [2, 0, 4], [0, 2, 5], [0, 0, 0], [0, 1, 1], [5, 4, 2]]
    return room(Mesh(corners, np.array(triangles)))


def bent_normals() -> Description:
    """Balls of so few triangles that smooth normals stand up to 40° off, one of them inside out."""
    return room(join(transformed(sphere(0.35, 6, 4), translate((0.4, 0.3, -0.5))),
                     transformed(flipped(sphere(0.3, 6, 4)), translate((-0.4, 0.2, -0.6)))))


def odd_scales() -> Description:
    """Mirrored, flat, crushed to nothing, a kilometre long."""
    scene = room()
    things = [((-1, 1, 1), (0.4, 0.3, -0.6)), ((1, 1, 1e-6), (-0.4, 0.3, -0.5)), ((0, 1, 1), (0, 0, 0)),
              ((0.1, -0.1, 1e3), (-0.4, -0.3, -0.8)), ((0, 0, 0), (0, 0, 0))]
    for i, (scales, place) in enumerate(things):
        scene.add(f"Scaled {i}", sphere(0.3, 16, 8), "red", transform=translate(place) @ np.diag([*scales, 1.0]))
    return scene


def mirrors() -> Description:
    """Two mirrors face each other over a floor."""
    scene = room()
    scene.materials["mirror"] = node("glossy_bsdf", {"distribution": "sharp"}, color=(0.95, 0.95, 0.95), roughness=0.0)
    scene.add("One", quad((-0.9, -0.8, -0.9), (-0.9, 0.8, -0.9), (-0.9, 0.8, 0.8), (-0.9, -0.8, 0.8)), "mirror")
    scene.add("Other", quad((0.9, 0.8, -0.9), (0.9, -0.8, -0.9), (0.9, -0.8, 0.8), (0.9, 0.8, 0.8)), "mirror")
    return scene


def glass_in_glass() -> Description:
    scene = room()
    scene.materials["glass"] = node("glass_bsdf", {"distribution": "sharp"}, color=(1.0, 1.0, 1.0), roughness=0.0, ior=1.5)
    for name, radius in (("Outer", 0.4), ("Inner", 0.3), ("Core", 0.1)):
        scene.add(name, sphere(radius, 32, 16), "red" if name == "Core" else "glass", transform=translate((0, 0.3, -0.5)))
    return scene


def lamp_near_the_floor() -> Description:
    """A thousandth of its own size above the floor."""
    scene = room()
    scene.add("Low", box((-0.1, 0.0, -0.9998), (0.1, 0.2, -0.9)), "lamp")
    return scene


def grazing_sun() -> Description:
    """A sun 0.1° above the floor: a wall sees nothing but the floor and the floor's own light."""
    scene = Description("grazing", Camera(look_at((0, -4, 1.2), (0, 0, 0.6)), math.radians(50)))
    scene.materials["white"] = diffuse((0.7, 0.7, 0.7))
    scene.add("Floor", quad((-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)), "white")
    scene.add("Wall", quad((-2, 2, 0), (2, 2, 0), (2, 2, 2), (-2, 2, 2)), "white")
    angle = math.radians(89.9)
    scene.lights = [Light("Sun", "sun", look_at((math.sin(angle), 0, math.cos(angle)), (0, 0, 0)), 1000.0, angle=0.0)]
    return scene


def one_triangle() -> Description:
    scene = Description("one", Camera(look_at((0, -2, 1), (0, 0, 0)), math.radians(60)))
    scene.materials["white"] = diffuse((0.7, 0.7, 0.7))
    scene.add("One", Mesh(np.array([[-1, -1, 0], [1, -1, 0], [0, 1, 0.3]], float), np.array([[0, 1, 2]])), "white")
    scene.lights = [Light("L", "point", translate((0, 0, 1)), 50.0)]
    scene.world = background((0.5, 0.7, 1.0))
    return scene


def ten_thousand_instances() -> Description:
    scene, _ = ball_grid()
    scene.add("Floor", quad((-50, -50, -0.4), (50, -50, -0.4), (50, 50, -0.4), (-50, 50, -0.4)), "m")
    return scene


def black_and_white() -> Description:
    """Albedo exactly 0 and exactly 1 side by side."""
    scene = room(box((-0.5, 0.2, -1), (0, 0.6, -0.3)), box((0.2, 0.2, -1), (0.6, 0.6, -0.5)))
    scene.materials.update(white=diffuse((1.0, 1.0, 1.0)), red=diffuse((0.0, 0.0, 0.0)))
    return scene


def specks() -> Description:
    """A hundred thousand triangles of half a millimetre, in cells of centimetres."""
    rng = np.random.default_rng(2)
    corners = rng.uniform(-0.4, 0.4, (100_000, 1, 3)) + 5e-4 * rng.normal(size=(100_000, 3, 3)) + (0, 0.3, -0.5)
    return room(Mesh(corners.reshape(-1, 3), np.arange(300_000).reshape(-1, 3)))


ODD: dict[str, Callable[[], Description]] = {
    f.__name__: f for f in (needles, degenerate, bent_normals, odd_scales, mirrors, glass_in_glass, lamp_near_the_floor,
                            grazing_sun, one_triangle, ten_thousand_instances, black_and_white, specks)
} | dict(many_lights=SCENES["many_lights"], thin_walls=SCENES["thin_walls"])


@pytest.mark.parametrize("name", ODD)
def test_odd_scenes_have_the_path_tracers_light(name: str) -> None:
    scene = ODD[name]()
    agree(indirect(scene, 10, samples=32, **CELLS), indirect(scene, 4, samples=256, **PATHS), tolerance=0.005)


@pytest.mark.parametrize("albedo", [0.0, 0.5, 0.9, 0.99])
def test_furnace_shows_its_radiance(albedo: float) -> None:
    """Paths that end in cells of paths that ended in cells: 1 ± 0.5 % even where light is reflected a hundred times."""
    bounces = 1024 if albedo > 0.95 else 128
    value, error = mean(furnace(albedo, shape="box"), repeats=6, samples=32, size=12, method="HASH_CACHE",
                        max_bounces=bounces, diffuse_bounces=bounces)
    assert abs(value - 1) < 0.005 + 4.5 * error and error < 0.01


def lamp_above_a_ball(height: float) -> float:
    """The brightest pixel outside a closed ball whose lamp stands so high above its surface; the inside was seen first."""
    scene = Description("close", Camera(look_at((0, 0, 0.5), (0, 0.1, 1)), 1.5))
    ball = sphere(1.0, 64, 32)
    ball.smooth = False
    scene.materials["ball"] = diffuse((0.8, 0.8, 0.8))
    scene.add("Ball", ball, "ball")
    scene.lights = [Light("Lamp", "point", translate((0, 0, 1 + height)), 10.0)]
    live = Live(scene, samples=16, passes=["combined", "diffuse_indirect"])
    live.look_from((0, 0.1, 4), (0, 0, 1))
    image = live.session.read("combined")[..., :3]
    assert np.isfinite(image).all() and (image >= 0).all()
    return float(image.max())


def test_a_lamp_inside_touching_and_just_above_a_surface() -> None:
    assert lamp_above_a_ball(-0.01) == 0.0 and lamp_above_a_ball(0.001) > 0.0
    assert math.isfinite(lamp_above_a_ball(0.0)) and math.isfinite(lamp_above_a_ball(1e-5))


def two_rooms(powers: tuple[float, float], gap: float = 1e-3) -> Description:
    """Closed, two walls a millimetre apart between them, a lamp in each."""
    scene = Description("two", Camera(look_at((-1, -0.9, 0), (-1, 1, 0)), math.radians(80)))
    scene.materials["white"] = diffuse((0.7, 0.7, 0.7))
    for name, x, power in (("Left", -1.0, powers[0]), ("Right", 1.0 + gap, powers[1])):
        scene.add(name, box((x - 1, -1, -1), (x + 1, 1, 1), inward=True), "white")
        scene.lights.append(Light(name, "point", translate((x, 0.2, 0.7)), power, radius=0.05))
    return scene


LEFT, RIGHT = ((-1, -0.9, 0), (-1, 1, 0)), ((1, -0.9, 0), (1, 1, 0))


@pytest.mark.parametrize("gap", [2e-4, 2e-5])
def test_walls_leak_nothing_to_a_camera_that_has_seen_both_sides(gap: float) -> None:
    """Cells of the bright room are full when the dark one is seen; then the other way round."""
    live = Live(two_rooms((100.0, 0.0), gap), samples=8)
    lit = live.look_from(*LEFT).mean()
    assert lit > 0.1 and live.look_from(*RIGHT).max() == 0.0
    assert abs(live.look_from(*LEFT).mean() / lit - 1) < 0.05


def test_sheets_through_one_object_leak_no_farther_than_cells_reach() -> None:
    """The walls run on behind two sheets 0.2 mm apart: cells that reach through mix both sides. What that costs is known."""
    live = Live(SCENES["thin_walls"](2e-4), samples=8, width=96, height=96)
    lit = live.look_from((0, -2.0, 0.6), (0, 1, 0.3)).mean()
    dark = live.look_from((0, -2.0, -0.6), (0, 1, -0.3)).mean(-1)
    assert np.median(dark) < 0.005 * lit and (dark > 0.02 * lit).mean() < 0.1


def test_a_ten_millionth_of_a_billionth_beside_the_bright_room() -> None:
    """Light of 1e-8 beside light of 1e8 in one cache: each room's own, whichever was seen first."""
    settings: dict[str, Any] = dict(samples=16, hash_running=False)
    alone = [Live(two_rooms((1e-8, 0.0)), start=False, **settings).run(seed=s).mean(dtype=np.float64) for s in range(4)]
    both = []
    for s in range(4):
        live = Live(two_rooms((1e-8, 1e8)), seed=50 + s, **settings)
        assert live.look_from(*RIGHT).mean() > 1e5
        both.append(live.look_from(*LEFT).mean(dtype=np.float64))
    agree(statistics_of(both), statistics_of(alone), tolerance=0.01)


def statistics_of(values: list[float]) -> Mean:
    return Mean(float(np.mean(values)), float(np.std(values, ddof=1) / len(values) ** 0.5))


@pytest.mark.parametrize("what", ["object", "material", "mesh"])
def test_something_that_changes_in_every_frame(what: str) -> None:
    """A block goes to and fro, is recoloured, or breathes: after 12 frames the light is that of a scene that never changed."""
    scene = room(box((-0.2, -0.2, -1), (0.2, 0.2, -0.2)))

    def place(frame: int) -> Any:
        return translate((0.4 * math.cos(frame), 0.4 * math.sin(frame), 0))

    def change(built: Built, frame: int) -> None:
        if what == "object":
            built.scene.set_transforms(built.instances["Thing 0"], place(frame)[None])
        elif what == "material":
            built.scene.set_material(built.materials["red"], graph(diffuse((0.1 + 0.7 * (frame % 2),) * 3)))
        else:
            positions = scene.meshes["Thing 0"].positions * (1, 1, 1 - 0.3 * (frame % 2))
            built.scene.set_mesh(built.meshes["Thing 0"], positions=positions)

    means: dict[bool, list[float]] = {True: [], False: []}
    for seed in range(6):
        for walked in (True, False):
            live = Live(scene, start=False, samples=2)
            live.session.update(dict(seed=100 * seed))
            if walked:
                live.run()
            for frame in range(1 if walked else 12, 13):
                with live.session.edit():
                    change(live.built, frame)
                    live.built.scene.commit()
                live.session.wait()
            if not walked:
                live.run()
            image = live.session.read("diffuse_indirect")
            assert np.isfinite(image).all() and (image >= 0).all()
            means[walked].append(float(image.mean(dtype=np.float64)))
    agree(statistics_of(means[True]), statistics_of(means[False]), tolerance=0.02)
