# SPDX-License-Identifier: GPL-3.0-or-later
"""Virtual point lights against the path tracer, with many lights and no bound; what must not change the picture."""

from __future__ import annotations

import math
from typing import Any

import afterglow
import numpy as np
import pytest
from afterglow.scenes import SCENES, Camera, Description, Light, look_at, node, translate
from afterglow.scenes.native import Built
from afterglow.scenes.rooms import background, cornell_box, diffuse, furnace, sealed_box
from afterglow.scenes.shapes import box, quad
from hard_cases import Mean, agree, render

EXACT = dict(method="INSTANT_RADIOSITY", light_bound=0.0, interleave=False)


def indirect(scene: Any, repeats: int, **settings: Any) -> Mean:
    """Mean of the diffuse indirect light over independent sets of lights (or seeds), and its standard error."""
    defaults = dict(size=16, caustics_reflective=False, passes=["diffuse_indirect"])
    images = [render(scene, seed=50 + i, light_pattern=i, **{**defaults, **settings}) for i in range(repeats)]
    values = [float(image.passes["diffuse_indirect"].mean(dtype=np.float64)) for image in images]
    return Mean(float(np.mean(values)), float(np.std(values, ddof=1) / repeats**0.5))


def open_room(*lights: Light, world: Any = None) -> Description:
    """A floor, a wall and a block, open to the sky."""
    scene = Description("open_room", Camera(look_at((0.3, -4, 2), (0, 0, 0.5)), math.radians(40)))
    scene.materials.update(white=diffuse((0.7, 0.7, 0.7)), red=diffuse((0.8, 0.2, 0.1)))
    scene.add("Floor", quad((-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0)), "white")
    scene.add("Wall", quad((-2, 1.5, 0), (2, 1.5, 0), (2, 1.5, 2), (-2, 1.5, 2)), "red")
    scene.add("Block", box((-0.8, -0.3, 0.2), (0.2, 0.5, 1.0)), "white")
    scene.lights = list(lights)
    scene.world = world
    return scene


HIGH = look_at((0.6, -0.8, 3.0), (0, 0.6, 0.4))
LIGHTS = {
    "point": Light("L", "point", translate((0.6, -0.8, 2.5)), 100.0),
    "ball": Light("L", "point", translate((0.6, -0.8, 2.5)), 100.0, radius=0.3),
    "spot": Light("L", "spot", HIGH, 300.0, spot_size=0.9, spot_blend=0.5),
    "round spot": Light("L", "spot", HIGH, 300.0, radius=0.1, spot_size=0.9, spot_blend=0.5),
    "sun": Light("L", "sun", HIGH, 3.0),
    "hazy sun": Light("L", "sun", HIGH, 3.0, angle=0.5),
    "rectangle": Light("L", "area", HIGH, 100.0, shape="rectangle", size=(0.8, 0.4)),
    "ellipse": Light("L", "area", HIGH, 100.0, shape="ellipse", size=(0.8, 0.4)),
    "narrow": Light("L", "area", HIGH, 100.0, shape="rectangle", size=(0.8, 0.4), spread=1.0),
}


@pytest.mark.parametrize("name", LIGHTS)
def test_every_light_sends_the_light_that_the_path_tracer_finds(name: str) -> None:
    scene = open_room(LIGHTS[name])
    truth = indirect(scene, 4, method="PATH_TRACING", samples=128)
    found = indirect(scene, 8, samples=8, virtual_lights=2000, **EXACT)
    agree(found, truth, tolerance=0.01)
    assert found.error < 0.06 * found.value


@pytest.mark.parametrize("name", ["even", "varying"])
def test_worlds_send_light_paths(name: str) -> None:
    color: Any = (0.5, 0.7, 1.0)
    if name == "varying":
        up = node("separate", color=node("texture_coordinate").out("generated"))
        red = node("math", {"operation": "maximum"}, value=up.out("blue"), value_001=0.05)
        color = node("combine", red=red, green=0.4, blue=0.3)
    scene = open_room(world=background(color, 1.5))
    truth = indirect(scene, 4, method="PATH_TRACING", samples=256)
    found = indirect(scene, 8, samples=8, virtual_lights=2000, **EXACT)
    agree(found, truth, tolerance=0.02)


def test_emissive_meshes_send_light_from_both_sides() -> None:
    scene = cornell_box("emissive")
    truth = indirect(scene, 4, method="PATH_TRACING", samples=128, diffuse_bounces=4)
    found = indirect(scene, 8, samples=8, virtual_lights=2000, diffuse_bounces=4, **EXACT)
    agree(found, truth, tolerance=0.02)


@pytest.mark.parametrize("bounces", [1, 4])
def test_cornell_box_has_the_path_tracers_bounces(bounces: int) -> None:
    scene = cornell_box()
    truth = indirect(scene, 4, method="PATH_TRACING", samples=128, diffuse_bounces=bounces)
    found = indirect(scene, 8, samples=8, virtual_lights=2000, diffuse_bounces=bounces, **EXACT)
    agree(found, truth, tolerance=0.01)


