# SPDX-License-Identifier: GPL-3.0-or-later
"""Every lobe: the density integrates to what sampling reaches, sampled directions follow it (χ²), the sampled weight is the
value over the density, no white material returns more than it got, and lossless ones return all."""

from __future__ import annotations

import afterglow._native as native
import numpy as np
import pytest
from bsdf_tools import DIRECTIONS, albedo_by_sampling, chi_square, graph, sphere_integral

WHITE = (1.0, 1.0, 1.0)
SMOOTH = {
    "diffuse": graph("diffuse_bsdf", color=WHITE),
    "oren_nayar": graph("diffuse_bsdf", color=WHITE, roughness=0.9),
    "oren_nayar_old": graph("diffuse_bsdf", {"version": 1}, color=WHITE, roughness=0.9),
    "translucent": graph("translucent_bsdf", color=WHITE),
    "sheen": graph("sheen_bsdf", color=WHITE, roughness=0.6),
    "glossy": graph("glossy_bsdf", {"distribution": "ggx"}, color=WHITE, roughness=0.5),
    "glossy_multi": graph("glossy_bsdf", {"distribution": "multi_ggx"}, color=WHITE, roughness=0.8),
    "glossy_anisotropic": graph("glossy_bsdf", {"distribution": "ggx"}, color=WHITE, roughness=0.6, anisotropy=0.6),
    "metal": graph("metallic_bsdf", base_color=WHITE, edge_tint=WHITE, roughness=0.6),
    "metal_physical": graph("metallic_bsdf", {"fresnel": "physical_conductor", "distribution": "ggx"}, roughness=0.6),
    "glass": graph("glass_bsdf", {"distribution": "ggx"}, color=WHITE, roughness=0.6, ior=1.5),
    "glass_multi": graph("glass_bsdf", {"distribution": "multi_ggx"}, color=WHITE, roughness=0.8, ior=1.5),
    "glass_1": graph("glass_bsdf", {"distribution": "ggx", "version": 1}, color=WHITE, roughness=0.6, ior=1.5),
    "refraction": graph("refraction_bsdf", color=WHITE, roughness=0.6, ior=1.3),
    "principled": graph("principled", base_color=WHITE, roughness=0.6),
    "principled_metal": graph("principled", base_color=WHITE, metallic=1.0, roughness=0.7),
    "principled_glass": graph("principled", base_color=WHITE, transmission_weight=1.0, roughness=0.6),
    "principled_all": graph("principled", base_color=(0.8, 0.5, 0.3), metallic=0.3, transmission_weight=0.3, roughness=0.6,
                            coat_weight=0.7, coat_roughness=0.5, coat_tint=(0.9, 0.8, 0.7), sheen_weight=0.5,
                            diffuse_roughness=0.5),
    "principled_1": graph("principled", {"version": 1}, base_color=(0.8, 0.5, 0.3), metallic=0.2, transmission_weight=0.3,
                          roughness=0.6, coat_weight=0.7, coat_roughness=0.6, sheen_weight=0.5),
}
LOSSLESS = {"diffuse": 0.0, "oren_nayar": 0.003, "translucent": 0.0, "glossy_multi": 0.01, "metal": 0.01, "glass_multi": 0.01,
            "principled_metal": 0.01}
BRIGHTENS = {"principled_1"}  # as Blender before 4.0 does: sheen and clearcoat were added, not layered


@pytest.mark.parametrize("name", SMOOTH)
@pytest.mark.parametrize("direction", DIRECTIONS)
@pytest.mark.parametrize("backfacing", [False, True])
def test_samples_follow_the_density(name: str, direction: str, backfacing: bool) -> None:
    if backfacing and name not in ("glass", "glass_1", "refraction", "principled_glass"):
        pytest.skip("only refraction knows its sides")
    probability = chi_square(SMOOTH[name], DIRECTIONS[direction], backfacing=backfacing)
    assert probability > 1e-4, f"χ² test: a chance of {probability:.2g} that samples follow the density"


@pytest.mark.parametrize("name", SMOOTH)
@pytest.mark.parametrize("direction", DIRECTIONS)
def test_sampled_value_is_the_evaluated_one(name: str, direction: str) -> None:
    rng = np.random.default_rng(5)
    wo = np.array([DIRECTIONS[direction]], np.float32)
    sampled = native.bsdf_sample(SMOOTH[name], wo, rng.random((2000, 3), dtype=np.float32))
    ok = sampled["valid"]
    assert not sampled["delta"].any()
    value, density = native.bsdf_evaluate(SMOOTH[name], wo, sampled["direction"][ok])
    np.testing.assert_allclose(value, sampled["value"][ok], rtol=2e-3, atol=1e-6)
    np.testing.assert_allclose(density, sampled["density"][ok], rtol=2e-3, atol=1e-6)
    assert np.isfinite(value).all() and (value >= 0).all() and np.isfinite(density).all()


