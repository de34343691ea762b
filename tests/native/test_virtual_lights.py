# SPDX-License-Identifier: GPL-3.0-or-later
"""Where light paths begin: they bring what the path tracer finds, are worth something to the camera, and stay where they are."""

from __future__ import annotations

import math
from typing import Any

import afterglow
import numpy as np
import pytest
from afterglow.scenes import Camera, Description, Light, Object, look_at, node, rotate, translate
from afterglow.scenes.native import Built, graph
from afterglow.scenes.rooms import background, diffuse
from afterglow.scenes.shapes import box, join, quad, sphere
from hard_cases import Mean, agree, render

SETTINGS: dict[str, Any] = dict(size=16, passes=["diffuse_indirect"], caustics_reflective=False, diffuse_bounces=3)


def windowed_room(*, sun: bool = True, sky: bool = True) -> Description:
    """A room of 4 × 4 × 2.4 m below a wide flat roof; a ball within and one window."""
    scene = Description("windowed_room", Camera(look_at((1.5, -1.5, 1.5), (-1.5, 1.0, 0.8)), math.radians(60)))
    scene.materials.update(white=diffuse((0.7, 0.7, 0.7)), ball=diffuse((0.7, 0.3, 0.2)))
    walls = join(
        quad((-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0)), quad((-5, 5, 2.4), (5, 5, 2.4), (5, -5, 2.4), (-5, -5, 2.4)),
        quad((-2, 2, 0), (2, 2, 0), (2, 2, 2.4), (-2, 2, 2.4)), quad((2, -2, 0), (-2, -2, 0), (-2, -2, 2.4), (2, -2, 2.4)),
        quad((-2, -2, 0), (-2, 2, 0), (-2, 2, 2.4), (-2, -2, 2.4)), quad((2, 2, 0), (2, -2, 0), (2, -2, 0.8), (2, 2, 0.8)),
        quad((2, 2, 0.8), (2, 0.6, 0.8), (2, 0.6, 2.4), (2, 2, 2.4)),
        quad((2, -0.6, 0.8), (2, -2, 0.8), (2, -2, 2.4), (2, -0.6, 2.4)),
    )
    scene.add("Walls", walls, "white")
    scene.add("Ball", sphere(0.25, 24, 12), "ball", transform=translate((-0.8, 0.6, 0.3)))
    scene.add("Shed", box((-4.8, -4.8, 0), (-3.0, -3.0, 1.5)), "white")
    if sun:
        scene.lights = [Light("Sun", "sun", look_at((5, 0.4, 1.2), (0, 0, 0)), 20.0, angle=0.02)]
    if sky:
        scene.world = background((0.5, 0.7, 1.0), 1.0)
    return scene


def indirect(scene: Any, repeats: int, **settings: Any) -> Mean:
    images = [render(scene, seed=50 + i, light_pattern=i, **{**SETTINGS, **settings}) for i in range(repeats)]
    values = [float(image.passes["diffuse_indirect"].mean(dtype=np.float64)) for image in images]
    return Mean(float(np.mean(values)), float(np.std(values, ddof=1) / repeats**0.5))


@pytest.mark.parametrize(("sun", "sky"), [(True, False), (False, True), (True, True)])
def test_suns_and_skies_through_a_window_bring_the_path_tracers_light(sun: bool, sky: bool) -> None:
    """Beginnings are chosen where light matters, and their density is known: no bias; and they are worth something."""
    scene = windowed_room(sun=sun, sky=sky)
    truth = indirect(scene, 4, method="PATH_TRACING", samples=256)
    exact = dict(method="INSTANT_RADIOSITY", light_bound=0.0, interleave=False, samples=4)
    found = indirect(scene, 12, virtual_lights=1000, **exact)
    agree(found, truth, tolerance=0.02)
    assert found.error < 0.1 * found.value
    image = render(scene, **{**SETTINGS, **exact, "virtual_lights": 1000})
    assert image.statistics["values"]["virtual_lights"] > 500