@pytest.mark.parametrize("albedo", [0.3, 0.7])
def test_furnace(albedo: float) -> None:
    """Radiance e (1 + a + … + a^(n+1)), as the path tracer's bounce limit has it."""
    expected = sum((1 - albedo) * albedo**k for k in range(6))
    settings: dict[str, Any] = dict(size=12, samples=16, virtual_lights=2000, diffuse_bounces=4, **EXACT)
    images = [render(furnace(albedo), seed=i, light_pattern=i, **settings) for i in range(6)]
    values = [float(image.image[..., :3].mean(dtype=np.float64)) for image in images]
    error = float(np.std(values, ddof=1) / len(values) ** 0.5)
    assert abs(np.mean(values) - expected) < 4.5 * error + 2e-3


def test_more_lights_come_nearer_pixel_by_pixel() -> None:
    """With n light paths and no bound the error of pixels away from corners falls."""
    scene = cornell_box()
    settings = dict(size=24, caustics_reflective=False, passes=["diffuse_indirect"], diffuse_bounces=4)
    truth = render(scene, method="PATH_TRACING", samples=1024, **settings).passes["diffuse_indirect"]
    errors = []
    for count in (64, 1024, 16384):
        image = render(scene, samples=1, virtual_lights=count, **EXACT, **settings).passes["diffuse_indirect"]
        off = np.abs(image - truth).mean(-1) / truth.mean()
        errors.append(float(np.median(off)))
    assert errors[0] > 1.5 * errors[1] > 2.0 * errors[2]


def test_bound_only_takes_light_away() -> None:
    scene = cornell_box()
    settings: dict[str, Any] = dict(size=24, samples=1, passes=["diffuse_indirect"], virtual_lights=256, interleave=False,
                                    method="INSTANT_RADIOSITY")
    free = render(scene, light_bound=0.0, **settings).passes["diffuse_indirect"]
    bounded = render(scene, light_bound=0.5, **settings).passes["diffuse_indirect"]
    assert (bounded <= free * 1.0001 + 1e-6).all() and bounded.mean() > 0.7 * np.median(free)


def test_interleaved_lights_show_the_same_room() -> None:
    scene = cornell_box()
    settings = dict(size=48, samples=1, passes=["diffuse_indirect"], virtual_lights=256, method="INSTANT_RADIOSITY")
    whole = render(scene, interleave=False, **settings).passes["diffuse_indirect"]
    shared = render(scene, **settings).passes["diffuse_indirect"]
    assert abs(shared.mean() / whole.mean() - 1) < 0.03
    assert np.median(np.abs(shared - whole)) < 0.1 * whole.mean()


def test_threads_and_seeds_leave_the_lights_alone() -> None:
    scene = cornell_box("glossy")
    settings: dict[str, Any] = dict(size=32, method="INSTANT_RADIOSITY", passes=["diffuse_indirect"])
    one, two = (render(scene, threads=threads, samples=2, **settings) for threads in (1, 2))
    assert np.array_equal(one.image, two.image)
    # Without the pixel filter's spread nothing but direct light depends on the seed.
    settings.update(pixel_filter="GAUSSIAN", filter_width=0.01, samples=1)
    first, other = (render(cornell_box(), seed=seed, **settings).passes["diffuse_indirect"] for seed in (5, 77))
    assert np.abs(other - first).mean() < 0.02 * first.mean()


@pytest.mark.parametrize("method", ["INSTANT_RADIOSITY", "INSTANT_CACHE"])
def test_sealed_box_stays_black(method: str) -> None:
    assert render(sealed_box(), size=16, samples=2, method=method).image[..., :3].max() == 0.0


@pytest.mark.parametrize("method", ["INSTANT_RADIOSITY", "INSTANT_CACHE"])
def test_nothing_to_light_and_nothing_to_light_it(method: str) -> None:
    empty = Description("empty", Camera(look_at((0, -2, 0), (0, 0, 0))))
    assert render(empty, size=8, samples=2, method=method).image[..., :3].max() == 0.0
    dark = open_room()
    assert render(dark, size=8, samples=2, method=method).image[..., :3].max() == 0.0
    lit = open_room(LIGHTS["point"])
    for bounces in (0, 1):
        assert render(lit, size=8, samples=2, method=method, diffuse_bounces=bounces).image[..., :3].max() > 0.0
    assert render(lit, size=8, samples=1, method=method, virtual_lights=1).image.max() > 0.0


@pytest.mark.parametrize("method", ["INSTANT_RADIOSITY", "INSTANT_CACHE"])
def test_mirrors_and_glass_lead_to_the_lights(method: str) -> None:
    """Specular surfaces show the indirect light of what they mirror: means as the path tracer's, caustics off."""
    for variant in ("mirror", "glass"):
        scene = cornell_box(variant)
        settings = dict(size=24, caustics_reflective=False, caustics_refractive=False, diffuse_bounces=4)
        truth = render(scene, method="PATH_TRACING", samples=256, **settings).image[..., :3].mean()
        found = render(scene, method=method, samples=64, virtual_lights=1024, light_bound=0.1, **settings).image[..., :3].mean()
        assert abs(found / truth - 1) < 0.04, (variant, found, truth)


