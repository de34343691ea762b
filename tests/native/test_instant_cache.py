# SPDX-License-Identifier: GPL-3.0-or-later
"""The temporal instant cache: after any edits its records equal fresh ones, and no more rays are traced than it takes."""

from __future__ import annotations

import math
from typing import Any

import afterglow
import numpy as np
import pytest
from afterglow.scenes import Camera, Description, Light, look_at, node, rotate, scale, translate
from afterglow.scenes.native import Built, graph
from afterglow.scenes.rooms import cornell_box, diffuse, emission
from afterglow.scenes.shapes import box, quad, sphere
from hard_cases import render

SETTINGS: dict[str, Any] = dict(method="INSTANT_CACHE", width=16, height=16, samples=1, virtual_lights=64, cache_verify=True,
                                diffuse_bounces=3, cache_accuracy=0.05)


class Live:
    """A scene, a session that renders it by the cache, and what the cache says after each edit."""

    def __init__(self, description: Description, start: bool = True, **settings: Any) -> None:
        self.built = Built(description)
        self.scene = self.built.scene
        self.settings = {**SETTINGS, **settings}
        self.session = afterglow.Session(self.scene, self.settings)
        if start:
            self.run()

    def run(self) -> None:
        self.session.start()
        self.session.wait()

    def edit(self, change: Any) -> dict[str, Any]:
        with self.session.edit():
            change()
            self.scene.commit()
        self.session.wait()
        return self.numbers()

    def numbers(self) -> dict[str, Any]:
        found = self.session.statistics()
        return {**found["values"], **{f"{kind}_rays": count for kind, count in found["rays"].items()}}

    def image(self) -> np.ndarray:
        return self.session.read()

    def move(self, name: str, transform: Any) -> None:
        self.scene.set_transforms(self.built.instances[name], np.asarray(transform, np.float64)[None])


def number(live: Live, name: str) -> float:
    found = live.numbers()
    return float(found[name])


def room(**more: Any) -> Description:
    scene = cornell_box()
    scene.materials["ball"] = diffuse((0.3, 0.5, 0.7))
    scene.add("Ball", sphere(0.2, 16, 8), "ball", transform=translate((0.4, -0.3, 0.9)))
    return scene


def test_records_are_found_again_and_nothing_is_traced_without_a_change() -> None:
    live = Live(room(), width=48, height=48)
    first = live.numbers()
    assert first["records"] > 20 and first["fill_rays"] > 0 and first["verified_differing"] == 0
    live.session.update({"seed": 99})
    live.session.wait()
    again = live.numbers()
    assert again["resets"] == first["resets"] and again["update_rays"] == 0
    assert again["records_new"] <= 0.2 * first["records"]  # other points of the pixels were asked


def test_the_cache_outlives_its_session() -> None:
    live = Live(room())
    before = live.numbers()
    del live.session
    live.session = afterglow.Session(live.scene, live.settings)
    live.session.start()
    live.session.wait()
    after = live.numbers()
    assert after["records"] == before["records"] and after["fill_rays"] == before["fill_rays"]


def test_colour_and_strength_trace_no_visibility_ray() -> None:
    live = Live(room())
    lamp = live.built.lights["Lamp"]
    before = live.numbers()
    dim = live.edit(lambda: live.scene.set_light(lamp, color=(0.1, 0.5, 1.0), power=3.0))
    assert dim["update_rays"] == before["update_rays"] and dim["lights_recoloured"] > 0 and dim["verified_worst"] <= 1e-5
    red = live.edit(lambda: live.scene.set_material(live.built.materials["red"], graph(diffuse((0.1, 0.2, 0.9)))))
    assert red["update_rays"] == before["update_rays"] and red["lights_recoloured"] > 0 and red["verified_worst"] <= 1e-5


def test_only_rays_that_a_moved_object_can_touch_are_traced() -> None:
    live = Live(room(), width=48, height=48)
    pairs = number(live, "records") * 64
    moved = live.edit(lambda: live.move("Ball", translate((0.45, -0.3, 0.9))))
    assert moved["verified_differing"] == 0 and moved["records_moved"] > 0
    assert 0 < moved["update_rays"] < 0.25 * pairs


def test_an_object_that_leaves_and_returns_in_one_step_costs_nothing() -> None:
    live = Live(room())
    before = live.numbers()

    def there_and_back() -> None:
        live.move("Ball", translate((0, 0, 5)))
        live.move("Ball", translate((0.4, -0.3, 0.9)))

    after = live.edit(there_and_back)
    assert after["update_rays"] == before["update_rays"] and after["verified_differing"] == 0


def test_lights_off_and_on_again() -> None:
    live = Live(room())
    lamp, power = live.built.lights["Lamp"], 25.0
    lit = live.image()
    dark = live.edit(lambda: live.scene.set_light(lamp, power=0.0))
    assert dark["verified_worst"] <= 1e-5 and live.image()[..., :3].max() == 0.0
    back = live.edit(lambda: live.scene.set_light(lamp, power=power))
    assert back["verified_worst"] <= 1e-5
    assert np.allclose(live.image(), lit, rtol=1e-4, atol=1e-5)


