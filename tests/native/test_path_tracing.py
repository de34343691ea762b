# SPDX-License-Identifier: GPL-3.0-or-later
"""The path tracer against sums that can be written down: irradiance, furnaces, bounce limits, strategies that must agree."""

from __future__ import annotations

import math
from typing import Any

import afterglow
import numpy as np
import pytest
from afterglow.scenes import Camera, Description, Light, look_at, make, node, translate
from afterglow.scenes.native import Built
from afterglow.scenes.rooms import background, diffuse, emission, furnace
from afterglow.scenes.shapes import quad, sphere
from hard_cases import agree, mean, one_quad, render

GLOSSY_WHITE = node("glossy_bsdf", {"distribution": "sharp"}, color=(0.5, 0.5, 0.5), roughness=0.0)


def glass(color: float = 1.0) -> Any:
    return node("refraction_bsdf", {"distribution": "sharp"}, color=(color,) * 3, roughness=0.0, ior=1.0)


def transparent(color: tuple[float, float, float]) -> Any:
    return node("transparent_bsdf", color=color)


def above(z: float, size: float = 3.0, down: bool = False) -> Any:
    corners = [(-size, -size, z), (size, -size, z), (size, size, z), (-size, size, z)]
    return quad(*(corners[::-1] if down else corners))


def test_parallel_square_lights_a_point_by_its_form_factor() -> None:
    """E = π L F with F of a point to a parallel rectangle over its corner, four times (Howell, configuration B-3)."""
    scene = one_quad(diffuse((0.5, 0.5, 0.5)), angle=0.01)
    scene.materials["lamp"] = emission(3.0)
    scene.add("Lamp", above(2.5, 1.0, down=True), "lamp")
    a = b = 1.0 / 2.5
    ra, rb = math.sqrt(1 + a * a), math.sqrt(1 + b * b)
    quarter = (a / ra * math.atan(b / ra) + b / rb * math.atan(a / rb)) / (2 * math.pi)
    expected = 0.5 * 3.0 * 4 * quarter
    value, error = mean(scene, samples=256, size=8, max_bounces=0)
    assert abs(value - expected) < 4 * error + 1e-4 * expected
    assert error < 0.01 * expected


@pytest.mark.parametrize("height", [0.01, 0.1])
@pytest.mark.parametrize("kind", ["mesh", "area"])
def test_a_lamp_close_above_a_surface_lights_it(kind: str, height: float) -> None:
    """Its light comes in so flat that a shadow ray's rounding must neither reach the lamp's own face nor miss it."""
    scene = one_quad(diffuse((0.5, 0.5, 0.5)), angle=0.01)
    half, x = 0.25, 1.0
    if kind == "mesh":
        scene.materials["lamp"] = emission(3.0)
        corners = [(x - half, -half, height), (x - half, half, height), (x + half, half, height), (x + half, -half, height)]
        scene.add("Lamp", quad(*corners), "lamp")
    else:
        scene.lights.append(Light("Lamp", "area", translate((x, 0, height)), 3.0 * math.pi * 4 * half**2,
                                  size=(2 * half, 2 * half)))
    grid = (np.arange(400) + 0.5) / 400 * 2 * half - half
    distance2 = (x + grid[:, None]) ** 2 + grid**2 + height**2
    expected = 0.5 / math.pi * 3.0 * 4 * half**2 * float((height**2 / distance2**2).mean())
    value, error = mean(scene, samples=256, size=8, max_bounces=0)
    assert abs(value - expected) < 4 * error + 2e-3 * expected
    assert error < 0.02 * expected