def test_settings_are_described() -> None:
    described = {m["id"]: m for m in afterglow.method_descriptions()}
    names = {s["name"] for s in described["INSTANT_RADIOSITY"]["settings"]}
    assert {"virtual_lights", "light_bound", "light_pattern", "interleave"} <= names
    for method in ("INSTANT_RADIOSITY", "INSTANT_CACHE"):  # what they cannot show is named where they are chosen
        assert all(word in described[method]["description"] for word in ("caustics", "corners", "short rays"))
    assert "partitions" in described["INSTANT_CACHE"]["description"] and "even within" in described["HASH_CACHE"]["description"]


def test_two_sided_translucent_surfaces() -> None:
    """Light that a thin cloth lets through is light of both methods."""
    scene = Description("cloth", Camera(look_at((0, -3, 0.5), (0, 0, 0.8)), math.radians(50)))
    scene.materials.update(cloth=node("translucent_bsdf", color=(0.8, 0.8, 0.8)), white=diffuse((0.7, 0.7, 0.7)))
    scene.add("Floor", quad((-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0)), "white")
    scene.add("Cloth", quad((-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)), "cloth")
    scene.lights = [Light("L", "area", look_at((0, 0, 2), (0, 0, 0), (0, 1, 0)), 50.0, size=(0.5, 0.5))]
    truth = indirect(scene, 4, method="PATH_TRACING", samples=256)
    found = indirect(scene, 6, samples=8, virtual_lights=2000, **EXACT)
    agree(found, truth, tolerance=0.02)


def test_neighbours_share_no_light_across_edges() -> None:
    """A table whose top sees nothing, above a lit floor and its wall: not a pixel of the top has light of them."""
    scene = Description("table", Camera(look_at((0, -1.5, 4), (0, 0, 0.5)), math.radians(35)))
    scene.materials["white"] = diffuse((0.8, 0.8, 0.8))
    scene.add("Floor", quad((-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0)), "white")
    scene.add("Wall", quad((-2, 1.5, 0), (2, 1.5, 0), (2, 1.5, 0.9), (-2, 1.5, 0.9)), "white")
    scene.add("Table", box((-0.5, -0.5, 0.8), (0.5, 0.5, 1.0)), "white")
    scene.objects[-1].pass_index = 3
    scene.lights = [Light("L", "point", translate((0.9, 0.8, 0.6)), 50.0)]
    settings: dict[str, Any] = dict(size=48, samples=1, virtual_lights=256, pixel_filter="GAUSSIAN", filter_width=0.01,
                                    passes=["diffuse_indirect", "object_index", "normal"], method="INSTANT_RADIOSITY")
    shared, whole = (render(scene, interleave=interleave, **settings).passes for interleave in (True, False))
    table = shared["object_index"][..., 0] == 3
    top = table & (shared["normal"][..., 2] > 0.9)
    floor = ~table & (shared["normal"][..., 2] > 0.9)
    assert top.sum() > 100 and whole["diffuse_indirect"][top].max() == 0.0
    assert shared["diffuse_indirect"][top].max() == 0.0
    ratio = shared["diffuse_indirect"][floor].sum(-1) / whole["diffuse_indirect"][floor].sum(-1)
    beside = np.zeros_like(table)
    beside[1:-1, 1:-1] = table[2:, 1:-1] | table[:-2, 1:-1] | table[1:-1, 2:] | table[1:-1, :-2]
    assert np.median(ratio) == pytest.approx(1, abs=0.1)
    edge = shared["diffuse_indirect"][floor & beside].sum() / whole["diffuse_indirect"][floor & beside].sum()
    assert edge == pytest.approx(1, abs=0.1)


@pytest.mark.parametrize("name", ["cornell_textured", "cornell_glossy", "textured_room", "principled"])
def test_textured_and_glossy_surfaces_send_the_light_of_their_diffuse_part(name: str) -> None:
    """Pictures, checkers, coats and gloss: what leaves their diffuse lobes is what paths find there."""
    scene = SCENES["cornell_box" if name == "principled" else name]()
    if name == "principled":
        scene.materials["white"] = node("principled", base_color=(0.7, 0.7, 0.7), roughness=0.3, coat_weight=0.5, metallic=0.2)
    built = Built(scene)
    settings: dict[str, Any] = dict(size=16, caustics_reflective=False, caustics_refractive=False, diffuse_bounces=3,
                                    passes=["diffuse_indirect", "diffuse_color"])

    def mean(repeats: int, **more: Any) -> Mean:
        passes = [render(built, seed=i, light_pattern=i, **settings, **more).passes for i in range(repeats)]
        values = [float((p["diffuse_indirect"] * p["diffuse_color"]).mean(dtype=np.float64)) for p in passes]
        return Mean(float(np.mean(values)), float(np.std(values, ddof=1) / repeats**0.5))

    truth = mean(4, method="PATH_TRACING", samples=32)
    found = mean(8, samples=1, virtual_lights=600, **EXACT)
    agree(found, truth, tolerance=0.01)
    assert found.error < 0.06 * found.value