def test_a_moving_object_holds_records_lights_and_the_camera() -> None:
    scene = Description("box", Camera(look_at((0, -0.8, 0), (0, 1, 0)), math.radians(80)))
    scene.materials.update(white=diffuse((0.7, 0.7, 0.7)), lamp=emission(4.0))
    scene.add("Room", box((-1, -1, -1), (1, 1, 1), inward=True), "white")
    scene.add("Lamp", quad((-0.2, -0.2, 0.9), (-0.2, 0.2, 0.9), (0.2, 0.2, 0.9), (0.2, -0.2, 0.9)), "lamp")
    live = Live(scene, virtual_lights=512)
    whole = live.image()
    turn = translate((3, 2, 1)) @ rotate(0.7)

    def carry() -> None:
        live.move("Room", turn)
        live.move("Lamp", turn)
        live.built.description.camera.transform = turn @ scene.camera.transform
        live.built.set_camera((16, 16), 0)

    numbers = live.edit(carry)
    assert numbers["verified_differing"] == 0
    assert abs(live.image()[..., :3].mean() / whole[..., :3].mean() - 1) < 0.15


@pytest.mark.parametrize("clear", [False, True])
def test_a_record_with_256_lights_takes_little_memory(clear: bool) -> None:
    scene = room()
    if clear:
        scene.materials["ball"] = node("transparent_bsdf", color=(0.9, 0.5, 0.2))
    live = Live(scene, virtual_lights=256, width=64, height=64)
    numbers = live.numbers()
    assert numbers["record_bytes"] <= 1126
    assert numbers["cache_bytes"] / numbers["records"] <= 1126  # octree and room to grow included


def test_the_image_is_that_of_instant_radiosity() -> None:
    settings = dict(size=160, samples=2, virtual_lights=256, interleave=False, passes=["diffuse_indirect"])
    for scene in (room(), cornell_box("statue")):
        every = render(scene, method="INSTANT_RADIOSITY", **settings).passes["diffuse_indirect"]
        cached = render(scene, method="INSTANT_CACHE", **settings).passes["diffuse_indirect"]
        assert abs(cached.mean() / every.mean() - 1) < 0.02
        assert np.mean(np.abs(cached - every)) < 0.05 * every.mean()  # finer settings: below


@pytest.mark.parametrize(("shape", "limit"), [("wall", 0.02), ("ball", 0.035)])
def test_gradients_follow_light_over_places_and_normals(shape: str, limit: float) -> None:
    """Few records on a lit wall or ball without shadows: their light bends as that of all lights does."""
    scene = Description(shape, Camera(look_at((0, -3, 0.5), (0, 0, 0.5)), math.radians(50)))
    scene.materials.update(white=diffuse((0.8, 0.8, 0.8)), red=diffuse((0.8, 0.2, 0.1)))
    scene.add("Floor", quad((-4, -8, -1), (4, -8, -1), (4, 8, -1), (-4, 8, -1)), "red")
    if shape == "wall":
        scene.add("Wall", quad((-2, 0, -0.5), (2, 0, -0.5), (2, 0, 2), (-2, 0, 2)), "white")
    else:
        scene.add("Ball", sphere(0.9, 64, 32), "white", transform=translate((0, 0, 0.5)))
    scene.lights = [Light("L", "point", translate((0, -3, 1)), 500.0)]
    settings = dict(size=96, samples=1, virtual_lights=128, interleave=False, passes=["diffuse_indirect"])
    every = render(scene, method="INSTANT_RADIOSITY", **settings).passes["diffuse_indirect"]
    cached = render(scene, method="INSTANT_CACHE", **settings).passes["diffuse_indirect"]
    assert np.mean(np.abs(cached - every)) < limit * every.mean()  # without gradients 0.052 and 0.069


def test_finer_accuracy_comes_nearer() -> None:
    settings = dict(size=64, samples=2, virtual_lights=128, interleave=False, passes=["diffuse_indirect"])
    every = render(room(), method="INSTANT_RADIOSITY", **settings).passes["diffuse_indirect"]
    off = [np.abs(render(room(), method="INSTANT_CACHE", cache_accuracy=a, **settings).passes["diffuse_indirect"] - every).mean()
           for a in (0.2, 0.05, 0.0005)]
    assert off[0] > off[1] > off[2] and off[2] < 0.02 * every.mean()


@pytest.mark.parametrize("count", [1, 65536])
def test_extremes_of_virtual_lights(count: int) -> None:
    live = Live(room(), virtual_lights=count, width=6, height=6, cache_verify=False)
    assert live.image()[..., :3].mean() > 0.01 and live.numbers()["virtual_lights"] <= count