class Live:
    def __init__(self, **settings: Any) -> None:
        self.built = Built(windowed_room())
        fixed = dict(method="INSTANT_CACHE", width=24, height=24, samples=1, virtual_lights=256, cache_verify=True,
                     diffuse_bounces=3)
        self.session = afterglow.Session(self.built.scene, {**fixed, **settings})
        self.session.start()
        self.session.wait()

    def look(self, position: Any, at: Any) -> dict[str, Any]:
        def change() -> None:
            self.built.description.camera.transform = look_at(position, at)
            self.built.set_camera((24, 24), 0)

        return self.edit(change)

    def edit(self, change: Any) -> dict[str, Any]:
        with self.session.edit():
            change()
            self.built.scene.commit()
        self.session.wait()
        found = self.session.statistics()
        return {**found["values"], **{f"{kind}_rays": count for kind, count in found["rays"].items()}}


def test_lights_stay_while_a_view_turns_and_follow_it_into_another_place() -> None:
    live = Live()
    before = live.look((1.2, -1.2, 1.2), (0, 0, 1))["path_rays"]
    for turn in np.linspace(0, 2, 5):
        numbers = live.look((1.2 + 0.1 * turn, -1.2, 1.2), (1.2 - math.cos(turn), -1.2 + math.sin(turn), 1.1))
        assert numbers["path_rays"] == before and numbers["verified_differing"] == 0
    away = live.look((-1.6, 1.7, 0.5), (0, 0, 1))
    assert away["path_rays"] > before and 0 < away["lights_moved"] and away["verified_differing"] == 0


def test_an_object_that_moves_leaves_most_lights_where_they_are() -> None:
    live = Live()
    for step in range(1, 5):
        numbers = live.edit(lambda step=step: live.built.scene.set_transforms(
            live.built.instances["Ball"], (translate((-0.8 + 0.05 * step, 0.6, 0.3)) @ rotate(0.2 * step))[None]))
        assert numbers["lights_moved"] < 0.15 * 256 and numbers["verified_differing"] == 0, numbers["lights_moved"]


def test_threads_leave_beginnings_alone() -> None:
    images = [render(windowed_room(), **{**SETTINGS, "method": "INSTANT_CACHE", "samples": 2, "threads": threads}).image
              for threads in (1, 2)]
    assert np.array_equal(*images)


@pytest.mark.parametrize(("method", "scene"), [("INSTANT_RADIOSITY", "corner"), ("INSTANT_CACHE", "corner"),
                                               ("INSTANT_RADIOSITY", "slats")])
def test_short_rays_bring_back_what_the_bound_takes(method: str, scene: str) -> None:
    """Corners and thin things have the path tracer's light again, and without short rays they have much less."""
    made = corner() if scene == "corner" else slats()
    settings: dict[str, Any] = dict(diffuse_bounces=2, max_bounces=2, samples=8)  # the lights count translucence as a bounce
    truth = indirect(made, 4, method="PATH_TRACING", **{**settings, "samples": 256})
    wide: dict[str, Any] = dict(method=method, virtual_lights=256, light_bound=4.0, **settings)
    without, found = (indirect(made, 10, light_compensation=rays, **wide) for rays in (0, 64))
    agree(found, truth, tolerance=0.02)
    assert without.value < 0.85 * truth.value and found.error < 0.06 * truth.value


def corner() -> Description:
    """Where two walls and the floor of a lit box meet."""
    scene = Description("corner", Camera(look_at((-0.4, -0.4, 0.6), (-1, -1, 0)), math.radians(40)))
    scene.materials["white"] = diffuse((0.7, 0.7, 0.7))
    scene.add("Room", box((-1, -1, 0), (1, 1, 2), inward=True), "white")
    scene.lights = [Light("L", "area", look_at((0, 0, 1.9), (0, 0, 0), (0, 1, 0)), 25.0, size=(0.6, 0.6))]
    return scene


