# SPDX-License-Identifier: GPL-3.0-or-later
"""Render passes: what each holds, and that the light passes make up the picture."""

from __future__ import annotations

import afterglow
import numpy as np
import pytest
from afterglow.scenes import Camera, Description, Light, look_at, node, translate
from afterglow.scenes.native import Built
from afterglow.scenes.rooms import background, diffuse, emission
from afterglow.scenes.shapes import quad, sphere
from hard_cases import one_quad, render

LIGHT = [f"{lobe}_{part}" for lobe in ("diffuse", "glossy", "transmission") for part in ("direct", "indirect", "color")]
LIGHT += ["emission", "environment"]
DATA = ["depth", "mist", "position", "normal", "uv", "object_index", "material_index", "albedo", "denoise_normal"]


def recombined(p: dict[str, np.ndarray]) -> np.ndarray:
    total = p["emission"] + p["environment"]
    for lobe in ("diffuse", "glossy", "transmission"):
        total = total + (p[f"{lobe}_direct"] + p[f"{lobe}_indirect"]) * p[f"{lobe}_color"]
    return total


@pytest.mark.parametrize("scene", ["cornell_box", "cornell_glass", "cornell_emissive", "cornell_mirror", "materials",
                                   "transparency", "sun_and_sky", "area_lights", "world_furnace"])
@pytest.mark.parametrize("clamp", [0.0, 0.7])
def test_light_passes_make_up_the_picture(scene: str, clamp: float) -> None:
    r = render(scene, size=24, samples=4, passes=LIGHT, sample_clamp_indirect=clamp, sample_clamp_direct=clamp)
    np.testing.assert_allclose(recombined(r.passes), r.image[..., :3], rtol=2e-4, atol=2e-5)


def test_passes_do_not_change_the_picture() -> None:
    a = render("materials", size=24, samples=4).image
    b = render("materials", size=24, samples=4, passes=LIGHT + DATA).image
    np.testing.assert_allclose(a, b, rtol=1e-5, atol=1e-6)


def plane() -> Built:
    scene = Description("plane", Camera(look_at((0, 0, 4), (0, 0, 0), (0, 1, 0)), 0.8))
    scene.materials.update(floor=diffuse((0.6, 0.4, 0.2)))
    mesh = quad((-3, -3, 0), (0, -3, 0), (0, 3, 0), (-3, 3, 0))
    mesh.uvs = np.array([(0, 0), (1, 0), (1, 1), (0, 0), (1, 1), (0, 1)], np.float32)
    scene.add("Left half", mesh, "floor")
    scene.objects[-1].pass_index = 7
    scene.world = background((1, 1, 1), 0.5)
    return Built(scene, None)


def test_data_of_the_first_surface() -> None:
    r = render(plane(), size=32, samples=64, passes=[*DATA, *LIGHT], mist=(2.0, 4.0, "linear"))
    p, y, x = r.passes, 16, 8
    assert p["depth"][y, x, 0] == pytest.approx(4.0, rel=1e-5)
    assert p["depth"][y, 24, 0] == pytest.approx(1e10)
    np.testing.assert_allclose(p["normal"][y, x], (0, 0, 1), atol=1e-5)
    position = p["position"][y, x]
    assert position[2] == pytest.approx(0, abs=1e-5) and -1 < position[0] < -0.5
    assert p["object_index"][y, x, 0] == 7 and p["object_index"][y, 24, 0] == 0
    u, v, on = p["uv"][y, x]
    assert on == pytest.approx(1) and u == pytest.approx((position[0] + 3) / 3, abs=0.02) and v == pytest.approx(0.5, abs=0.02)
    np.testing.assert_allclose(p["diffuse_color"][y, x], (0.6, 0.4, 0.2), rtol=1e-5)
    np.testing.assert_allclose(p["albedo"][y, x], (0.6, 0.4, 0.2), rtol=1e-5)
    np.testing.assert_allclose(p["environment"][y, 24], 0.5, rtol=1e-5)
    assert p["environment"][y, x].max() == 0
    np.testing.assert_allclose(p["diffuse_direct"][y, x], 0.5, rtol=0.02)  # E / π under an even sky
    distance = np.hypot(4.0, np.hypot(position[0], position[1]))
    assert p["mist"][y, x, 0] == pytest.approx((distance - 2) / 4, abs=0.01)
    assert p["mist"][y, 24, 0] == pytest.approx(1.0)


@pytest.mark.parametrize(("falloff", "power"), [("quadratic", 2.0), ("linear", 1.0), ("inverse_quadratic", 0.5)])
def test_mist_falloffs(falloff: str, power: float) -> None:
    r = render(plane(), size=16, samples=4, passes=["mist"], mist=(0.0, 8.0, falloff), pixel_filter="BOX")
    assert r.passes["mist"][8, 7, 0] == pytest.approx(0.5**power, abs=0.02)