@pytest.mark.parametrize("place", [0.0, 2.7484, -20.0])
def test_light_bounces_between_two_half_transparent_sheets(place: float) -> None:
    """A wide lamp behind two sheets close together, each transparent by t and reflecting a: the viewer's side shows
    t² (1 + a² F / (1 − a²)) of its radiance, wherever all that stands."""
    t, color, lamp, gap = 0.4, 0.8, 0.4, 2.4e-4
    scene = Description("sheets", Camera(look_at((0, place - 6, 0), (0, place, 0)), 0.002))
    scene.materials["sheet"] = node("mix_shader", fac=1 - t, shader=transparent((1, 1, 1)), shader_001=diffuse((color,) * 3))
    scene.materials["lamp"] = emission(1.0)
    for name, y, size in (("Front", place, 0.5), ("Back", place + gap, 0.5), ("Lamp", place + gap + lamp, 1.0)):
        corners = [(-size, y, -size), (size, y, -size), (size, y, size), (-size, y, size)]
        scene.add(name, quad(*corners), "lamp" if name == "Lamp" else "sheet")
    side = 1.0 / lamp
    root = math.sqrt(1 + side * side)
    seen = 4 * 2 * side / root * math.atan(side / root) / (2 * math.pi)
    a = (1 - t) * color
    expected = t * t * (1 + a * a * seen / (1 - a * a))
    value, error = mean(scene, samples=4096, size=8, transparent_max_bounces=64)
    assert abs(value - expected) < 4 * error + 2e-3 * expected
    assert error < 0.01 * expected


@pytest.mark.parametrize("strategies", [True, False])
def test_a_sphere_light_shines_as_a_point_does(strategies: bool) -> None:
    """Where all of it stands above the horizon, however near: no ray may count its far side, too."""
    scene = one_quad(diffuse((0.5, 0.5, 0.5)), angle=0.01)
    built = Built(scene)
    built.scene.add_light("point", translate((0.8, 0.3, 0.7)), name="Lamp", color=(1, 1, 1), power=4 * math.pi, radius=0.6,
                          soft_falloff=False, multiple_importance=strategies)
    built.scene.commit()
    distance2 = 0.8**2 + 0.3**2 + 0.7**2
    expected = 0.5 / math.pi * 0.7 / distance2**1.5
    value, error = mean(built, samples=256, size=8, max_bounces=0)
    assert abs(value - expected) < 4 * error + 1e-3 * expected
    assert error < 0.01 * expected


@pytest.mark.parametrize("albedo", [0.0, 0.3, 0.8])
@pytest.mark.parametrize("bounces", [0, 1, 3])
def test_bounce_limit_cuts_the_furnace_series(albedo: float, bounces: int) -> None:
    """n bounces let n + 1 scatterings be lit: radiance = e (1 + a + … + a^(n+1))."""
    e = 1 - albedo
    expected = sum(e * albedo**k for k in range(bounces + 2))
    for limits in ({"max_bounces": bounces, "diffuse_bounces": 100}, {"max_bounces": 100, "diffuse_bounces": bounces}):
        value, error = mean(furnace(albedo), samples=64, size=12, **limits)
        assert abs(value - expected) < 4.5 * error + 1e-3


def test_deep_furnace_shows_its_radiance() -> None:
    value, error = mean(furnace(0.9), samples=128, size=12, max_bounces=1024, diffuse_bounces=1024)
    assert abs(value - 1) < 4.5 * error + 2e-3
    assert error < 0.01


def mirror_room(kind: str) -> Description:
    scene = furnace(0.5)
    surface = GLOSSY_WHITE if kind == "glossy" else glass(0.5)
    scene.materials["furnace"] = node("add_shader", shader=surface, shader_001=emission(0.5))
    return scene


@pytest.mark.parametrize("bounces", [0, 2])
def test_glossy_limit(bounces: int) -> None:
    """A mirror's image is looked at once more than the limit, as with diffuse surfaces."""
    value, error = mean(mirror_room("glossy"), samples=64, size=12, max_bounces=100, glossy_bounces=bounces)
    assert abs(value - sum(0.5 * 0.5**k for k in range(bounces + 2))) < 4.5 * error + 1e-4


