# SPDX-License-Identifier: GPL-3.0-or-later
"""Hard cases of the HashCache: sizes, places, needles, walls on borders of cells, lights that switch with every frame."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from afterglow.scenes import Camera, Description, Light, look_at, scale, translate
from afterglow.scenes.rooms import cornell_box, diffuse, emission
from afterglow.scenes.shapes import box, quad, sphere
from hard_cases import Mean, agree, mean, render
from test_hash_cache import Live

HASH: dict[str, Any] = dict(method="HASH_CACHE", size=16, samples=16, diffuse_bounces=4, max_bounces=12)
TRUE: dict[str, Any] = {**HASH, "method": "PATH_TRACING", "samples": 64}


def room(transform: Any = None, power: float = 1.0) -> Description:
    """A closed room with a lamp of its own and a ball."""
    t = np.eye(4) if transform is None else np.asarray(transform)
    scene = Description("room", Camera(t @ look_at((0, -0.8, 0), (0, 1, 0)), math.radians(80)))
    scene.materials.update(white=diffuse((0.7, 0.7, 0.7)), lamp=emission(4.0 * power))
    scene.add("Room", box((-1, -1, -1), (1, 1, 1), inward=True), "white", transform=t)
    scene.add("Lamp", quad((-0.2, -0.2, 0.9), (-0.2, 0.2, 0.9), (0.2, 0.2, 0.9), (0.2, -0.2, 0.9)), "lamp", transform=t)
    scene.add("Ball", sphere(0.3, 16, 8), "white", transform=t @ translate((0.3, 0.3, -0.6)))
    return scene


@pytest.mark.parametrize("size", [1e-4, 1e4, 1e6])
def test_size_does_not_matter(size: float) -> None:
    whole = scale((size,) * 3)
    scaled = room(whole)
    scaled.camera.transform = look_at((0, -0.8 * size, 0), (0, size, 0))
    scaled.camera.clip = (0.01 * size, 1000.0 * size)
    agree(mean(scaled, **HASH), mean(room(), **HASH), tolerance=0.005)


@pytest.mark.parametrize("place", [(1e5, -2e5, 3e4), (1e6, -6e5, 3e5)])
def test_place_does_not_matter(place: tuple[float, float, float]) -> None:
    agree(mean(room(translate(place)), **HASH), mean(room(), **HASH), tolerance=0.005)


def test_brightness_does_not_matter() -> None:
    bright, plain = (render(room(power=p), seed=1, **HASH).image[..., :3] for p in (2.0**14, 1.0))
    assert np.allclose(bright / 2.0**14, plain, rtol=1e-4)


CORNER = (0.3137, 0.2741, 0.3459)  # of the grid, in radii from its centre: cells.h
RADIUS = 8.0  # of the grid that a cube of eight metres gets


def test_walls_on_borders_of_cells() -> None:
    """Wherever the room stands in the grid, a border included, the light is the same, and so is its noise."""
    truth = mean(room(), **TRUE)
    border = [math.ceil((1 + RADIUS * c) * 4) / 4 - 1 - RADIUS * c for c in CORNER]  # 1 is on one, to 25 cm
    noise = []
    for shift in ([0.0] * 3, [0.2741] * 3, border, [b + 1e-6 for b in border], [b - 1e-6 for b in border]):
        scene = room(translate(shift))
        scene.add("Far", box((-4, -4, -4), (4, 4, 4), inward=True), "white")  # holds the grid where it is
        found = [render(scene, seed=s, passes=["diffuse_indirect"], **HASH).passes["diffuse_indirect"] for s in range(4)]
        agree(mean(scene, **HASH), truth, tolerance=0.01)
        noise.append(float(np.median(np.std(found, axis=0, ddof=1))))
    assert max(noise[2:]) < 1.3 * max(noise[:2]), noise


def test_large_and_small_triangles() -> None:
    """A floor of a kilometre, and a ball of a centimetre on it, seen from a hand's breadth."""
    scene = Description("kilometre", Camera(look_at((0, -0.08, 0.05), (0, 0, 0.004)), math.radians(40)))
    scene.materials.update(white=diffuse((0.7, 0.7, 0.7)), red=diffuse((0.8, 0.1, 0.1)))
    scene.add("Floor", quad((-500, -500, 0), (500, -500, 0), (500, 500, 0), (-500, 500, 0)), "white")
    scene.add("Ball", sphere(0.005, 64, 32), "red", transform=translate((0, 0, 0.005)))
    scene.lights = [Light("L", "point", translate((0.05, -0.05, 0.1)), 0.1)]
    settings = dict(passes=["diffuse_indirect"], size=24, diffuse_bounces=4)
    truth = [render(scene, samples=256, seed=i, **settings).passes["diffuse_indirect"].mean() for i in range(4)]
    found = [render(scene, samples=64, seed=i, method="HASH_CACHE", hash_cell=1.0,
                    **settings).passes["diffuse_indirect"].mean() for i in range(4)]
    error = math.hypot(float(np.std(truth, ddof=1)), float(np.std(found, ddof=1))) / 2
    assert abs(np.mean(found) - np.mean(truth)) < 4.5 * error + 0.03 * np.mean(truth)


