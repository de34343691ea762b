# SPDX-License-Identifier: GPL-3.0-or-later
"""Node graphs: every node against values that Blender itself gave, folding against running, the rules of conversion, closures
mixed and shared, and graphs that nobody should make but somebody will."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import afterglow._native as native
import numpy as np
import pytest

REFERENCE = json.loads((Path(__file__).parent / "data" / "nodes_of_blender.json").read_text())
GRID = REFERENCE["grid"]


def node(kind: str, params: dict[str, Any] | None = None, **inputs: Any) -> dict[str, Any]:
    return {"type": kind, "name": kind, "params": params or {}, "inputs": inputs}


def link(index: int, output: str) -> tuple[str, int, str]:
    return ("link", index, output)


def emitting(*nodes: dict[str, Any], output: str) -> dict[str, Any]:
    """The graph of these nodes whose last one's output is emitted."""
    count = len(nodes)
    return {"nodes": [*nodes, node("emission", color=link(count - 1, output))], "surface": link(count, "emission")}


def emission(graph: dict[str, Any], points: dict[str, Any] | None = None, **options: Any) -> np.ndarray:
    return native.evaluate_graph(graph, points or {"position": np.zeros((1, 3), np.float32)}, **options)["emission"]


def grid_points(at: list[int]) -> np.ndarray:
    axis = (np.arange(GRID) + 0.5) / GRID * 2 - 1
    return np.stack([*np.meshgrid(axis, axis), np.full((GRID, GRID), 0.3)], -1).reshape(-1, 3).astype(np.float32)[at]


def name_of(case: dict[str, Any]) -> str:
    return "-".join([case["type"], *(str(v) for v in case["params"].values()), case["output"]])


@pytest.mark.parametrize("case", REFERENCE["cases"], ids=name_of)
def test_node_gives_what_blender_gives(case: dict[str, Any]) -> None:
    inputs = {key: link(0, "position") if value == "P" else tuple(value) if isinstance(value, list) else value
              for key, value in case["inputs"].items()}
    graph = emitting(node("geometry"), node(case["type"], case["params"], **inputs), output=case["output"])
    expected = np.array(case["rgb"])
    for fold in (True, False):
        result = native.evaluate_graph(graph, {"position": grid_points(case["at"])}, fold=fold)
        assert not result["warnings"]
        np.testing.assert_allclose(result["emission"], expected, rtol=0.012, atol=0.001)


@pytest.mark.parametrize("case", [c for c in REFERENCE["cases"] if "P" in c["inputs"].values()], ids=name_of)
def test_folding_equals_running(case: dict[str, Any]) -> None:
    """The same node with a constant place: computed while compiling, and at the hit."""
    point = grid_points([7 * GRID + 3])[0]
    inputs = {key: tuple(map(float, point)) if value == "P" else tuple(value) if isinstance(value, list) else value
              for key, value in case["inputs"].items()}
    graph = emitting(node(case["type"], case["params"], **inputs), output=case["output"])
    folded = native.evaluate_graph(graph, {}, fold=True)
    run = native.evaluate_graph(graph, {}, fold=False)
    assert folded["folded"] and folded["instructions"] <= 1 and not run["folded"]  # 0: black, nothing is emitted
    np.testing.assert_array_equal(folded["emission"], run["emission"])


def test_conversions() -> None:
    color = (0.2, 0.5, 0.9)
    as_value = emitting(node("rgb", color=color), node("math", {"operation": "add"}, value=link(0, "color"), value_001=0.0),
                        output="value")
    np.testing.assert_allclose(emission(as_value)[0], 0.2126 * 0.2 + 0.7152 * 0.5 + 0.0722 * 0.9, rtol=1e-5)
    mean = emitting(node("combine", {"mode": "xyz"}, red=0.2, green=0.5, blue=0.9),
                    node("math", {"operation": "add"}, value=link(0, "vector"), value_001=0.0), output="value")
    np.testing.assert_allclose(emission(mean)[0], (0.2 + 0.5 + 0.9) / 3, rtol=1e-5)
    direct = {"nodes": [node("rgb", color=color)], "surface": link(0, "color")}
    np.testing.assert_allclose(emission(direct)[0], color, rtol=1e-6)  # a colour at a shader's place emits


