# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes that should not be, under virtual lights: instant radiosity against the path tracer, the cache against it."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import afterglow
import numpy as np
import pytest
from afterglow.scenes import SCENES, Camera, Description, Light, look_at, scale, translate
from afterglow.scenes.native import Built
from afterglow.scenes.rooms import diffuse, furnace
from afterglow.scenes.shapes import sphere
from hard_cases import Mean, agree, render
from test_hash_cache_hard_scenes import ODD, needles, one_triangle, room, two_rooms

PATHS: dict[str, Any] = dict(size=16, diffuse_bounces=4, max_bounces=12, caustics_reflective=False, caustics_refractive=False,
                             passes=["diffuse_indirect", "diffuse_color"])
LIGHTS: dict[str, Any] = {**PATHS, "virtual_lights": 400, "interleave": False, "samples": 1}
EVERY: dict[str, Any] = {**LIGHTS, "method": "INSTANT_RADIOSITY"}
RECORDS: dict[str, Any] = {**LIGHTS, "method": "INSTANT_CACHE"}
FINE = 0.0005  # the finest spacing of records
METHODS = ("INSTANT_RADIOSITY", "INSTANT_CACHE")

# Without diffuse light from other surfaces there is nothing to compare, and three of 400 lights are alive under a grazing sun.
SCENES_WITH_LIGHT: dict[str, Callable[[], Description]] = {
    **{name: make for name, make in ODD.items() if name not in ("one_triangle", "thin_walls", "specks")},
    "needles": partial(needles, 100),
}
MORE: dict[str, dict[str, Any]] = dict(
    grazing_sun=dict(virtual_lights=1500),
    ten_thousand_instances=dict(light_bound=2.0, light_compensation=32),  # all light comes from nearby
)


def statistics_of(values: Any) -> Mean:
    return Mean(float(np.mean(values)), float(np.std(values, ddof=1) / len(values) ** 0.5))


def indirect(scene: Any, repeats: int, **settings: Any) -> np.ndarray:
    """Means of the diffuse indirect light, one for each set of lights (or seed). Times its colour: without it, pixels of several
    surfaces depend on the number of samples."""
    built = scene if isinstance(scene, Built) else Built(scene)
    passes = [render(built, seed=50 + i, light_pattern=i, **settings).passes for i in range(repeats)]
    return np.array([(p["diffuse_indirect"] * p["diffuse_color"]).mean(dtype=np.float64) for p in passes])


@pytest.mark.parametrize("name", SCENES_WITH_LIGHT)
def test_odd_scenes_have_the_path_tracers_light(name: str) -> None:
    """Without a bound all lights together bring what paths find; fine records bring what all lights bring; and the bound that
    is the default takes a fifth at most, however long a needle is."""
    built = Built(SCENES_WITH_LIGHT[name]())
    truth = statistics_of(indirect(built, 4, **{**PATHS, "samples": 64}))
    agree(statistics_of(indirect(built, 8, **{**EVERY, "light_bound": 0.0, **MORE.get(name, {})})), truth, tolerance=0.01)
    if name in MORE:
        return
    bounded, cached = indirect(built, 3, **EVERY), indirect(built, 3, cache_accuracy=FINE, **RECORDS)
    assert abs(cached / bounded - 1).max() < 0.003
    assert bounded.mean() > 0.8 * truth.value - 4.5 * truth.error


def test_one_triangle_lights_nothing_else() -> None:
    for settings in (EVERY, RECORDS):
        assert indirect(one_triangle(), 2, **settings).max() == 0.0


@pytest.mark.parametrize("albedo", [0.0, 0.5, 0.9, 0.99])
@pytest.mark.parametrize("method", METHODS)
def test_furnace_shows_its_radiance(method: str, albedo: float) -> None:
    """Of at most 64 bounces, the last of which hang on one path each."""
    bounces, built = 64, Built(furnace(albedo, shape="box"))
    settings = dict(size=8, samples=1, virtual_lights=1000, light_bound=0.0, interleave=False, cache_accuracy=FINE, method=method,
                    diffuse_bounces=bounces, max_bounces=bounces)
    values = [render(built, light_pattern=i, seed=i, **settings).image[..., :3].mean(dtype=np.float64) for i in range(12)]
    found = statistics_of(values)
    assert abs(found.value - (1 - albedo ** (bounces + 2))) < 4.5 * found.error + 0.005 and found.error < 0.06