@pytest.mark.parametrize("name", SMOOTH)
@pytest.mark.parametrize("direction", DIRECTIONS)
def test_furnace(name: str, direction: str) -> None:
    mean, error = albedo_by_sampling(SMOOTH[name], DIRECTIONS[direction], 100_000)
    if name not in BRIGHTENS:
        assert (mean <= 1.0 + 0.005 + 4.0 * error).all(), f"returns {mean} ± {error} of a white furnace"
    if name in LOSSLESS:
        slack = LOSSLESS[name] + 4.0 * error + 1e-5
        assert (np.abs(mean - 1.0) <= slack).all(), f"returns {mean} ± {error} of a white furnace"


@pytest.mark.parametrize("name", ["diffuse", "glossy", "sheen", "glossy_anisotropic", "principled_all", "translucent"])
def test_integral_of_value_is_the_sampled_albedo(name: str) -> None:
    wo = DIRECTIONS["slanted"]
    mean, error = albedo_by_sampling(SMOOTH[name], wo, 200_000)
    integral = sphere_integral(lambda wi: native.bsdf_evaluate(SMOOTH[name], np.array([wo], np.float32), wi)[0])
    np.testing.assert_allclose(integral, mean, atol=float(5 * error.max()) + 2e-3)


@pytest.mark.parametrize("name", ["diffuse", "oren_nayar", "glossy", "glossy_anisotropic", "metal_physical"])
def test_reciprocity(name: str) -> None:
    rng = np.random.default_rng(3)
    a, b = (rng.normal(size=(500, 3)).astype(np.float32) for _ in range(2))
    for v in (a, b):
        v[:, 2] = np.abs(v[:, 2]) + 0.05
        v /= np.linalg.norm(v, axis=1, keepdims=True)
    there = native.bsdf_evaluate(SMOOTH[name], a, b)[0] / b[:, 2:]
    back = native.bsdf_evaluate(SMOOTH[name], b, a)[0] / a[:, 2:]
    np.testing.assert_allclose(there, back, rtol=5e-3, atol=1e-4)


def test_mirror_glass_and_straight_refraction_are_deltas() -> None:
    wo = np.array([[0.6, 0.0, 0.8]], np.float32)
    u = np.random.default_rng(0).random((4000, 3), dtype=np.float32)
    mirror = native.bsdf_sample(graph("glossy_bsdf", color=(0.7, 0.7, 0.7), roughness=0.0), wo, u)
    assert mirror["delta"].all()
    np.testing.assert_allclose(mirror["direction"], np.tile([-0.6, 0.0, 0.8], (4000, 1)), atol=1e-6)
    np.testing.assert_allclose(mirror["value"] / mirror["density"][:, None], 0.7, rtol=1e-5)
    glass = native.bsdf_sample(graph("glass_bsdf", color=WHITE, roughness=0.0, ior=1.5), wo, u)
    through = glass["transmitted"]
    sine = 0.6 / 1.5
    np.testing.assert_allclose(glass["direction"][through][:, 0], -sine, atol=1e-5)
    cos_t = np.sqrt(1 - sine**2)
    rs, rp = (0.8 - 1.5 * cos_t) / (0.8 + 1.5 * cos_t), (cos_t - 1.5 * 0.8) / (cos_t + 1.5 * 0.8)
    reflectance = 0.5 * (rs**2 + rp**2)
    chance = 1 - through.mean()
    assert abs(chance - reflectance) < 5 * np.sqrt(reflectance / len(u))
    np.testing.assert_allclose(glass["value"] / glass["density"][:, None], 1.0, rtol=1e-4)
    straight = native.bsdf_sample(graph("glass_bsdf", color=WHITE, roughness=0.4, ior=1.0), wo, u)
    np.testing.assert_allclose(straight["direction"], np.tile([-0.6, 0.0, -0.8], (4000, 1)), atol=1e-4)