@pytest.mark.parametrize("bounces", [0, 1, 4])
def test_transmission_limit(bounces: int) -> None:
    """Panes that refract without bending, one behind the other: one pane more than the limit still shows what is behind."""
    for panes in range(1, 7):
        scene = one_quad(emission(1.0))
        scene.materials["pane"] = glass()
        for i in range(panes):
            scene.add(f"Pane {i}", above(0.1 + 0.1 * i), "pane")
        value = render(scene, samples=4, size=8, max_bounces=100, transmission_bounces=bounces).image[..., 0].mean()
        assert value == pytest.approx(1.0 if panes <= bounces + 1 else 0.0, abs=1e-3), panes


@pytest.mark.parametrize("limit", [0, 1, 4])
def test_transparent_limit(limit: int) -> None:
    """Straight passages have a limit of their own and do not count as bounces."""
    for panes in range(1, 7):
        scene = one_quad(emission(1.0))
        scene.materials["pane"] = transparent((1, 1, 1))
        for i in range(panes):
            scene.add(f"Pane {i}", above(0.1 + 0.1 * i), "pane")
        value = render(scene, samples=64, size=8, max_bounces=0, transparent_max_bounces=limit).image[..., 0].mean()
        assert value == pytest.approx(1.0 if panes <= limit + 1 else 0.0, abs=1e-3), panes


def test_coloured_panes_tint_camera_and_shadow_rays_alike() -> None:
    """A lamp behind two tinted panes: once seen through them, once lighting a surface through them."""
    tint = (0.9, 0.5, 0.2)
    scene = one_quad(diffuse((0.8, 0.8, 0.8)))
    scene.lights = [Light("Sun", "sun", look_at((0, 0, 5), (0, 0, 0), (0, 1, 0)), 2.0)]
    bare = render(scene, samples=16, size=8).image[..., :3].mean((0, 1))
    scene.materials["pane"] = transparent(tint)
    scene.add("Pane", above(3.0), "pane")
    scene.add("Pane below", above(2.5), "pane")
    tinted = render(scene, samples=16, size=8).image[..., :3].mean((0, 1))
    np.testing.assert_allclose(tinted / bare, np.square(tint), rtol=1e-4)
    seen = one_quad(emission(1.0))
    seen.materials["pane"] = transparent(tint)
    seen.add("Pane", above(1.0), "pane")
    image = render(seen, samples=16, size=8).image[..., :3].mean((0, 1))
    np.testing.assert_allclose(image, tint, rtol=1e-4)


def test_half_transparent_surface_mixes() -> None:
    scene = one_quad(emission(1.0))
    half = node("mix_shader", fac=0.25, shader=transparent((1, 1, 1)), shader_001=emission(5.0))
    scene.materials["half"] = half
    scene.add("Half", above(1.0), "half")
    image = render(scene, samples=512, size=8).image[..., 0]
    assert image.mean() == pytest.approx(0.75 * 1 + 0.25 * 5, rel=5e-3)