@pytest.mark.parametrize("method", METHODS)
def test_a_million_units(method: str) -> None:
    """A room of a million units (a power of two, for the bound goes in steps of its roots), and one as far from the origin."""
    settings = {**LIGHTS, "method": method}
    here, scene = indirect(room(), 3, **settings), room()
    far = indirect(scene.moved((1e6, -6e5, 3e5)), 3, **settings)
    large = indirect(scene.scaled(2.0**20), 3, **settings)
    assert abs(far / here - 1).max() < 0.01 and abs(large / here - 1).max() < 0.01


def lamp_above_a_ball(method: str, height: float) -> float:
    """The brightest pixel outside of a closed ball whose lamp stands so high above it; the inside was seen first."""
    scene = Description("close", Camera(look_at((0, 0, 0.5), (0, 0.1, 1)), 1.5))
    ball = sphere(1.0, 64, 32)
    ball.smooth = False
    scene.materials["ball"] = diffuse((0.8, 0.8, 0.8))
    scene.add("Ball", ball, "ball")
    scene.lights = [Light("Lamp", "point", translate((0, 0, 1 + height)), 10.0)]
    built = Built(scene)
    inside = render(built, method=method, size=16, samples=2).image[..., :3].max()
    scene.camera = Camera(look_at((0, 0.1, 4), (0, 0, 1)), 0.1)
    built.set_camera((16, 16), 0)
    outside = render(built, method=method, size=16, samples=2).image[..., :3].max()
    if abs(height) >= 1e-3:
        assert (inside > 0.0) == (height < 0)
    return float(outside)


@pytest.mark.parametrize("method", METHODS)
def test_a_lamp_inside_touching_and_just_above_a_surface(method: str) -> None:
    assert lamp_above_a_ball(method, -0.01) == 0.0 and lamp_above_a_ball(method, 0.001) > 0.0
    assert math.isfinite(lamp_above_a_ball(method, 0.0)) and math.isfinite(lamp_above_a_ball(method, 1e-5))


def test_a_ten_millionth_of_a_billionth_beside_the_bright_room() -> None:
    """The dark room has a lamp of 1e-8, its neighbour one of 1e8; as many paths begin at each where both are named alike."""
    settings = {**LIGHTS, "virtual_lights": 1200, "light_bound": 0.0}
    for method in METHODS:
        alone, both = (statistics_of(indirect(two_rooms(powers), 4, **settings, method=method))
                       for powers in ((1e-8, 0.0), (1e-8, 1e8)))
        assert alone.value > 1e-12
        agree(both, alone, tolerance=0.02)


@pytest.mark.parametrize("method", METHODS)
def test_nothing_in_view(method: str) -> None:
    scene = room()
    scene.camera.transform = look_at((0, 0, 9), (0, 0, 18), (0, 1, 0))
    assert render(scene, size=8, samples=1, method=method).image[..., :3].max() == 0.0


@pytest.mark.parametrize("frame", [0, -7, 12.5])
@pytest.mark.parametrize("method", METHODS)
def test_any_frame_renders(method: str, frame: float) -> None:
    for name in ("kite", "wobbling_cylinder"):
        assert render(SCENES[name](), frame=frame, size=12, samples=1, method=method).image.max() > 0


def test_records_of_negative_and_sub_frames_equal_fresh_ones() -> None:
    """A cache that goes through frames backwards and between frames."""
    built = Built(SCENES["wobbling_cylinder"](24, 24), 1)
    session = afterglow.Session(built.scene, dict(method="INSTANT_CACHE", width=16, height=16, samples=1, cache_verify=True))
    session.start()
    for frame in (0, -7, 12.5, 12.75):
        session.wait()
        with session.edit():
            built.move_to(frame)
    session.wait()
    values = session.statistics()["values"]
    assert values["resets"] == 1 and values["verified_records"] > 10 and values["verified_differing"] == 0


@pytest.mark.parametrize("method", ["PATH_TRACING", *METHODS])
def test_settings_that_are_not_named_are_the_defaults(method: str) -> None:
    """Whatever an earlier render of the same scene was told."""
    built, settings = Built(room()), dict(width=12, height=12, samples=1, method=method, diffuse_bounces=2)
    before = afterglow.render(built.scene, **settings).image
    afterglow.render(built.scene, **settings, max_bounces=1, light_bound=0.0, virtual_lights=10, sample_clamp_indirect=0.01)
    assert np.array_equal(afterglow.render(built.scene, **settings).image, before)


def test_a_thing_far_away_takes_no_light_from_a_room() -> None:
    """The bound goes by where lights are, and not by all that there is."""
    far = room()
    far.add("Far", sphere(1.0, 8, 4), "red", transform=translate((0, 5000, 0)) @ scale((10.0,) * 3))
    near, other = (statistics_of(indirect(scene, 6, **EVERY)) for scene in (room(), far))
    assert near.value > other.value > 0.8 * near.value