def slats() -> Description:
    """Translucent slats, a millimetre thick and a few centimetres apart, in the sun."""
    scene = Description("slats", Camera(look_at((1.0, 0, 0.5), (0, 0, 0.5)), math.radians(40)))
    scene.materials.update(slat=node("mix_shader", fac=0.4, shader=diffuse((0.8, 0.8, 0.8)),
                                     shader_001=node("translucent_bsdf", color=(0.8, 0.8, 0.8))), white=diffuse((0.7, 0.7, 0.7)))
    scene.meshes["Slat"] = box((-0.03, -0.6, -0.0005), (0.03, 0.6, 0.0005))
    places = [translate((0, 0, 0.05 * i)) @ rotate(0.7, "y") for i in range(20)]
    scene.objects.append(Object("Slat", "Slat", np.array(places), ("slat",)))
    scene.add("Floor", quad((-2, -2, -0.3), (2, -2, -0.3), (2, 2, -0.3), (-2, 2, -0.3)), "white")
    scene.lights = [Light("Sun", "sun", look_at((-5, 1.0, 3.5), (0, 0, 0)), 10.0, angle=0.01)]
    return scene


def test_records_with_short_rays_equal_fresh_ones_after_edits() -> None:
    live = Live(light_compensation=8)
    built, scene = live.built, live.built.scene
    edits = [
        lambda: scene.set_transforms(built.instances["Ball"], translate((-0.5, 0.4, 0.26))[None]),
        lambda: scene.set_transforms(built.instances["Shed"], translate((0.3, 0, 0))[None]),
        lambda: scene.set_light(built.lights["Sun"], color=(1, 0.5, 0.2), power=5.0),
        lambda: scene.set_material(built.materials["ball"], graph(diffuse((0.1, 0.8, 0.1)))),
        lambda: scene.set_material(built.materials["ball"], graph(node("transparent_bsdf", color=(0.9, 0.5, 0.2)))),
        lambda: scene.set_instances(built.instances["Ball"], visibility=0),
        lambda: scene.set_transforms(built.instances["Walls"], rotate(0.1)[None]),
        lambda: scene.set_light(built.lights["Sun"], color=(0, 0, 0)),
        lambda: scene.set_light(built.lights["Sun"], color=(1, 1, 1)),
        lambda: scene.set_transforms(built.instances["Shed"], translate((3.5, 3.5, 0))[None]),
        lambda: scene.set_instances(built.instances["Ball"], visibility=0xffff),
        lambda: scene.set_light(built.lights["Sun"], cast_shadow=False),
        lambda: scene.set_light(built.lights["Sun"], cast_shadow=True),
        lambda: scene.set_world(graph(background((0.9, 0.2, 0.1), 2.0))),
    ]
    for change in edits:
        numbers = live.edit(change)
        assert numbers["verified_worst"] <= 1e-5 and numbers["verified_records"] > 10 and numbers["resets"] == 1


def test_short_rays_are_traced_again_only_where_an_edit_touches_them() -> None:
    """Strength alone traces next to nothing (it has a say in the choice between sun and sky); what moves far from most records
    leaves most short rays alone."""
    live = Live(light_compensation=16, light_bound=4.0, virtual_lights=64)
    scene, built = live.built.scene, live.built

    def rays(change: Any) -> float:
        before = live.session.statistics()["rays"]["update"]
        numbers = live.edit(change)
        assert numbers["verified_worst"] <= 1e-5 and numbers["resets"] == 1
        return numbers["update_rays"] - before

    dimmed = rays(lambda: scene.set_light(built.lights["Sun"], power=15.0))
    tinted = rays(lambda: scene.set_light(built.lights["Sun"], color=(1.0, 0.8, 0.7)))
    everything = rays(lambda: scene.set_transforms(built.instances["Walls"], translate((0.001, 0, 0))[None]))
    records = live.session.statistics()["values"]["records"]
    assert everything > 64 * records and max(dimmed, tinted) < 0.01 * everything
    few = max(rays(lambda x=x: scene.set_transforms(built.instances["Ball"], translate((x, 0.6, 0.3))[None]))
              for x in (-0.81, -0.8, -0.79))
    assert few < 0.35 * everything, (few, everything)


def test_short_rays_cost_no_memory_where_there_are_none() -> None:
    values = [Live(light_compensation=n).session.statistics()["values"] for n in (0, 16)]
    assert values[0]["record_bytes"] < 330 < values[1]["record_bytes"]


