# SPDX-License-Identifier: GPL-3.0-or-later
"""Records where none should be: at a virtual light, on corners and edges, a thousand in one place; put there through a saved
cache. And how far settings go, what is forgotten, what lies on things that move."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from afterglow.bench.instant_cache.rays import HEADER, LIGHT, RECORD
from afterglow.scenes import Camera, Description, Light, look_at, node, rotate, scale, translate
from afterglow.scenes.rooms import diffuse
from afterglow.scenes.shapes import quad, sphere
from test_instant_cache import Live, room

FORMAT = 4


class Saved:
    """The cache of a session: its lights, its records, and that nothing is known of what they see."""

    def __init__(self, live: Live, path: Path) -> None:
        live.session.save_cache(str(path))
        raw = path.read_bytes()
        self.path = path
        self.header = np.frombuffer(raw, HEADER, 1).copy()
        assert self.header["format"][0] == FORMAT and not self.header["coloured"][0]
        slots, count = int(self.header["slots"][0]), int(self.header["records"][0])
        self.lights = np.frombuffer(raw, LIGHT, slots, HEADER.itemsize)
        self.records = np.frombuffer(raw, RECORD, count, HEADER.itemsize + slots * LIGHT.itemsize).copy()

    def write(self, records: np.ndarray) -> str:
        records["used"], records["ready"] = self.header["update"][0], 0
        self.header["records"] = len(records)
        slots, words = int(self.header["slots"][0]), int(self.header["words"][0])
        bits = np.arange(words * 64) < slots
        unknown = np.packbits(bits, bitorder="little").view("<u8")
        rows = np.zeros((3, len(records), words), "<u8")  # seen, unknown, facing
        rows[1:] = unknown
        self.path.write_bytes(self.header.tobytes() + self.lights.tobytes() + records.tobytes() + rows.tobytes())
        return str(self.path)


def loaded(records: Callable[[Saved, Live], np.ndarray], path: Path, **settings: Any) -> Live:
    """A session with the records that `records` makes of a saved cache."""
    first = Live(room(), **settings)
    saved = Saved(first, path)
    name = saved.write(records(saved, first))
    live = Live(room(), start=False, **settings)
    live.session.load_cache(name)
    live.run()
    return live


def is_sound(live: Live, records: int) -> None:
    numbers, image = live.numbers(), live.image()
    assert np.isfinite(image).all() and (image >= 0).all() and 0 < image[..., :3].max() < 1e4
    assert numbers["verified_records"] >= records and numbers["verified_worst"] <= 1e-5 and numbers["resets"] == 0


def places_below(live: Live, points: np.ndarray, normals: np.ndarray) -> dict[str, np.ndarray]:
    """Instance, triangle and barycentric coordinates of the surfaces there."""
    hits = live.scene.intersect(points + 0.01 * normals + live.scene.origin, -normals)
    order = np.sort(np.concatenate(list(live.built.instances.values())))
    return {"instance": np.searchsorted(order, hits["instance"]), "triangle": hits["triangle"], "uv": hits["barycentric"]}


@pytest.mark.parametrize("bound", [0.0, 2.0])
def test_records_exactly_at_virtual_lights(tmp_path: Path, bound: float) -> None:
    """The place and the normal of a light: the way between both has no length and no direction."""
    def at_lights(saved: Saved, first: Live) -> np.ndarray:
        found = places_below(first, saved.records["position"], saved.records["face_normal"])
        assert (found["instance"] == saved.records["instance"]).all() and (found["triangle"] == saved.records["triangle"]).all()
        lights = saved.lights[saved.lights["alive"] != 0]
        records = np.repeat(saved.records[:1], len(lights))
        for name, values in places_below(first, lights["position"], lights["face_normal"]).items():
            records[name] = values
        for name in ("position", "normal", "face_normal"):
            records[name] = lights[name]
        return records

    live = loaded(at_lights, tmp_path / "cache", light_bound=bound, width=32, height=32)
    is_sound(live, 50)
    live.edit(lambda: live.move("Ball", translate((0.3, -0.2, 0.9))))
    is_sound(live, 50)


@pytest.mark.parametrize("place", [(0, 0), (1, 0), (0, 1), (0.5, 0), (0, 0.5), (0.5, 0.5)])
def test_records_on_corners_and_edges(tmp_path: Path, place: tuple[float, float]) -> None:
    """Of their triangles, where these touch others and the walls of the room; all things move there once and back."""
    def on_edges(saved: Saved, first: Live) -> np.ndarray:
        records = saved.records.copy()
        records["uv"] = place
        return records

    live = loaded(on_edges, tmp_path / "cache", width=32, height=32)

    def move_all(x: float) -> None:
        for item in live.built.description.objects:
            live.move(item.name, translate((x, 0, 0)) @ item.at(0)[0])

    for x in (0.1, 0.0):
        live.edit(lambda x=x: move_all(x))
        is_sound(live, 20)


def test_a_thousand_records_in_one_place(tmp_path: Path) -> None:
    """Memory grows with them, not with what an octree would split to keep them apart; and threads show the same."""
    images = []
    for threads in (1, 2):
        live = loaded(lambda saved, first: np.concatenate([saved.records, np.repeat(saved.records[:1], 1000)]),
                      tmp_path / "cache", threads=threads, width=32, height=32)
        is_sound(live, 1000)
        numbers = live.numbers()
        assert numbers["cache_bytes"] < 4 * numbers["records"] * numbers["record_bytes"]
        live.edit(lambda live=live: live.move("Ball", translate((0.3, -0.2, 0.9))))
        is_sound(live, 1000)
        images.append(live.image())
    assert np.array_equal(*images)


def test_virtual_lights_ride_on_a_moving_object() -> None:
    """What they send follows: after every step the records are fresh ones, and the picture that of a fresh cache."""
    live = Live(room(), width=24, height=24, virtual_lights=256, diffuse_bounces=3)
    for step in range(1, 5):
        place = translate((0.4 - 0.2 * step, -0.3, 0.9)) @ scale((1 + 0.3 * step,) * 3)
        numbers = live.edit(lambda place=place: live.move("Ball", place))
        assert numbers["lights_moved"] > 0 and numbers["verified_worst"] <= 1e-5
    fresh = Live(room(), start=False, width=24, height=24, virtual_lights=256, diffuse_bounces=3)
    fresh.move("Ball", place)
    fresh.scene.commit()
    fresh.run()
    assert live.numbers()["virtual_lights"] == fresh.numbers()["virtual_lights"]
    assert np.abs(live.image() - fresh.image()).mean() < 0.02 * fresh.image()[..., :3].mean()


@pytest.mark.parametrize("accuracy", [0.0, 0.005])
@pytest.mark.parametrize("spacing", [1.0, 1e-6, 0.0])
def test_accuracy_at_both_ends(spacing: float, accuracy: float) -> None:
    """Of the records or, where these are told none, of the render: no more records than points of the pixels."""
    live = Live(room(), cache_accuracy=spacing, accuracy=accuracy, samples=2, cache_verify=False)
    image, numbers = live.image(), live.numbers()
    assert np.isfinite(image).all() and (image >= 0).all() and image.max() > 0.1
    assert 10 <= numbers["records"] <= 2 * 16 * 16 * max(live.session.statistics()["samples"], 1)


@pytest.mark.parametrize("away", ["wall", "sky"])
def test_records_that_nobody_looks_at_are_forgotten(away: str) -> None:
    """After so many whole frames, and not before. Frames that ask far fewer records than those before them are taken for
    interrupted ones at first, and for whole ones at last."""
    live = Live(room(), width=16, height=16, virtual_lights=32, cache_keep=3, cache_verify=False)
    lamp, made = live.built.lights["Lamp"], live.numbers()["records"]

    def dropped(step: int) -> float:
        return float(live.edit(lambda: live.scene.set_light(lamp, power=20.0 + step))["records_dropped"])

    def look() -> None:
        at = look_at((0, -0.9, 1), (0, -0.8, 0)) if away == "wall" else look_at((0, -9, 1), (0, -18, 1))
        live.built.description.camera.transform = at
        live.built.set_camera((16, 16), 0)

    live.edit(look)
    assert max(dropped(step) for step in range(3)) == 0
    left = next(step for step in range(100) if dropped(3 + step) > 0)
    assert live.numbers()["records"] < 0.7 * made and left < 100
    seen = live.numbers()["records"]
    assert dropped(200) == dropped(201) and live.numbers()["records"] == seen


def test_memory_has_a_limit() -> None:
    """A long walk fills it: those unused for longest make room; and where one picture wants more, it is told."""
    live = Live(room(), width=96, height=96, virtual_lights=256, cache_accuracy=0.01, cache_memory=1.0, cache_verify=False)
    full = live.numbers()["cache_bytes"]
    for step in range(30):
        angle = 0.2 * step
        live.built.description.camera.transform = look_at((0, 0, 1), (np.cos(angle), np.sin(angle), 1 + 0.3 * np.sin(3 * angle)))
        live.edit(lambda: live.built.set_camera((96, 96), 0))
        numbers = live.numbers()
        full = max(full, numbers["cache_bytes"])
    assert full <= 2**20 and numbers["records_dropped"] > 0 and numbers["resets"] == 1
    assert live.image()[..., :3].max() > 0
    live.session.update({"width": 400, "height": 400, "cache_accuracy": 1e-4})
    live.run()
    found = live.session.statistics()
    assert found["values"]["records_refused"] > 0 and found["values"]["cache_bytes"] <= 2**20
    assert any("is full" in text for text in found["warnings"])


@pytest.mark.parametrize("length", [1 - 1e-6, 1 + 1e-6, 1 + 1e-5])
def test_normals_that_are_rounded_longer_than_one(tmp_path: Path, length: float) -> None:
    """Their cosine with a point's may be above 1, and the root of what is missing to 1 no number."""
    def scaled(factor: float) -> np.ndarray:
        def records(saved: Saved, first: Live) -> np.ndarray:
            made = saved.records.copy()
            made["normal"] *= np.float32(factor)
            return made

        live = loaded(records, tmp_path / "cache", width=32, height=32, cache_verify=False)
        assert live.numbers()["records_new"] <= 0.1 * live.numbers()["records"]  # those that were loaded answer
        return live.image()

    assert np.abs(scaled(length) - scaled(1.0)).max() < 1e-3