def test_mix_and_add_share_their_parts() -> None:
    white, red = node("diffuse_bsdf", color=(1, 1, 1)), node("diffuse_bsdf", color=(1, 0, 0))
    mixed = {"nodes": [white, red, node("mix_shader", fac=0.25, shader=link(0, "shader"), shader_001=link(1, "shader"))],
             "surface": link(2, "shader")}
    result = native.evaluate_graph(mixed, {})
    np.testing.assert_allclose(result["diffuse"][0], (1.0, 0.75, 0.75), rtol=1e-6)
    assert result["lobes"][0] == 1  # two Lambert lobes of one normal are one
    chain = [node("diffuse_bsdf", color=(0.5, 0.5, 0.5))]
    for k in range(60):  # each adds the one before to itself, halved: 2^60 paths, one weight
        chain.append(node("transparent_bsdf", color=(0, 0, 0)))
        chain.append(node("add_shader", shader=link(max(0, 3 * k), "shader"), shader_001=link(max(0, 3 * k), "shader")))
        chain.append(node("mix_shader", fac=0.5, shader=link(len(chain) - 2, "shader"),
                          shader_001=link(len(chain) - 1, "shader")))
    result = native.evaluate_graph({"nodes": chain, "surface": link(len(chain) - 1, "shader")}, {})
    np.testing.assert_allclose(result["diffuse"][0], 0.5, rtol=1e-5)


def test_principled_alpha_and_emission() -> None:
    graph = {"nodes": [node("principled", alpha=0.25, emission_color=(1, 0.5, 0), emission_strength=4.0)],
             "surface": link(0, "shader")}
    result = native.evaluate_graph(graph, {})
    np.testing.assert_allclose(result["transparency"][0], 0.75, rtol=1e-6)
    np.testing.assert_allclose(result["emission"][0], (1.0, 0.5, 0.0), rtol=1e-6)


def test_light_path_tells_rays_apart() -> None:
    graph = emitting(node("light_path"), output="is_camera_ray")
    assert emission(graph, kind=1)[0, 0] == 1.0 and emission(graph, kind=4)[0, 0] == 0.0


@pytest.mark.parametrize("size", [0.3, 3.0])
def test_bump_bends_by_the_slope(size: float) -> None:
    """A height that rises with x by `slope`: the normal leans back by that slope."""
    slope = 0.4
    graph = {"nodes": [node("geometry"), node("separate", {"mode": "xyz"}, color=link(0, "position")),
                       node("math", {"operation": "multiply"}, value=link(1, "red"), value_001=slope),
                       node("bump", height=link(2, "value"), strength=1.0, distance=1.0),
                       node("diffuse_bsdf", normal=link(3, "normal"))], "surface": link(4, "shader")}
    place = np.array([[size, 0.1, 0.0]], np.float32)
    normal = native.evaluate_graph(graph, {"position": place})["normal"][0]
    expected = np.array([-slope, 0.0, 1.0]) / math.hypot(1.0, slope)
    np.testing.assert_allclose(normal, expected, atol=2e-3)


def test_fresnel_and_layer_weight() -> None:
    cosine = 0.6
    incoming = {"incoming": np.array([[0.8, 0.0, cosine]], np.float32)}
    eta = 1.5
    g = math.sqrt(eta**2 - 1 + cosine**2)
    expected = 0.5 * ((g - cosine) / (g + cosine))**2 * (1 + ((cosine * (g + cosine) - 1) / (cosine * (g - cosine) + 1))**2)
    np.testing.assert_allclose(emission(emitting(node("fresnel", ior=eta), output="fac"), incoming)[0], expected, rtol=1e-4)
    facing = emission(emitting(node("layer_weight", blend=0.5), output="facing"), incoming)[0]
    np.testing.assert_allclose(facing, 1 - cosine, rtol=1e-4)


def test_color_ramp_and_curves() -> None:
    table = np.array([[0, 0, 0, 1], [1, 0.5, 0, 0.5]], np.float32)
    for interpolate, expected in ((True, 0.75), (False, 0.0)):
        ramp = emitting(node("color_ramp", {"table": table, "interpolate": interpolate}, fac=0.75), output="color")
        np.testing.assert_allclose(emission(ramp)[0, 0], expected, atol=1e-6)
    curve = emitting(node("float_curve", {"table": np.array([0.0, 2.0], np.float32), "range": np.array([0.0, 1.0], np.float32),
                                          "extrapolate": True}, value=1.5, fac=1.0), output="value")
    np.testing.assert_allclose(emission(curve)[0, 0], 3.0, rtol=1e-5)


# Graphs that nobody should make


def finite(result: dict[str, Any]) -> None:
    for key in ("emission", "transparency", "diffuse", "glossy", "transmission", "normal"):
        assert np.isfinite(result[key]).all(), key
        if key != "normal":
            assert (result[key] >= 0).all(), key


def test_cycle_is_cut_and_told() -> None:
    graph = {"nodes": [node("math", value=link(1, "value")), node("math", value=link(0, "value")),
                       node("emission", strength=link(0, "value"))], "surface": link(2, "shader")}
    result = native.evaluate_graph(graph, {})
    finite(result)
    assert any("cycle" in text for text in result["warnings"])
    itself = {"nodes": [node("add_shader", shader=link(0, "shader"), shader_001=link(0, "shader"))], "surface": link(0, "shader")}
    assert native.evaluate_graph(itself, {})["warnings"]


