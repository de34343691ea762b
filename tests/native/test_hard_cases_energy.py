# SPDX-License-Identifier: GPL-3.0-or-later
"""Energy: furnaces at every albedo, sealed boxes, thin walls, mirrors and glass that face each other."""

import afterglow
import numpy as np
import pytest
from afterglow.scenes import node
from hard_cases import (
    Camera,
    Description,
    Light,
    ball_under_sky,
    diffuse,
    emission,
    look_at,
    mean,
    one_quad,
    quad,
    render,
    scenes,
    sphere,
    translate,
)


@pytest.mark.parametrize("albedo", [0.0, 0.1, 0.5, 0.8, 0.9])
@pytest.mark.parametrize("shape", ["sphere", "box"])
def test_furnace_shows_its_radiance(albedo: float, shape: str) -> None:
    """A closed room that emits 1 − albedo everywhere shows 1; with many bounces what is cut off is albedo^(n + 1)."""
    value, error = mean(scenes.SCENES["furnace"](albedo, 1.0, shape), samples=64, max_bounces=128, diffuse_bounces=128)
    assert abs(value - 1) < 0.005 + 3 * error
    assert error < 0.005


@pytest.mark.slow
def test_furnace_of_albedo_099_converges() -> None:
    value, error = mean(scenes.SCENES["furnace"](0.99), samples=64, max_bounces=1024, diffuse_bounces=1024)
    assert abs(value - 1) < 0.005 + 3 * error
    assert error < 0.02


def test_furnace_with_few_bounces_is_the_geometric_series() -> None:
    """Emission 1 − a, the light that is looked for at the first surface, and n bounces more give 1 − a^(n + 2)."""
    for bounces in (0, 1, 3):
        value, error = mean(scenes.SCENES["furnace"](0.8), samples=64, max_bounces=bounces, diffuse_bounces=bounces)
        assert abs(value - (1 - 0.8 ** (bounces + 2))) < 0.005 + 4 * error


@pytest.mark.parametrize("material", [
    diffuse((1.0, 1.0, 1.0)),
    diffuse((1.0, 1.0, 1.0), 1.0),
    node("glossy_bsdf", {"distribution": "sharp"}, color=(1.0, 1.0, 1.0), roughness=0.0),
    node("glossy_bsdf", {"distribution": "multi_ggx"}, color=(1.0, 1.0, 1.0), roughness=0.5),
    node("glass_bsdf", {"distribution": "sharp"}, color=(1.0, 1.0, 1.0), roughness=0.0, ior=1.5),
    node("glass_bsdf", {"distribution": "multi_ggx"}, color=(1.0, 1.0, 1.0), roughness=0.3, ior=1.5),
    node("transparent_bsdf", color=(1.0, 1.0, 1.0)),
    node("translucent_bsdf", color=(1.0, 1.0, 1.0)),
    node("principled", base_color=(1.0, 1.0, 1.0), metallic=1.0, roughness=0.4),
    node("principled", base_color=(1.0, 1.0, 1.0), roughness=0.5),
], ids=["diffuse", "oren_nayar", "mirror", "rough_mirror", "glass", "rough_glass", "transparent", "translucent", "metal",
        "principled"])
def test_white_ball_under_a_white_sky(material: scenes.Node) -> None:
    """What loses nothing vanishes; nothing may be brighter than the sky. Layers approximate, so they may lose 3 %."""
    value, error = mean(ball_under_sky(material), samples=64, repeats=4, max_bounces=64, diffuse_bounces=64, glossy_bounces=64,
                        transmission_bounces=64, transparent_max_bounces=64)
    loss = 0.03 if material.type == "principled" or material.inputs.get("roughness") else 0.005
    assert value <= 1.005 + 4 * error
    assert value >= 1 - loss - 4 * error


def test_sealed_box_stays_black() -> None:
    result = render(scenes.SCENES["sealed_box"](1e6), size=32, samples=64)
    assert result.image[..., :3].max() == 0.0


def test_light_touching_the_wall_from_outside_stays_outside() -> None:
    scene = scenes.SCENES["sealed_box"](1e6)
    scene.lights = [Light("On the wall", "point", translate((1.0, 0.2, 0.1)), 1e6, radius=0.0)]
    scene.objects = [o for o in scene.objects if o.name == "Box"]
    scene.world = None
    # A light exactly in the wall's plane may be on either side, but must not make NaN or infinite light.
    render(scene, size=32, samples=16)


@pytest.mark.parametrize("gap", [2e-4, 2e-5])
def test_thin_walls_do_not_leak(gap: float) -> None:
    result = render(scenes.SCENES["thin_walls"](gap), size=32, samples=64)
    assert result.image[..., :3].max() == 0.0


