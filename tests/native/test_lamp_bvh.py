# SPDX-License-Identifier: GPL-3.0-or-later
"""Rays and many lamps with a shape: every lamp is met where it would be alone, and ten thousand cost little more than a few."""

from __future__ import annotations

import time
from typing import Any

import afterglow
import numpy as np
import pytest
from afterglow.bench.figure import alternate
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def random_lamp(random: np.random.Generator, size: float, reach: float) -> dict[str, Any]:
    """Arguments of add_light: spheres, soft disks, panels of all shapes, turned and scaled any way."""
    kind = random.choice(["sphere", "soft", "square", "rectangle", "disk", "ellipse"])
    turn, _ = np.linalg.qr(random.normal(size=(3, 3)))
    if random.random() < 0.3:
        turn = np.eye(3)  # flat boxes
    matrix = np.eye(4)
    matrix[:3, :3] = turn * np.sign(np.linalg.det(turn))
    matrix[:3, 3] = random.uniform(-reach, reach, 3)
    common = {"transform": matrix, "name": "lamp", "color": (1, 1, 1), "power": 1.0}
    if kind in ("sphere", "soft"):
        return {"kind": "point", "radius": size * random.uniform(0.2, 1), "soft_falloff": kind == "soft", **common}
    return {"kind": "area", "shape": str(kind), "size": tuple(size * random.uniform(0.2, 2, 2)), **common}


def lit_by(lamps: list[dict[str, Any]]) -> afterglow.Scene:
    scene = afterglow.Scene()
    for lamp in lamps:
        scene.add_light(**lamp)
    scene.commit()
    return scene


@pytest.mark.parametrize("place", [0.0, 1e4])
@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_the_nearest_lamp_is_that_of_all_lamps_asked_one_by_one(scale: float, place: float) -> None:
    random = np.random.default_rng(4)
    lamps = [random_lamp(random, 0.3 * scale, 2.0 * scale) for _ in range(150)]
    for lamp in lamps:
        lamp["transform"][:3, 3] += place * scale
    origins = random.uniform(-3, 3, (400, 3)) * scale + place * scale
    aims = np.array([lamps[i]["transform"][:3, 3] for i in random.integers(0, len(lamps), 400)])
    directions = (aims + random.normal(size=(400, 3)) * 0.2 * scale - origins).astype(np.float32)
    directions[:40] = np.eye(3)[random.integers(0, 3, 40)] * random.choice([-1, 1], (40, 1))  # along the axes
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    normal = np.array([[0, 0, 0]], np.float32)
    together = afterglow.light_density(lit_by(lamps), origins, normal, directions)["distance"]
    alone = np.min([afterglow.light_density(lit_by([lamp]), origins, normal, directions)["distance"] for lamp in lamps], axis=0)
    assert np.isfinite(alone).sum() > 100
    different = ~np.isclose(together, alone, rtol=1e-3) & (np.isfinite(together) | np.isfinite(alone))
    assert different.sum() <= (2 if place else 0)  # so far out, lamps alone have another origin: edges move by a rounding


def over_floor(lamps: list[dict[str, Any]]) -> afterglow.Scene:
    """A grey floor under lamps, seen from z = 10."""
    scene = afterglow.Scene()
    corners = np.array([(-10, -10, 0), (10, -10, 0), (10, 10, 0), (-10, 10, 0)], np.float32)
    floor = scene.add_mesh(name="floor", positions=corners, triangles=np.array([(0, 1, 2), (0, 2, 3)], np.int32))
    scene.add_instances(floor, np.eye(4)[None], name="floor")
    for lamp in lamps:
        scene.add_light(**lamp)
    eye = np.eye(4)
    eye[2, 3] = 10.0
    scene.set_camera("perspective", eye, window=(-1, 1, -1, 1))
    scene.commit()
    return scene


def seen(scene: afterglow.Scene, samples: int = 4, size: int = 32) -> Floats:
    settings = {"width": size, "height": size, "samples": samples, "accuracy": 0.0, "threads": 1,
                "method": "PATH_TRACING", "max_bounces": 2}
    session = afterglow.Session(scene, settings)
    session.start()
    session.wait(600.0)
    return session.read("combined").astype(np.float64)