def lit_plane(strategy: str, lamp: str) -> Description | Built:
    """A glossy and a diffuse half under one light; `strategy` says how the light may be found."""
    scene = Description("strategies", Camera(look_at((0, -4, 3), (0, 0, 0)), 0.8))
    rough = node("glossy_bsdf", {"distribution": "ggx"}, color=(0.8, 0.8, 0.8), roughness=0.4)
    scene.materials.update(left=diffuse((0.8, 0.8, 0.8)), right=rough)
    scene.add("Left", quad((-3, -3, 0), (0, -3, 0), (0, 3, 0), (-3, 3, 0)), "left")
    scene.add("Right", quad((0, -3, 0), (3, -3, 0), (3, 3, 0), (0, 3, 0)), "right")
    if lamp == "mesh":
        scene.materials["lamp"] = emission(4.0)
        scene.add("Lamp", translate_mesh(above(1.5, 1.0, down=True), (0, 1.5, 0)), "lamp")
        built = Built(scene, None)
        if strategy == "surface":
            handle = built.materials["lamp"]
            graph = {"nodes": [{"type": "emission", "name": "e", "inputs": {"color": (1.0, 1.0, 1.0), "strength": 4.0}}],
                     "surface": ("link", 0, "shader")}
            built.scene.set_material(handle, graph, name="lamp", emission_sampling=False)
        return built
    if lamp == "world":
        scene.world = background((1, 0.8, 0.6), 1.0)
        return scene
    transform = look_at((0, 1.5, 1.5), (0, 1.5, 0), (0, 1, 0)) if lamp == "area" else translate((0, 1.5, 1.5))
    size = dict(shape="rectangle", size=(2, 2)) if lamp == "area" else dict(radius=0.5)
    scene.lights = [Light("Lamp", lamp, transform, 100.0, **size)]
    built = Built(scene, None)
    if strategy == "light":
        built.scene.set_light(built.lights["Lamp"], multiple_importance=False, visibility=afterglow.ALL_RAYS & ~afterglow.CAMERA)
    else:
        built.scene.set_light(built.lights["Lamp"], visibility=afterglow.ALL_RAYS & ~afterglow.CAMERA)
    return built


def translate_mesh(mesh: Any, by: tuple[float, float, float]) -> Any:
    mesh.positions = mesh.positions + np.array(by, np.float32)
    return mesh


def mean_of(scene: Any, **settings: Any) -> Any:
    return mean(scene, size=16, samples=256, repeats=6, **settings)


def test_emissive_mesh_by_surface_samples_alone_agrees() -> None:
    agree(mean_of(lit_plane("both", "mesh")), mean_of(lit_plane("surface", "mesh")))


@pytest.mark.parametrize("lamp", ["area", "point"])
def test_lamp_by_light_samples_alone_agrees(lamp: str) -> None:
    agree(mean_of(lit_plane("both", lamp)), mean_of(lit_plane("light", lamp)))


def test_weighting_both_strategies_is_less_noisy() -> None:
    both, surface = mean_of(lit_plane("both", "mesh")), mean_of(lit_plane("surface", "mesh"))
    assert both.error < surface.error


def test_roulette_does_not_change_the_mean() -> None:
    """Long paths through grey walls: the sum of light is that of the series, whatever roulette ends."""
    value, error = mean(furnace(0.5), samples=256, size=12, max_bounces=64, diffuse_bounces=64)
    assert abs(value - 1) < 4.5 * error + 1e-3


def test_clamping_holds_each_sample_below_its_limit() -> None:
    scene = one_quad(diffuse((0.8, 0.8, 0.8)))
    scene.lights = [Light("Sun", "sun", look_at((0, 0, 5), (0, 0, 0), (0, 1, 0)), 100.0)]
    bright = render(scene, samples=4, size=8).image[..., :3]
    clamped = render(scene, samples=4, size=8, sample_clamp_direct=2.0).image[..., :3]
    assert bright.mean() > 20 and clamped.max() == pytest.approx(2.0, rel=1e-5)
    np.testing.assert_array_equal(render(scene, samples=4, size=8, sample_clamp_indirect=2.0).image[..., :3], bright)


def test_caustics_switch_drops_glossy_surfaces_after_a_diffuse_bounce() -> None:
    scene = furnace(0.5)
    scene.materials["furnace"] = node("add_shader", shader=diffuse((0.5, 0.5, 0.5)), shader_001=emission(0.5))
    with_caustics = render(mirror_room("glossy"), samples=8, size=8, caustics_reflective=False).image.mean()
    assert with_caustics > 0.9  # mirrors seen directly are no caustics
    room = one_quad(diffuse((0.8, 0.8, 0.8)))
    room.materials["mirror"] = node("glossy_bsdf", {"distribution": "sharp"}, color=(1, 1, 1), roughness=0.0)
    room.add("Mirror", above(2.5, 3.0, down=True), "mirror")
    room.world = background((1, 1, 1), 1.0)
    on = render(room, samples=64, size=8, caustics_reflective=True).image[..., 0].mean()
    off = render(room, samples=64, size=8, caustics_reflective=False).image[..., 0].mean()
    assert off < 0.9 * on