def test_light_above_a_surface_at_a_thousandth_of_its_size() -> None:
    """A point light inside, touching and just above a sphere lights the outside only where it is outside."""
    def lit(height: float) -> float:
        scene = Description("close", Camera(look_at((0, 0, 4), (0, 0, 1), (0, 1, 0)), 0.1))
        scene.materials["ball"] = diffuse((0.8, 0.8, 0.8))
        ball = sphere(1.0, 64, 32)
        ball.smooth = False
        scene.add("Ball", ball, "ball")
        scene.lights = [Light("Lamp", "point", translate((0, 0, 1 + height)), 10.0)]
        return float(render(scene, size=48, samples=64, pixel_filter="BOX", filter_width=1.0).image[..., :3].mean())

    assert lit(-0.01) == 0.0
    assert lit(0.001) > 0.0 and np.isfinite(lit(1e-5)) and np.isfinite(lit(0.0))


def test_grazing_light_follows_the_cosine() -> None:
    """A sun 0.1° above the plane gives strength · albedo / π · cos 89.9°."""
    scene = one_quad(diffuse((0.8, 0.8, 0.8)))
    angle = np.radians(89.9)
    scene.lights = [Light("Sun", "sun", look_at((np.sin(angle), 0, np.cos(angle)), (0, 0, 0)), 1000.0, angle=0.0)]
    value, _ = mean(scene, samples=4, repeats=2, max_bounces=0, diffuse_bounces=0)
    assert value == pytest.approx(1000 * 0.8 / np.pi * np.cos(angle), rel=2e-3)


def test_mirror_facing_a_mirror_ends() -> None:
    mirror = node("glossy_bsdf", {"distribution": "sharp"}, color=(1.0, 1.0, 1.0), roughness=0.0)
    scene = Description("mirrors", Camera(look_at((0, -0.5, 0), (0.1, 1, 0)), 1.0))
    scene.materials.update(mirror=mirror, lamp=emission(1.0))
    scene.add("Front", quad((-9, 1, -9), (9, 1, -9), (9, 1, 9), (-9, 1, 9)), "mirror")
    scene.add("Back", quad((9, -1, -9), (-9, -1, -9), (-9, -1, 9), (9, -1, 9)), "mirror")
    scene.add("Lamp", sphere(0.1, 12, 6), "lamp", transform=translate((0.4, 0.3, 0)))
    few = render(scene, samples=8, max_bounces=4, glossy_bounces=4).image[..., :3].mean()
    many = render(scene, samples=8, max_bounces=256, glossy_bounces=256).image[..., :3].mean()
    assert many >= few > 0


def test_glass_in_glass_is_clear_under_a_white_sky() -> None:
    glass = node("glass_bsdf", {"distribution": "sharp"}, color=(1.0, 1.0, 1.0), roughness=0.0, ior=1.5)
    scene = ball_under_sky(glass)
    scene.add("Inner", sphere(0.5, 64, 32), "ball")
    scene.add("Innermost", sphere(0.25, 64, 32), "ball")
    value, error = mean(scene, samples=64, max_bounces=128, transmission_bounces=128, glossy_bounces=128)
    assert abs(value - 1) < 0.005 + 4 * error


def test_albedo_exactly_one_ends_and_adds_nothing() -> None:
    value, error = mean(scenes.SCENES["furnace"](1.0, 1.0), samples=16, max_bounces=64, diffuse_bounces=64)
    assert value == 0.0 and error == 0.0
    scene = scenes.make("cornell_box")
    for name in ("white", "red", "green"):
        scene.materials[name] = diffuse((1.0, 1.0, 1.0))
    assert render(scene, samples=8, max_bounces=64, diffuse_bounces=64).image.max() < 1e4


def test_black_materials_are_black() -> None:
    scene = ball_under_sky(diffuse((0.0, 0.0, 0.0)))
    image = render(scene, samples=16, pixel_filter="BOX", filter_width=1.0).image
    assert image[12, 12, :3].max() == 0.0


def test_a_bigger_light_of_the_same_power_gives_the_same_far_light() -> None:
    """Point lights conserve their power whatever their radius."""
    values = []
    for radius in (0.0, 0.01, 0.2):
        scene = one_quad()
        scene.lights = [Light("Lamp", "point", translate((0, 0, 30)), 1e5, radius=radius)]
        values.append(mean(scene, samples=16, repeats=3, max_bounces=0, diffuse_bounces=0).value)
    np.testing.assert_allclose(values, values[0], rtol=5e-3)


def test_versions_name_the_libraries() -> None:
    assert {"embree", "tbb"} <= set(afterglow.versions())