def panel(x: float, y: float, z: float, upwards: bool = True, size: float = 2.0, power: float = 100.0) -> dict[str, Any]:
    matrix = np.diag([1.0, -1.0, -1.0, 1.0]) if upwards else np.eye(4)
    matrix[:3, 3] = x, y, z
    return {"kind": "area", "shape": "square", "size": (size, size), "transform": matrix, "name": "panel",
            "color": (1, 1, 1), "power": power}


def test_lamps_in_one_place_shine_together() -> None:
    middle = np.s_[15:17, 15:17, 0]
    one = seen(over_floor([panel(0, 0, 3)]))[middle].mean()
    assert one > 1.0
    assert seen(over_floor([panel(0, 0, 3)] * 5))[middle].mean() == pytest.approx(5 * one, rel=1e-5)
    assert seen(over_floor([panel(0, 0, 3), panel(0, 0, 4), panel(5, 5, 1)]))[middle].mean() == pytest.approx(2 * one, rel=1e-2)


@pytest.mark.slow
@pytest.mark.timing
def test_ten_thousand_lamps_with_a_shape_cost_little_more_than_ten() -> None:
    """Processor time of all of fifteen alternating pairs: a single pair's ratio may be off by half."""
    random = np.random.default_rng(2)

    def scene(count: int) -> afterglow.Scene:
        places = random.uniform((-9, -9, 1), (9, 9, 3), (count, 3))
        return over_floor([panel(*place, upwards=False, size=0.05, power=1000.0 / count) for place in places])

    many, few = scene(10_000), scene(10)

    def cost(scene: afterglow.Scene) -> float:
        start = time.process_time()
        seen(scene, 16, 64)
        return time.process_time() - start

    cost(many), cost(few)
    pairs = alternate(15, lambda: cost(many), lambda: cost(few))
    assert sum(pairs.ours) < 4.0 * sum(pairs.theirs)


def test_edits_that_touch_no_emitter_do_not_collect_them_again() -> None:
    rows = 300
    y, x = np.mgrid[0:rows, 0:rows].astype(np.float32)
    points = np.stack([x, y, np.sin(0.3 * x) * np.cos(0.2 * y)], -1).reshape(-1, 3)
    first = (np.arange(rows - 1)[:, None] * rows + np.arange(rows - 1)).ravel()
    triangles = np.concatenate([np.stack([first, first + 1, first + rows], -1),
                                np.stack([first + 1, first + rows + 1, first + rows], -1)])
    scene = afterglow.Scene()
    node = {"type": "emission", "name": "Emission", "params": {}, "inputs": {"color": (1, 1, 1), "strength": 1.0}}
    glow = scene.add_material({"nodes": [node], "surface": ("link", 0, "shader")}, name="glow")
    sheet = scene.add_mesh(name="sheet", positions=points, triangles=triangles.astype(np.int32))
    shining = scene.add_instances(sheet, np.eye(4)[None], name="sheet", materials=[glow])
    small = scene.add_mesh(name="small", positions=points[:3], triangles=np.array([(0, 1, 2)], np.int32))
    other = scene.add_instances(small, np.eye(4)[None], name="small")
    whole = scene.commit()["seconds"]

    def edit(handle: NDArray[np.uint32], z: float) -> float:
        moved = np.eye(4)
        moved[2, 3] = z
        scene.set_transforms(handle, moved[None])
        return scene.commit()["seconds"]

    def irradiance() -> float:
        u = np.random.default_rng(1).random((4000, 3), dtype=np.float32)
        s = afterglow.light_sample(scene, (150.0, 150.0, -20.0), (0.0, 0.0, 1.0), u)
        return float((s["radiance"][:, 0] * s["direction"][:, 2] / np.maximum(s["density"], 1e-9))[s["valid"]].sum() / 4000)

    before = irradiance()
    assert min(edit(other, z) for z in (1.0, 2.0, 3.0)) < 0.05 * whole
    assert irradiance() == before
    # Whatever makes or ends an emitter is seen: a move, a material, a new mesh.
    assert edit(shining, 30.0) > 0 and irradiance() < 0.97 * before
    edit(shining, 0.0)
    assert irradiance() == pytest.approx(before, rel=1e-6)
    scene.set_instances(shining, materials=[])
    scene.commit()
    assert irradiance() == 0.0
    scene.set_instances(other, materials=[glow])
    scene.commit()
    assert irradiance() > 0.0
    scene.set_mesh(small, name="small", positions=np.zeros((0, 3), np.float32), triangles=np.zeros((0, 3), np.int32))
    scene.commit()
    assert irradiance() == 0.0
