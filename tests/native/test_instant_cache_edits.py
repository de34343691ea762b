# SPDX-License-Identifier: GPL-3.0-or-later
"""Edits of all kinds in any order: after each, every record of the instant cache equals a fresh one at its place."""

from __future__ import annotations

import time
from functools import partial
from typing import Any

import afterglow
import numpy as np
import pytest
from afterglow.scenes import Description, look_at, node, rotate, scale, translate
from afterglow.scenes.native import graph
from afterglow.scenes.rooms import background, diffuse, emission, noise_picture
from afterglow.scenes.shapes import quad, sphere
from test_instant_cache import Live, room


def random_edit(live: Live, rng: np.random.Generator, state: dict[str, Any]) -> None:
    """One edit of a random kind, some with several objects at once."""
    scene, built = live.scene, live.built
    place = lambda: translate(rng.uniform((-0.7, -0.7, 0.2), (0.7, 0.7, 1.6)))  # noqa: E731
    kind = int(rng.integers(23))
    if kind in (0, 1):
        live.move("Ball", place() @ rotate(float(rng.uniform(0, 6))) @ scale(rng.uniform(0.3, 2.0, 3)))
    elif kind == 2:
        live.move("Tall", place() @ scale((0.4, 0.4, 0.4)))
        live.move("Low", place() @ scale((0.3, -0.3, 0.3)))
    elif kind == 3:
        rest = sphere(0.2, 8 if state.get("mesh") else 16, 8).positions
        scene.set_mesh(built.meshes["Ball"], positions=(rest * rng.uniform(0.3, 2, 3)).astype(np.float32))
    elif kind == 4:
        above = rng.uniform((-0.5, -0.5, 1.6), (0.5, 0.5, 1.95))
        scene.set_light(built.lights["Lamp"], transform=look_at(above, (0, 0, 0), (0, 1, 0)))
    elif kind == 5:
        scene.set_light(built.lights["Lamp"], color=tuple(rng.uniform(0, 1, 3)), power=float(rng.uniform(0, 40)))
    elif kind == 6:
        scene.set_material(built.materials["white"], graph(diffuse(tuple(rng.uniform(0, 0.9, 3)))))
    elif kind == 7:
        scene.set_instances(built.instances["Ball"], visibility=int(rng.choice([afterglow.ALL_RAYS, 0, afterglow.CAMERA])))
    elif kind == 8:
        if state.get("extra") is None:
            red = built.materials["red"]
            state["extra"] = scene.add_instances(built.meshes["Ball"], place()[None], name="Extra", materials=[red])
        else:
            scene.remove_instances(state["extra"])
            state["extra"] = None
    elif kind == 9:
        clear = node("transparent_bsdf", color=tuple(rng.uniform(0.2, 1, 3)))
        scene.set_material(built.materials["ball"], graph(clear if rng.random() < 0.5 else diffuse((0.5, 0.5, 0.5))))
    elif kind == 10:
        scene.set_world(graph(background((0.3, 0.5, 1.0), float(rng.uniform(0, 1)))))
    elif kind == 11:
        state["mesh"] = not state.get("mesh", False)
        mesh = sphere(0.2, 8 if state["mesh"] else 16, 8)
        scene.set_mesh(built.meshes["Ball"], name="Ball", positions=mesh.positions, triangles=mesh.triangles)
    elif kind == 12:
        scene.set_instances(built.instances["Low"], materials=[built.materials[str(rng.choice(["red", "green", "ball"]))]])
    elif kind == 13:
        live.move("Ball", place())
        scene.set_light(built.lights["Lamp"], color=tuple(rng.uniform(0.1, 1, 3)))
        scene.set_material(built.materials["green"], graph(diffuse(tuple(rng.uniform(0, 0.9, 3)))))
    else:
        edit_lights_and_looks(live, rng, state, kind)


def edit_lights_and_looks(live: Live, rng: np.random.Generator, state: dict[str, Any], kind: int) -> None:
    """More kinds: lamps, what shines, pictures, the camera, many copies."""
    scene, built = live.scene, live.built
    if kind in (14, 15):
        high = look_at(rng.uniform((-0.8, -0.8, 0.3), (0.8, 0.8, 1.9)), (0, 0, 0.5))
        if state.get("lamp") is None:
            state["lamp"] = scene.add_light("point", high, name="Second", color=(1, 0.5, 0.2), power=10.0, radius=0.05)
        elif kind == 14:
            scene.remove_light(state.pop("lamp"))
        else:
            which = str(rng.choice(["point", "spot", "sun", "area"]))
            scene.set_light(state["lamp"], kind=which, transform=high, spot_size=1.0, spot_blend=0.3, angle=0.1, size=(0.2, 0.3),
                            power=3.0 if which == "sun" else 10.0)
    elif kind == 16:
        scene.set_light(built.lights["Lamp"], cast_shadow=bool(rng.integers(2)))
    elif kind == 17:
        scene.set_material(built.materials["ball"], graph(emission(float(rng.uniform(0, 3)), tuple(rng.uniform(0, 1, 3)))))
    elif kind == 18:
        scene.set_image(built.images["spots"], noise_picture(8, int(rng.integers(100))).pixels, name="spots")
    elif kind == 19:
        paint = node("image_texture", {"image": "spots"}, vector=node("texture_coordinate").out("uv"))
        clear = node("mix_shader", fac=paint, shader=diffuse((0.7, 0.7, 0.7)), shader_001=node("transparent_bsdf"))
        scene.set_material(built.materials["panel"], graph(clear if rng.random() < 0.3 else diffuse(paint), built.images))
    elif kind == 20:
        built.description.camera.transform = look_at(rng.uniform((-0.5, -4, 0.5), (0.5, -3, 1.5)), (0, 0, 1))
        built.set_camera((live.settings["width"], live.settings["height"]), 0)
    elif kind == 21:
        copies = state.pop("copies", None)
        if copies is not None:
            scene.remove_instances(copies)
        places = rng.uniform((-0.8, -0.8, 0.1), (0.8, 0.8, 1.8), (rng.integers(1, 9), 3))
        transforms = np.array([translate(place) @ scale((0.2,) * 3) for place in places])
        state["copies"] = scene.add_instances(built.meshes["Ball"], transforms, name="Copies",
                                              materials=[built.materials["green"]])
    else:
        live.move("Panel", translate(rng.uniform((-0.3, -0.3, -0.3), (0.3, 0.3, 0.3))))