@pytest.mark.parametrize("gap", [1e-4, 2e-4])
def test_thin_walls_do_not_leak(gap: float) -> None:
    """Two walls a ten-thousandth of the room apart: the lit one's light stays on its side."""
    scene = Description("walls", Camera(look_at((-1.5, -0.5, 0.3), (0, 0, 0)), math.radians(60)))
    scene.materials["white"] = diffuse((0.8, 0.8, 0.8))
    scene.add("Room", box((-2, -1, -1), (2, 1, 1), inward=True), "white")
    scene.add("Left", quad((0, -1, -1), (0, 1, -1), (0, 1, 1), (0, -1, 1)), "white")
    scene.add("Right", quad((2 * gap, -1, -1), (2 * gap, 1, -1), (2 * gap, 1, 1), (2 * gap, -1, 1)), "white")
    scene.lights = [Light("L", "point", translate((1, 0, 0.5)), 1000.0)]
    assert render(scene, method="INSTANT_CACHE", size=32, samples=2).image[..., :3].max() == 0.0


@pytest.mark.parametrize("size", [1e-4, 1e4])
def test_any_size_of_scene_shows_the_same(size: float) -> None:
    def scaled(factor: float) -> Description:
        scene = cornell_box("emissive")
        for item in scene.objects:
            item.transforms = scale((factor,) * 3)[None] @ item.transforms
        scene.camera.transform = scale((factor,) * 3) @ scene.camera.transform
        scene.camera.transform[:3, :3] /= factor
        scene.camera.clip = (0.0, float("inf"))
        return scene

    settings = dict(method="INSTANT_CACHE", size=32, samples=8, passes=["diffuse_indirect"])
    one = render(scaled(1.0), **settings).passes["diffuse_indirect"]
    other = render(scaled(size), **settings).passes["diffuse_indirect"]
    assert abs(other.mean() / one.mean() - 1) < 0.03


def test_a_scene_that_grows_keeps_its_records() -> None:
    """The ball around the scene, which suns and the bound go by, is another one then."""
    live = Live(room(), width=32, height=32)
    before = live.numbers()
    for where in ((0.4, -30.0, 0.9), (0.4, -0.3, 0.9)):
        after = live.edit(lambda where=where: live.move("Ball", translate(where)))
        assert after["resets"] == 1 and after["records"] >= before["records"] and after["verified_differing"] == 0
        assert after["verified_records"] >= 0.9 * before["records"]


def test_a_material_that_turns_clear_and_back_keeps_the_records() -> None:
    live = Live(room(), width=32, height=32)
    ball = live.built.materials["ball"]
    before = live.image()
    for material in (node("transparent_bsdf", color=(0.9, 0.5, 0.2)), diffuse((0.3, 0.5, 0.7))):
        after = live.edit(lambda material=material: live.scene.set_material(ball, graph(material)))
        assert after["resets"] == 1 and after["verified_differing"] == 0
        assert after["update_rays"] < 0.7 * after["fill_rays"]
    assert np.abs(live.image() - before).mean() < 0.02 * before[..., :3].mean()


def test_views_show_what_the_cache_holds() -> None:
    live = Live(room(), width=48, height=48, cache_view="CHANGES")
    new = live.image()[..., :3]
    live.edit(lambda: live.move("Ball", translate((0.45, -0.3, 0.9))))
    changed = live.image()[..., :3]
    live.session.update({"seed": 1})
    live.session.wait()
    reused = live.image()[..., :3]
    seen = new.max(-1) > 0  # the rest is outside of the room

    def share(image: np.ndarray, channel: int) -> float:
        lit = seen & (image.max(-1) > 0)
        return float((image[lit].argmax(-1) == channel).mean())

    assert share(new, 1) > 0.99
    assert 0.02 < share(changed, 0) and share(changed, 1) < 0.3
    assert share(reused, 2) > 0.8 and share(reused, 0) == 0
    for view in ("RECORDS", "RAYS", "LIGHTS", "LIGHT"):
        live.session.update({"cache_view": view})
        live.session.wait()
        light = live.image()[..., :3]
        assert np.isfinite(light).all() and light.max() > 0.1 and live.numbers()["resets"] == 1
    with pytest.raises(afterglow.InvalidInput, match="cache_view"):
        live.session.update({"cache_view": "NOTHING"})
        live.session.wait()


def test_frames_that_ask_for_little_make_no_record_old() -> None:
    """As while something is dragged, and each frame is interrupted by the next edit."""
    live = Live(room(), width=48, height=48, cache_keep=2)
    lamp, before = live.built.lights["Lamp"], number(live, "records")
    live.session.update({"region": (0, 0, 12, 12)})
    live.session.wait()
    for power in range(20, 28):
        live.edit(lambda power=power: live.scene.set_light(lamp, power=float(power)))
    assert number(live, "records") >= before and number(live, "records_dropped") == 0
    live.session.update({"region": (0, 0, 48, 48)})
    live.session.wait()
    assert number(live, "records_new") <= 0.1 * before
    for power in range(20, 28):  # whole frames, in which nobody looks at what is hidden
        live.edit(lambda power=power: live.scene.set_light(lamp, power=float(power)))
    assert number(live, "records") <= 1.1 * before