def test_material_index_and_names() -> None:
    built = plane()
    graph = {"nodes": [{"type": "diffuse_bsdf", "name": "d", "inputs": {}}], "surface": ("link", 0, "bsdf")}
    built.scene.set_material(built.materials["floor"], graph, name="floor", pass_index=5)
    r = render(built, size=16, samples=1, passes=["material_index"])
    assert r.passes["material_index"][8, 2, 0] == 5
    assert afterglow.Session(built.scene, {"passes": ["uv"]}).passes() == ["combined", "uv", "sample_count", "error", "batches"]


def test_direct_and_indirect_are_told_apart() -> None:
    direct_only = render("cornell_box", size=24, samples=16, passes=LIGHT, max_bounces=0).passes
    full = render("cornell_box", size=24, samples=16, passes=LIGHT).passes
    assert direct_only["diffuse_indirect"].max() == 0 and full["diffuse_indirect"].mean() > 0
    ratio = direct_only["diffuse_direct"].mean() / full["diffuse_direct"].mean()
    assert ratio == pytest.approx(1.0, rel=0.02)


def test_a_mirror_shows_lamps_as_glossy_direct() -> None:
    scene = one_quad(node("glossy_bsdf", {"distribution": "sharp"}, color=(0.9, 0.9, 0.9), roughness=0.0))
    scene.world = background((1, 1, 1), 2.0)
    p = render(scene, size=8, samples=16, passes=LIGHT).passes
    np.testing.assert_allclose(p["glossy_direct"] * p["glossy_color"], 1.8, rtol=0.01)
    assert p["diffuse_direct"].max() == 0 and p["glossy_indirect"].max() == 0


def test_translucent_counts_as_diffuse_and_glass_as_both() -> None:
    scene = one_quad(node("translucent_bsdf", color=(0.7, 0.7, 0.7)))
    scene.lights = [Light("Below", "point", translate((0, 0, -1)), 50.0)]
    p = render(scene, size=8, samples=16, passes=LIGHT).passes
    assert p["diffuse_direct"].mean() > 0 and p["transmission_direct"].max() == 0
    glass = Description("glass", Camera(look_at((0, -4, 0), (0, 0, 0)), 0.5))
    glass.materials["glass"] = node("glass_bsdf", {"distribution": "ggx"}, color=(1, 1, 1), roughness=0.1, ior=1.5)
    glass.add("Ball", sphere(1.0, 48, 24), "glass")
    glass.world = background((1, 1, 1), 1.0)
    p = render(glass, size=16, samples=64, passes=LIGHT).passes
    assert p["transmission_color"][8, 8].mean() > 0.5 and p["glossy_color"][8, 8].mean() > 0.02


def test_data_passes_look_through_mostly_transparent_surfaces() -> None:
    for share, depth in ((0.8, 4.0), (0.2, 3.0)):
        scene = one_quad(diffuse((0.5, 0.5, 0.5)))
        scene.camera.transform = look_at((0, 0, 4), (0, 0, 0), (0, 1, 0))
        scene.materials["sheet"] = node("mix_shader", fac=1 - share, shader=node("transparent_bsdf", color=(1, 1, 1)),
                                        shader_001=emission(1.0))
        scene.add("Sheet", quad((-3, -3, 1), (3, -3, 1), (3, 3, 1), (-3, 3, 1)), "sheet")
        values = [render(scene, size=8, samples=1, seed=s, passes=["depth"]).passes["depth"] for s in range(8)]
        seen = {round(float(v), 3) for image in values for v in image.ravel()}
        assert depth in seen and (7 - depth) not in seen


def test_denoising_features_pass_through_mirrors() -> None:
    scene = Description("features", Camera(look_at((0, -4, 0), (0, 0, 0)), 0.2))
    scene.materials.update(mirror=node("glossy_bsdf", {"distribution": "sharp"}, color=(1, 1, 1), roughness=0.0),
                           wall=diffuse((0.1, 0.7, 0.3)))
    scene.add("Mirror", quad((-2, 0, -2), (2, 0, -2), (2, 0, 2), (-2, 0, 2)), "mirror")
    scene.add("Wall", quad((-9, -8, -9), (9, -8, -9), (9, -8, 9), (-9, -8, 9)), "wall")
    p = render(scene, size=8, samples=4, passes=["albedo", "denoise_normal", "normal"]).passes
    np.testing.assert_allclose(p["albedo"][4, 4], (0.1, 0.7, 0.3), rtol=0.02)
    np.testing.assert_allclose(np.abs(p["denoise_normal"][4, 4]), (0, 1, 0), atol=1e-3)
