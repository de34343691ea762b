# SPDX-License-Identifier: GPL-3.0-or-later
"""The hard cases of the path tracer that any method has to stand: the same tests, the caches in its place."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import hard_cases
import numpy as np
import pytest
import test_hard_cases_energy as energy
import test_hard_cases_geometry as geometry
import test_hard_cases_scale as scale
from afterglow.scenes import Camera, Description, look_at
from afterglow.scenes.rooms import background, diffuse
from afterglow.scenes.shapes import bunny

# Without those that compare pictures of one scene to the bit, or furnaces: caches that remember have tests of their own.
CASES: list[tuple[Callable[..., Any], tuple[Any, ...]]] = [
    (geometry.test_empty_scenes_render, ()),
    (geometry.test_a_scene_without_a_camera_is_seen_from_the_origin, ()),
    (geometry.test_no_light_at_all_is_black, ()),
    (geometry.test_nothing_in_view, ()),
    (geometry.test_one_triangle, ()),
    (geometry.test_an_empty_mesh_and_an_object_without_materials, ()),
    (geometry.test_non_finite_vertices_are_left_out_and_named, (np.nan,)),
    (geometry.test_indices_out_of_range_are_left_out_and_named, (2**31 - 1,)),
    (geometry.test_non_finite_corner_data, ("corner_normals", np.nan)),
    (geometry.test_singular_and_non_finite_transforms_are_left_out_and_named, (np.zeros((4, 4)),)),
    (geometry.test_scale_of_1_1_1e_6_is_a_flat_disk, ()),
    (geometry.test_needles_and_zero_area_and_duplicate_triangles, ()),
    (geometry.test_needles_as_lamps, ()),
    (geometry.test_ten_thousand_instances, ()),
    (geometry.test_extreme_light_values_are_refused_or_finite, ()),
    (geometry.test_non_finite_materials_and_worlds_stay_finite, ()),
    (geometry.test_light_beyond_the_film_is_dropped_and_counted, (1e36, False)),
    (geometry.test_odd_graphs_render_and_warn_once, ()),
    (geometry.test_removed_things_are_gone, ()),
    (energy.test_light_touching_the_wall_from_outside_stays_outside, ()),
    (energy.test_grazing_light_follows_the_cosine, ()),
    (energy.test_mirror_facing_a_mirror_ends, ()),
    (energy.test_black_materials_are_black, ()),
    (scale.test_any_frame_renders, (0,)),
    (scale.test_any_frame_renders, (-7,)),
    (scale.test_any_frame_renders, (12.5,)),
]


@pytest.mark.parametrize("method", ["HASH_CACHE", "INSTANT_CACHE"])
@pytest.mark.parametrize("case", CASES, ids=lambda case: f"{case[0].__name__[5:]}{list(case[1]) if case[1] else ''}"[:60])
def test_what_holds_for_paths_holds_for(method: str, case: tuple[Callable[..., Any], tuple[Any, ...]],
                                        monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(hard_cases, "METHOD", method)
    case[0](*case[1])


@pytest.mark.slow
def test_two_million_triangles() -> None:
    scene = Description("large", Camera(look_at((0, -3, 1), (0, 0, 0.5)), 0.7))
    scene.materials["m"] = diffuse((0.6, 0.6, 0.6))
    scene.world = background((1, 1, 1))
    scene.add("Bunny", bunny(410), "m")
    assert scene.triangle_count > 2_000_000
    built = hard_cases.Built(scene)
    truth = hard_cases.mean(built, samples=16, max_bounces=2)
    hard_cases.agree(hard_cases.mean(built, samples=16, max_bounces=2, method="HASH_CACHE"), truth, tolerance=0.01)
    assert hard_cases.render(built, samples=4, method="INSTANT_CACHE").image[..., :3].mean() > 0.8 * truth.value