@pytest.mark.parametrize(("ray", "hidden"), [("CAMERA", True), ("DIFFUSE", False), ("SHADOW", False)])
def test_visibility_hides_from_one_kind_of_ray(ray: str, hidden: bool) -> None:
    """A bright ceiling over a plane: hidden from the camera it still lights; hidden from diffuse rays it is still seen."""
    scene = Description("visibility", Camera(look_at((0, -4, 1), (0, 0, 1)), 1.2))
    scene.materials.update(floor=diffuse((0.8, 0.8, 0.8)), lamp=emission(1.0))
    scene.add("Floor", above(0.0), "floor")
    scene.add("Lamp", above(2.0, 3.0, down=True), "lamp")
    built = Built(scene, None)
    built.scene.set_instances(built.instances["Lamp"], visibility=afterglow.ALL_RAYS & ~getattr(afterglow, ray))
    image = render(built, samples=64, size=32).image[..., 0]
    full = render(scene, samples=64, size=32).image[..., 0]
    lamp_seen, floor_lit = image[24:].max() > 0.5, image[:8].mean()
    assert lamp_seen != hidden
    if ray == "DIFFUSE":
        assert floor_lit < 0.05 * full[:8].mean()
    else:
        assert floor_lit == pytest.approx(full[:8].mean(), rel=0.05)


def test_a_sheet_hidden_from_shadow_rays_casts_none() -> None:
    scene = one_quad(diffuse((0.8, 0.8, 0.8)))
    scene.lights = [Light("Sun", "sun", look_at((0, 0, 5), (0, 0, 0), (0, 1, 0)), 2.0)]
    bare = render(scene, samples=4, size=8).image[..., 0].mean()
    scene.materials["black"] = diffuse((0, 0, 0))
    scene.add("Sheet", above(3.0), "black")
    built = Built(scene, None)
    assert render(built, samples=4, size=8).image[..., 0].mean() == 0.0
    built.scene.set_instances(built.instances["Sheet"], visibility=afterglow.ALL_RAYS & ~afterglow.SHADOW)
    assert render(built, samples=4, size=8).image[..., 0].mean() == pytest.approx(bare, rel=1e-5)


def test_transparent_film_and_holdout_cut_holes() -> None:
    scene = Description("alpha", Camera(look_at((0, -4, 0), (0, 0, 0)), 0.8))
    scene.materials["ball"] = diffuse((0.8, 0.8, 0.8))
    scene.add("Ball", sphere(1.0, 32, 16), "ball")
    scene.world = background((1, 1, 1), 1.0)
    opaque = render(scene, samples=16, size=32).image
    assert (opaque[..., 3] == 1).all()
    film = render(scene, samples=16, size=32, film_transparent=True).image
    assert film[0, 0, 3] == 0 and (film[0, 0, :3] == 0).all() and film[16, 16, 3] == 1
    edge = (film[..., 3] > 0.05) & (film[..., 3] < 0.95)
    assert edge.any() and (film[edge][:, :3] <= film[edge][:, 3:] + 1e-3).all()  # premultiplied
    built = Built(scene, None)
    built.scene.set_instances(built.instances["Ball"], holdout=True)
    held = render(built, samples=16, size=32, film_transparent=True).image
    assert held[16, 16].tolist() == [0, 0, 0, 0]


def test_exposure_scales_light_and_leaves_alpha() -> None:
    a = render("cornell_box", samples=4, size=16).image
    b = render("cornell_box", samples=4, size=16, film_exposure=4.0).image
    np.testing.assert_allclose(b[..., :3], 4 * a[..., :3], rtol=1e-5)
    np.testing.assert_array_equal(a[..., 3], b[..., 3])