def test_a_clear_pane_takes_nothing_from_a_lamp_without_shadows(tmp_path: Path) -> None:
    """Most beginnings miss the floor, and the lamp's light reaches what is behind things: its bounced light does not."""

    def on_wall(pane: bool, pattern: int) -> float:
        scene = Description("pane", Camera(look_at((0, -1.5, 0.8), (0, 0, 0)), math.radians(50)))
        scene.materials.update(white=diffuse((0.8, 0.8, 0.8)), clear=node("transparent_bsdf"))
        scene.add("Floor", quad((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)), "white")
        scene.add("Wall", quad((-4, 4, 0), (4, 4, 0), (4, 4, 4), (-4, 4, 4)), "white")
        if pane:
            scene.add("Pane", quad((-4, 2, 0), (4, 2, 0), (4, 2, 4), (-4, 2, 4)), "clear")
        scene.lights = [Light("L", "point", translate((0, 0, 0.8)), 100.0)]
        live = Live(scene, start=False, virtual_lights=16384, light_pattern=pattern, cache_verify=False)
        live.scene.set_light(live.built.lights["L"], cast_shadow=False)
        live.run()
        live.session.save_cache(str(tmp_path / "cache"))
        raw = (tmp_path / "cache").read_bytes()
        lights = np.frombuffer(raw, LIGHT, int(np.frombuffer(raw, HEADER, 1)["slots"][0]), HEADER.itemsize)
        return float(lights["front"][lights["position"][:, 1] > 3.9, 0].sum())

    without, through = (np.array([on_wall(pane, pattern) for pattern in range(8)]) for pane in (False, True))
    spread = math.hypot(*(values.std(ddof=1) / 8**0.5 for values in (without, through)))
    assert abs(without.mean() - through.mean()) < 3 * spread < 0.04 * without.mean()


def test_two_moving_objects_overlap() -> None:
    """They go through each other, together and one after the other; what one leaves the other still hides."""
    description = room()
    description.add("Other", sphere(0.25, 16, 8), "ball", transform=translate((0.3, -0.3, 0.9)))
    live = Live(description, width=24, height=24)

    def place(name: str, x: float) -> None:
        live.move(name, translate((x, -0.3, 0.9)) @ rotate(x))

    for a, b in ((0.3, 0.35), (0.35, 0.3), (0.35, 0.1), (0.1, 0.1), (0.9, 0.1), (0.1, 0.9)):
        def both(a: float = a, b: float = b) -> None:
            place("Ball", a)
            place("Other", b)

        numbers = live.edit(both)
        assert numbers["objects_moved"] >= 1 and numbers["verified_worst"] <= 1e-5 and numbers["verified_records"] > 20