@pytest.mark.parametrize("lamp", ["area", "sun"])
def test_lamps_without_shadows_reach_behind_things(lamp: str) -> None:
    """A lid between the lamp and the floor does not keep its light away, direct or bounced."""
    scene = Description("lid", Camera(look_at((0, -3.0, 1.6), (0, 0.2, 0.6)), math.radians(50)))
    scene.materials.update(white=diffuse((0.7, 0.7, 0.7)), red=diffuse((0.8, 0.2, 0.1)))
    scene.add("Floor", quad((-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0)), "white")
    scene.add("Wall", quad((-2, 1.5, 0), (2, 1.5, 0), (2, 1.5, 2), (-2, 1.5, 2)), "red")
    scene.add("Lid", box((-1.5, -1.5, 1.4), (1.5, 1.4, 1.5)), "white")
    high = look_at((0.2, 0.1, 2.5), (0, 0, 0), (0, 1, 0))
    scene.lights = [Light("L", "area", high, 100.0, size=(0.5, 0.5)) if lamp == "area"
                    else Light("L", "sun", high, 3.0, angle=0.1)]

    def made() -> Built:
        built = Built(scene)
        built.scene.set_light(built.lights["L"], cast_shadow=False)
        return built

    def mean(repeats: int, **settings: Any) -> Mean:
        values = [float(render(made(), seed=i, light_pattern=i, **{**SETTINGS, **settings}).passes["diffuse_indirect"].mean())
                  for i in range(repeats)]
        return Mean(float(np.mean(values)), float(np.std(values, ddof=1) / repeats**0.5))

    truth = mean(4, method="PATH_TRACING", samples=256)
    found = mean(10, method="INSTANT_RADIOSITY", light_bound=0.0, interleave=False, samples=4, virtual_lights=1500)
    agree(found, truth, tolerance=0.02)
    assert found.error < 0.05 * found.value


def bumped_wall(strength: float) -> Description:
    scene = Description("bumped", Camera(look_at((0, -3, 0.5), (0, 0, 0.5)), math.radians(35)))
    wave = node("wave_texture", vector=node("texture_coordinate").out("object"), scale=1.5)
    bump = node("bump", strength=strength, distance=0.1, height=wave.out("fac"))
    scene.materials.update(red=diffuse((0.8, 0.2, 0.1)), white=node("diffuse_bsdf", color=(0.8, 0.8, 0.8), normal=bump))
    scene.add("Floor", quad((-4, -8, -1), (4, -8, -1), (4, 8, -1), (-4, 8, -1)), "red")
    scene.add("Wall", quad((-2, 0, -0.5), (2, 0, -0.5), (2, 0, 2), (-2, 0, 2)), "white")
    scene.lights = [Light("L", "point", translate((0, -3, 1)), 500.0)]
    return scene


def test_bumps_bend_bounced_light_without_records_of_their_own() -> None:
    settings: dict[str, Any] = dict(size=48, passes=["diffuse_indirect"], diffuse_bounces=1, caustics_reflective=False)
    halves = [render(bumped_wall(1.0), method="PATH_TRACING", samples=256, seed=seed, **settings).passes["diffuse_indirect"]
              for seed in (1, 2)]

    def shown(method: str, strength: float) -> tuple[float, float]:
        """Root mean square off, over the mean, free of the reference's noise; and records."""
        result = render(bumped_wall(strength), method=method, samples=16, virtual_lights=1024, interleave=False, light_bound=0.5,
                        **settings)
        image, mean = result.passes["diffuse_indirect"], np.mean(halves)
        off = float(np.mean((image - halves[0]) * (image - halves[1]), dtype=np.float64))
        return math.sqrt(max(off, 0.0)) / float(mean), result.statistics["values"].get("records", 0.0)

    smooth, few = shown("INSTANT_CACHE", 1e-4)
    cached, records = shown("INSTANT_CACHE", 1.0)
    every, _ = shown("INSTANT_RADIOSITY", 1.0)
    assert cached < 0.5 * smooth and every < 0.7 * smooth and records <= 1.3 * few, (smooth, cached, every, records, few)