@pytest.mark.parametrize("scene", ["cornell_glossy", "transparency"])
def test_threads_do_not_change_a_bit(scene: str) -> None:
    passes = ["diffuse_indirect", "glossy_direct", "depth", "normal"]
    one, two = (render(scene, size=24, samples=8, threads=n, passes=passes) for n in (1, 2))
    for name in one.passes:
        np.testing.assert_array_equal(one.passes[name], two.passes[name])


@pytest.mark.parametrize("scene", ["cornell_emissive", "cornell_box", "world_furnace"])
@pytest.mark.parametrize("change", ["passes", "material"])
def test_what_a_kernel_leaves_out_does_not_change_the_picture(scene: str, change: str) -> None:
    """Constant Lambert materials have a walk of their own; another pass, or a material that reads its point and that nothing
    wears, brings the general one. Rounding may send a path elsewhere, but hardly ever."""
    plain, other = make(scene), make(scene)
    if change == "material":
        other.materials["unused"] = diffuse(node("texture_coordinate").out("generated"))
    a = render(plain, samples=16, size=32).image
    b = render(other, samples=16, size=32, passes=["emission"] if change == "passes" else []).image
    assert np.isclose(a, b, rtol=1e-4, atol=1e-6).mean() > 0.99


def test_a_lone_light_is_one_of_two() -> None:
    """With another light that hardly shines, behind a wall, nothing is lone, and lights are chosen: the mean is the same."""
    other = make("cornell_emissive")
    other.materials["faint"] = emission(1e-3)
    other.add("Faint", quad((-1, 3, 0), (1, 3, 0), (1, 3, 2), (-1, 3, 2)), "faint")
    agree(mean("cornell_emissive", repeats=6, size=32), mean(other, repeats=6, size=32))


def test_seeds_differ_and_repeat() -> None:
    a, b, c = (render("cornell_box", size=16, samples=2, seed=s).image for s in (1, 2, 1))
    np.testing.assert_array_equal(a, c)
    assert (a != b).any()
    agree(mean("cornell_box", repeats=4, size=16), mean("cornell_box", repeats=8, size=16, frame=7))


def test_depth_of_field_keeps_what_is_in_focus_sharp() -> None:
    def edge_width(distance: float) -> int:
        scene = Description("lens", Camera(look_at((0, -4, 0), (0, 0, 0)), 0.5, aperture_radius=0.2, focus_distance=distance))
        scene.materials["half"] = emission(1.0)
        scene.add("Half", quad((0, 0, -3), (3, 0, -3), (3, 0, 3), (0, 0, 3)), "half")
        row = render(scene, samples=64, size=48).image[24, :, 0]
        return int(((row > 0.02) & (row < 0.98)).sum())

    assert edge_width(4.0) <= 3 < edge_width(2.0)


def test_light_near_a_large_surface_is_not_hidden_by_itself() -> None:
    """A lamp 0.01 above a square of 6 × 6 lights the floor beside it: shadow rays start above the floor, and must end on
    the lamp, not inside of it."""
    gap, half, beside = 0.01, 0.2, 0.23
    scene = one_quad(diffuse((0.5, 0.5, 0.5)))
    scene.camera = Camera(translate((beside, 0, 1)), angle=0.004)
    scene.materials["lamp"] = emission(3.0)
    scene.add("Lamp", quad(*[(x * half, y * half, gap) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]), "lamp")
    grid = (np.arange(2000) + 0.5) / 1000 - 1
    d2 = (grid[:, None] * half - beside) ** 2 + (grid[None, :] * half) ** 2 + gap**2
    irradiance = 3.0 * (gap**2 / d2**2).mean() * (2 * half) ** 2
    value, error = mean(scene, samples=256, size=8, max_bounces=0)
    assert abs(value - 0.5 * irradiance / math.pi) < 4 * error + 1e-2 * value
    assert error < 0.02 * value