def test_needles_and_walls_thinner_than_a_cell() -> None:
    """A camera inside a wall of a thousandth of the room sees less than a ten thousandth of the light outside."""
    lit = render(room(), **HASH).image[..., :3].mean()
    scene = room()
    scene.add("Wall", box((-1.1, -0.0005, -1.1), (1.1, 0.0005, 1.1)), "white")
    scene.add("Needle", quad((-1, 0.5, 0), (1, 0.5, 0), (1, 0.5, 2e-6), (-1, 0.5, 2e-6)), "white")
    scene.camera.transform = look_at((0, 0, 0), (1, 0, 0))
    scene.camera.clip = (1e-5, 10.0)
    inside, truth = (render(scene, **settings).image[..., :3].mean() for settings in (HASH, TRUE))
    assert abs(inside - truth) < 1e-4 * lit


def test_a_lamp_that_switches_with_every_frame() -> None:
    live = Live(cornell_box(), hash_keep=2, samples=8)
    lamp = live.built.lights["Lamp"]
    bright = live.session.read("diffuse_indirect").mean()
    for frame in range(6):
        on = frame % 2 == 1
        image = live.edit(lambda on=on: live.built.scene.set_light(lamp, power=25.0 if on else 0.0))
        assert np.isfinite(image).all() and (image >= 0).all()
    assert abs(image.mean() / bright - 1) < 0.3


@pytest.mark.parametrize("place", [scale((10.0,) * 3), scale((1e5,) * 3), scale((1e-5,) * 3), translate((3e4, 0, 0))],
                         ids=["grows", "grows much", "shrinks", "leaves"])
def test_scene_grows_far_beyond_its_first_bounds(place: np.ndarray) -> None:
    """Or shrinks, or is somewhere else at once: the grid of the old one is of no use, and the picture is as a fresh cache's."""
    settings: dict[str, Any] = dict(start=False, samples=8, hash_extra=0.0)

    def elsewhere(seed: int) -> Live:
        live = Live(room(), **settings)
        live.run(seed=seed)
        with live.session.edit():
            for item in live.built.description.objects:
                live.built.scene.set_transforms(live.built.instances[item.name], (place @ item.at(0)[0])[None])
            seen = look_at((0, -0.8, 0), (0, 1, 0))
            moved = place @ seen
            moved[:3, :3] = seen[:3, :3]
            size = float(np.linalg.norm(place[:3, 0]))
            camera = live.built.description.camera
            camera.transform, camera.clip = moved, (0.01 * size, 1000.0 * size)
            live.built.set_camera((32, 32), 0)
            live.built.scene.commit()
        live.session.wait()
        return live

    live, fresh, other = elsewhere(0), Live(room(), **settings), Live(room(), **settings)
    fresh.run()
    truth = np.mean([other.run(seed=500 + i) for i in range(24)][8:], axis=0)
    errors = [float(np.median([np.abs(v.run(seed=100 + i) - truth) for i in range(6)])) for v in (live, fresh)]
    assert errors[0] < 1.4 * errors[1], errors
    assert live.number("cells") < 2 * fresh.number("cells")
    # What a cache lacks stays with it from picture to picture: only other caches tell their spread.
    caches = [[make(1000 * k).run(seed=1000 * k + 1) for k in range(16)]
              for make in (elsewhere, lambda _: Live(room(), **settings))]
    agree(*(mean_of(images) for images in caches), tolerance=0.01)