def test_total_internal_reflection() -> None:
    wo = np.array([[0.8, 0.0, 0.6]], np.float32)
    u = np.random.default_rng(0).random((1000, 3), dtype=np.float32)
    inside = native.bsdf_sample(graph("glass_bsdf", color=WHITE, roughness=0.0, ior=1.5), wo, u, backfacing=True)
    assert inside["valid"].all() and not inside["transmitted"].any()


def test_caustics_off_keeps_the_diffuse_share() -> None:
    wo, wi = np.array([[0, 0, 1]], np.float32), np.array([[0.6, 0, 0.8]], np.float32)
    assert native.bsdf_evaluate(SMOOTH["glossy"], wo, wi, drop_glossy=True)[0].max() == 0.0
    assert native.bsdf_evaluate(SMOOTH["diffuse"], wo, wi, drop_glossy=True)[0].min() > 0.2
    layered = graph("principled", base_color=WHITE, metallic=0.25, roughness=0.6)
    value, density = native.bsdf_evaluate(layered, wo, wi, drop_glossy=True, drop_refractive=True)
    np.testing.assert_allclose(value, 0.75 * 0.8 / np.pi, rtol=1e-5)  # metal gone, dielectric gone without its albedo
    np.testing.assert_allclose(density, 0.8 / np.pi, rtol=1e-5)
    half = native.bsdf_sample(SMOOTH["glass"], wo, np.random.default_rng(0).random((500, 3), dtype=np.float32),
                              drop_refractive=True)
    assert not half["transmitted"][half["valid"]].any()


def test_diffuse_kernel_equals_the_general_one() -> None:
    rng = np.random.default_rng(1)
    wi = rng.normal(size=(200, 3)).astype(np.float32)
    wo = np.array([[0.3, 0.2, 0.93]], np.float32)
    for general, special in zip(native.bsdf_evaluate(SMOOTH["diffuse"], wo, wi),
                                native.bsdf_evaluate(SMOOTH["diffuse"], wo, wi, diffuse_only=True), strict=True):
        np.testing.assert_allclose(general, special, rtol=1e-6)


@pytest.mark.parametrize("roughness", [0.0, 0.01, 0.03, 0.1, 1.0])
@pytest.mark.parametrize("kind", ["glossy_bsdf", "glass_bsdf", "refraction_bsdf", "principled"])
def test_extremes_stay_finite(kind: str, roughness: float) -> None:
    rng = np.random.default_rng(9)
    material = graph(kind, roughness=roughness)
    wo = rng.normal(size=(3000, 3)).astype(np.float32)
    wo[:, 2] = np.abs(wo[:, 2])
    wo[:500, 2] = 1e-4  # grazing
    for backfacing in (False, True):
        s = native.bsdf_sample(material, wo, rng.random((3000, 3), dtype=np.float32), backfacing=backfacing)
        ok = s["valid"]
        weight = s["value"][ok] / s["density"][ok][:, None]
        assert np.isfinite(weight).all() and (weight >= 0).all() and (s["density"][ok] > 0).all()
        np.testing.assert_allclose(np.linalg.norm(s["direction"][ok], axis=1), 1.0, atol=1e-4)
        assert ((s["direction"][ok][:, 2] < 0) == s["transmitted"][ok]).all()


# Glossy Color of a black Principled of index 1.5, read from Cycles 5.0.1: by roughness, cosines 3/15, 6/15 … 1
GLOSSY_COLOR = {
    0.4: (0.18897797, 0.1057993, 0.061876837, 0.043923046, 0.039063577),
    0.8: (0.06746452, 0.04494339, 0.033167277, 0.027026208, 0.023987072),
    1.0: (0.044960145, 0.02872878, 0.020829631, 0.016453454, 0.013786418),
}


@pytest.mark.parametrize("roughness", GLOSSY_COLOR)
def test_the_color_of_a_rough_dielectric_is_that_of_cycles(roughness: float) -> None:
    black = graph("principled", base_color=(0.0, 0.0, 0.0), roughness=roughness, ior=1.5)
    cosine = np.arange(3, 16, 3) / 15.0
    incoming = np.stack([np.sqrt(1 - cosine**2), np.zeros(5), cosine], -1).astype(np.float32)
    up = np.array([[0, 0, 1]], np.float32)
    shown = native.evaluate_graph(black, {"position": np.zeros((5, 3), np.float32), "normal": up, "face_normal": up,
                                          "incoming": incoming, "uv": np.zeros((1, 2), np.float32)})
    np.testing.assert_allclose(shown["glossy"][:, 0], GLOSSY_COLOR[roughness], rtol=0.01)