def painted_room() -> Description:
    """With a panel that an image paints."""
    scene = room()
    scene.images["spots"] = noise_picture(8)
    scene.materials["panel"] = diffuse(node("image_texture", {"image": "spots"}))  # type: ignore[arg-type]
    scene.add("Panel", quad((-0.9, 0.5, 0.4), (-0.2, 0.8, 0.4), (-0.2, 0.8, 1.2), (-0.9, 0.5, 1.2)), "panel")
    return scene


def run_edits(count: int, seed: int, on_demand: bool = False, **settings: Any) -> None:
    live, rng, state = Live(painted_room(), **settings), np.random.default_rng(seed), {}
    verified = records = 0
    for step in range(count):
        if on_demand and step % 7 == 3:
            live.session.update({"cache_on_demand": bool(rng.integers(2))})
            live.session.wait()
        numbers = live.edit(lambda: random_edit(live, rng, state))
        assert numbers["verified_worst"] <= 1e-5, (step, numbers["verified_differing"], numbers["verified_records"])
        assert np.isfinite(live.image()).all()
        verified, records = verified + numbers["verified_records"], records + numbers["records"]
    assert live.numbers()["records"] > 10
    assert verified > 0.5 * records  # others wait until a point wants them


@pytest.mark.parametrize("seed", [1, 2])
def test_records_equal_fresh_ones_after_random_edits(seed: int) -> None:
    run_edits(150, seed, on_demand=seed == 2)


def test_lights_that_fill_no_whole_word_are_kept_apart() -> None:
    """Visibility is kept in words of 64 lights: bits beyond the last light are nobody's."""
    run_edits(60, 3, width=8, height=8, virtual_lights=37)
    run_edits(100, 22, width=8, height=8, virtual_lights=96, light_compensation=6, light_bound=4.0)


@pytest.mark.slow
def test_records_equal_fresh_ones_after_ten_thousand_edits() -> None:
    run_edits(10_000, 3, width=8, height=8, virtual_lights=32)


def test_a_pane_goes_while_a_ball_comes_before_what_was_seen_through_it() -> None:
    """What is seen through glass can become brighter at once with what may hide it: the ball alone does not tell."""
    scene = room()
    scene.materials["pane"] = node("transparent_bsdf", color=(0.5, 0.6, 0.7))
    scene.add("Pane", quad((-1, -1, 1.0), (1, -1, 1.0), (1, 1, 1.0), (-1, 1, 1.0)), "pane")
    scene.add("Shard", quad((-0.9, -0.9, 0.1), (-0.8, -0.9, 0.1), (-0.8, -0.8, 0.1), (-0.9, -0.8, 0.1)), "pane")
    live = Live(scene)

    def change() -> None:
        live.move("Ball", translate((0.1, 0.2, 0.6)) @ scale((2.0, 2.0, 2.0)))
        live.scene.remove_instances(live.built.instances["Pane"])

    numbers = live.edit(change)
    assert numbers["verified_worst"] <= 1e-5, (numbers["verified_differing"], numbers["verified_records"])


def test_repair_on_demand_shows_the_same_image() -> None:
    images = []
    for on_demand in (False, True):
        live, rng, state = Live(painted_room(), cache_on_demand=on_demand), np.random.default_rng(8), {}
        for _ in range(12):
            numbers = live.edit(partial(random_edit, live, rng, state))
            assert numbers["verified_worst"] <= 1e-5
        images.append(live.image())
    assert abs(images[0] - images[1]).mean() < 0.02 * images[0][..., :3].mean()


@pytest.mark.parametrize("short_rays", [0, 4])
def test_updates_that_are_interrupted_leave_no_old_light(short_rays: int) -> None:
    """Whenever an update of another colour is stopped: the next one shows what a fresh record would."""
    live = Live(painted_room(), width=160, height=120, virtual_lights=2048, light_compensation=short_rays, light_bound=4.0)
    rng = np.random.default_rng(5)
    for step in range(40):
        live.session.update({"cache_verify": False})
        live.session.wait()
        live.scene.set_light(live.built.lights["Lamp"], color=tuple(rng.uniform(0.1, 1, 3)))
        live.scene.commit()
        live.session.start()
        time.sleep(float(rng.uniform(0, 0.03)))
        live.session.cancel()
        live.session.update({"cache_verify": True})
        live.run()
        numbers = live.numbers()
        assert numbers["verified_worst"] <= 1e-5, (step, numbers["verified_differing"], numbers["verified_records"])
        assert numbers["verified_records"] > 0.9 * numbers["records"]


def test_one_and_two_threads_show_the_same_image_through_edits() -> None:
    images = []
    for threads in (1, 2):
        live, rng, state = Live(painted_room(), threads=threads, width=40, height=30), np.random.default_rng(4), {}
        for _ in range(8):
            live.edit(partial(random_edit, live, rng, state))
        images.append(live.image())
    assert np.array_equal(images[0], images[1])