def mean_of(images: list[np.ndarray]) -> Mean:
    values = [float(image.mean(dtype=np.float64)) for image in images]
    return Mean(float(np.mean(values)), float(np.std(values, ddof=1) / len(values) ** 0.5))


def test_an_object_that_flies_away_costs_no_cells() -> None:
    """Ten times as far as the scene is wide: what the rest of the scene knows stays."""
    live = Live(room(), samples=8)
    cells = live.number("cells")
    for away in (5.0, 20.0, 9.0):
        live.edit(lambda away=away: live.built.scene.set_transforms(live.built.instances["Ball"], translate((away, 0, 0))[None]))
    assert live.number("cache_resets") == 1 and live.number("cells") > 0.8 * cells


def test_cells_longer_than_the_way_a_ray_came_do_not_answer() -> None:
    """A floor on which a dark closet stands in a bright room, seen outside first. Within, rays of a few centimetres find cells of
    few samples, and larger ones would fill up with the room's light: the closet's walls are 20 cm away."""
    scene = Description("closet", Camera(look_at((1.2, 0, 1.5), (0.9, 0, 0)), math.radians(90)))
    scene.materials["white"] = diffuse((0.7, 0.7, 0.7))
    scene.add("Floor", quad((-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0)), "white")
    scene.add("Room", box((-2, -2, -0.5), (2, 2, 2), inward=True), "white")
    scene.add("Closet", box((-0.2, -0.2, -0.1), (0.2, 0.2, 0.4)), "white")
    scene.lights = [Light("L", "point", translate((1.0, 0.5, 1.5)), 200.0)]
    live = Live(scene, samples=16, hash_filter=False, hash_extra=0.0, hash_trusted=1000.0)
    assert live.session.read("diffuse_indirect").mean() > 0.5
    for eye in ((1.2, 0.3, 1.5), (0.6, -0.5, 1.0), (-0.6, 0.5, 1.0)):
        live.look_from(eye, (0, 0, 0))
    live.session.update(dict(samples=1))
    live.session.wait()
    live.built.description.camera = Camera(look_at((0, 0, 1), (0, 0, 0)), 0.4)
    assert live.look_from((0.0, -0.03, 0.05), (0, 0.0, 0)).max() == 0.0


def test_the_layered_filter_goes_through_glass() -> None:
    """What stands behind glass has layers of its own: smoother with it, and as bright."""
    scene = cornell_box("glass")
    settings: dict[str, Any] = dict(method="HASH_CACHE", size=32, samples=1, diffuse_bounces=4, hash_extra=0.0,
                                    caustics_reflective=False, caustics_refractive=False)
    truth = render(scene, **{**settings, "method": "PATH_TRACING", "samples": 512}).image[..., :3]
    passes = {on: [render(scene, seed=s, hash_filter=on, **settings).image[..., :3] for s in range(8)] for on in (False, True)}
    noise = {on: float(np.median(np.std(images, axis=0, ddof=1))) for on, images in passes.items()}
    off, filtered = (mean_of(passes[on]) for on in (False, True))
    agree(filtered, off, tolerance=0.01)
    agree(filtered, Mean(float(truth.mean()), 0.005 * float(truth.mean())), tolerance=0.01)
    assert noise[True] < 0.9 * noise[False], noise