def test_unknown_node_passes_its_input_through() -> None:
    graph = emitting(node("rgb", color=(0.1, 0.2, 0.3)), node("teapot", lid=link(0, "color")), output="tea")
    result = native.evaluate_graph(graph, {})
    np.testing.assert_allclose(result["emission"][0], (0.1, 0.2, 0.3), rtol=1e-6)
    assert len(result["warnings"]) == 1 and "teapot" in result["warnings"][0]


@pytest.mark.parametrize("bad", [float("nan"), float("inf"), -1e30, 1e38])
@pytest.mark.parametrize("kind", ["principled", "diffuse_bsdf", "glossy_bsdf", "glass_bsdf", "emission", "sheen_bsdf",
                                  "metallic_bsdf", "refraction_bsdf", "transparent_bsdf"])
def test_constants_that_are_no_numbers(kind: str, bad: float) -> None:
    names = ("color", "base_color", "roughness", "ior", "metallic", "alpha", "strength", "coat_weight", "coat_roughness",
             "sheen_weight", "transmission_weight", "emission_strength", "specular_ior_level", "anisotropy", "normal")
    rng = np.random.default_rng(0)
    for name in names:
        value = (bad, bad, bad) if name in ("color", "base_color", "normal") else bad
        graph = {"nodes": [node(kind, **{name: value})], "surface": link(0, "shader")}
        finite(native.evaluate_graph(graph, {}))
        sampled = native.bsdf_sample(graph, np.array([[0.6, 0, 0.8]], np.float32), rng.random((64, 3), dtype=np.float32))
        ok = sampled["valid"]
        assert np.isfinite(sampled["value"][ok]).all() and (sampled["value"][ok] >= 0).all(), name
        assert np.isfinite(sampled["density"][ok]).all(), name


def test_patterns_far_away_stay_finite() -> None:
    far = {"position": np.array([[1e30, -1e30, 3e9], [np.inf, 0, 0], [np.nan, 1, 2], [1e-30, 0, 0]], np.float32)}
    for kind, output in (("noise_texture", "color"), ("voronoi_texture", "distance"), ("wave_texture", "fac"),
                         ("brick_texture", "color"), ("checker_texture", "color"), ("magic_texture", "color"),
                         ("white_noise_texture", "color"), ("gradient_texture", "fac")):
        graph = emitting(node("geometry"), node(kind, vector=link(0, "position")), output=output)
        finite(native.evaluate_graph(graph, far))


def test_missing_inputs_links_and_nodes() -> None:
    finite(native.evaluate_graph({"nodes": [], "surface": None}, {}))
    for kind in ("principled", "mix_shader", "add_shader", "bump", "normal_map", "color_ramp", "image_texture", "mix", "holdout"):
        finite(native.evaluate_graph({"nodes": [node(kind)], "surface": link(0, "shader")}, {}))
    with pytest.raises(native.InvalidInput):
        native.evaluate_graph({"nodes": [node("emission", color=link(7, "color"))], "surface": link(0, "shader")}, {})


def test_ten_thousand_nodes_in_a_row_and_side_by_side() -> None:
    deep = [node("geometry")]
    for k in range(10_000):
        deep.append(node("vector_math", {"operation": "add"}, vector=link(k, "vector" if k else "position"),
                         vector_001=(1e-4, 0, 0)))
    graph = emitting(*deep, output="vector")
    np.testing.assert_allclose(emission(graph)[0, 0], 1.0, rtol=1e-3)
    wide = [node("diffuse_bsdf", color=(k % 7 / 7, 0.5, 0.5)) for k in range(5000)]
    for k in range(4999):
        wide.append(node("mix_shader", fac=0.5, shader=link(k, "shader"), shader_001=link(5000 + k - 1 if k else 1, "shader")))
    finite(native.evaluate_graph({"nodes": wide, "surface": link(9998, "shader")}, {}))


def test_a_tree_too_large_is_grey_and_told() -> None:
    values = [node("geometry")]
    for k in range(3000):  # each different, all alive at the end
        values.append(node("math", {"operation": "sine"}, value=link(0, "position")) | {"name": str(k)})
        values[-1] = node("math", {"operation": "add"}, value=link(0, "position"), value_001=float(k))
    lobes = [node("glossy_bsdf", roughness=link(k + 1, "value")) for k in range(3000)]
    nodes = values + lobes
    first = len(values)
    for k in range(2999):
        nodes.append(node("add_shader", shader=link(first + k + 1, "shader"),
                          shader_001=link(first + 3000 + k - 1 if k else first, "shader")))
    result = native.evaluate_graph({"nodes": nodes, "surface": link(len(nodes) - 1, "shader")}, {})
    finite(result)
    assert any("too large" in text for text in result["warnings"])
