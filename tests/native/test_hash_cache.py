# SPDX-License-Identifier: GPL-3.0-or-later
"""HashCache against the path tracer; what must not change the picture; what the cells remember and forget."""

from __future__ import annotations

import math
from typing import Any

import afterglow
import numpy as np
import pytest
from afterglow.scenes import Camera, Description, Light, look_at, node, translate
from afterglow.scenes.native import Built, graph
from afterglow.scenes.outdoors import area_lights
from afterglow.scenes.rooms import cornell_box, diffuse, emission, furnace, sealed_box, world_furnace
from afterglow.scenes.shapes import box, quad
from hard_cases import Mean, agree, render

HASH: dict[str, Any] = dict(method="HASH_CACHE")


def indirect(scene: Any, repeats: int, **settings: Any) -> Mean:
    """Mean of the diffuse indirect light over independent seeds, each with a cache of its own, and its standard error."""
    defaults = dict(size=16, caustics_reflective=False, caustics_refractive=False, passes=["diffuse_indirect"])
    values = [float(render(scene, seed=50 + i, **{**defaults, **settings}).passes["diffuse_indirect"].mean(dtype=np.float64))
              for i in range(repeats)]
    return Mean(float(np.mean(values)), float(np.std(values, ddof=1) / repeats**0.5))


class Live:
    """A scene and a session whose cache stays alive."""

    def __init__(self, description: Description, start: bool = True, **settings: Any) -> None:
        self.built = Built(description)
        self.settings = {**HASH, "width": 32, "height": 32, "samples": 2, "diffuse_bounces": 4,
                         "passes": ["combined", "diffuse_indirect"],
                         "hash_running": False, **settings}
        self.built.set_camera((self.settings["width"], self.settings["height"]), 0)
        self.built.scene.commit()
        self.session = afterglow.Session(self.built.scene, self.settings)
        if start:
            self.run()

    def run(self, **settings: Any) -> np.ndarray:
        self.session.update(settings)
        self.session.start()
        self.session.wait()
        return self.session.read("diffuse_indirect")

    def edit(self, change: Any) -> np.ndarray:
        with self.session.edit():
            change()
            self.built.scene.commit()
        self.session.wait()
        return self.session.read("diffuse_indirect")

    def look_from(self, eye: tuple[float, float, float], at: tuple[float, float, float]) -> np.ndarray:
        def walk() -> None:
            self.built.description.camera.transform = look_at(eye, at)
            self.built.set_camera((self.settings["width"], self.settings["height"]), 0)

        return self.edit(walk)

    def number(self, name: str) -> float:
        return float(self.session.statistics()["values"][name])


@pytest.mark.parametrize("albedo", [0.3, 0.8])
def test_furnace(albedo: float) -> None:
    """Radiance e (1 + a + … + a^(n+1)), as the path tracer's bounce limit has it."""
    expected = sum((1 - albedo) * albedo**k for k in range(6))
    values = [float(render(furnace(albedo), size=12, samples=16, seed=i, diffuse_bounces=4,
                           **HASH).image[..., :3].mean(dtype=np.float64))
              for i in range(6)]
    error = float(np.std(values, ddof=1) / len(values) ** 0.5)
    assert abs(np.mean(values) - expected) < 4.5 * error + 1e-4


@pytest.mark.parametrize("bounces", [0, 1, 4])
def test_cornell_box_has_the_path_tracers_bounces(bounces: int) -> None:
    scene = cornell_box()
    truth = indirect(scene, 4, method="PATH_TRACING", samples=128, diffuse_bounces=bounces)
    found = indirect(scene, 6, samples=32, diffuse_bounces=bounces, **HASH)
    agree(found, truth, tolerance=0.005)


@pytest.mark.parametrize("variant", ["emissive", "glossy", "mirror", "textured"])
def test_rooms_have_the_path_tracers_light(variant: str) -> None:
    scene = cornell_box(variant)
    settings = dict(size=16, caustics_reflective=False, caustics_refractive=False, diffuse_bounces=4)
    truth = [render(scene, method="PATH_TRACING", samples=128, seed=i, **settings).image[..., :3].mean(dtype=np.float64)
             for i in range(4)]
    found = [render(scene, samples=32, seed=i, **HASH, **settings).image[..., :3].mean(dtype=np.float64) for i in range(4)]
    means = [Mean(float(np.mean(v)), float(np.std(v, ddof=1) / 2)) for v in (found, truth)]
    agree(means[0], means[1], tolerance=0.01)


def test_path_length_is_a_bounce_limit_and_stored_surfaces_change_no_mean() -> None:
    scene = cornell_box()
    short = indirect(scene, 6, samples=32, diffuse_bounces=4, hash_length=1, **HASH)
    agree(short, indirect(scene, 4, method="PATH_TRACING", samples=128, diffuse_bounces=1), tolerance=0.005)
    truth = indirect(scene, 4, method="PATH_TRACING", samples=128, diffuse_bounces=4)
    for store in (1, 8):
        agree(indirect(scene, 6, samples=32, diffuse_bounces=4, hash_store=store, **HASH), truth, tolerance=0.01)


def test_paths_that_end_in_cells_change_no_mean() -> None:
    """Even where a single bounce more would show."""
    scene = cornell_box()
    for bounces in (2, 4):
        whole = indirect(scene, 6, samples=32, diffuse_bounces=bounces, hash_long_paths=1.0, **HASH)
        agree(indirect(scene, 6, samples=32, diffuse_bounces=bounces, **HASH), whole, tolerance=0.005)
    values = [render(scene, size=64, samples=16, hash_long_paths=share, **HASH).statistics["rays"]["cache"]
              for share in (1.0, 0.1)]
    assert values[1] < 0.8 * values[0]  # in a box, many rays are shorter than the cells of so small a picture


def test_more_light_samples_change_no_mean_and_less_noise() -> None:
    scene = cornell_box()

    def direct(**settings: Any) -> np.ndarray:
        return render(scene, size=32, passes=["diffuse_direct"], **settings).passes["diffuse_direct"]

    truth = direct(samples=1024, method="PATH_TRACING", seed=8)
    errors = {}
    for lights in (1, 8):
        images = [direct(samples=4, hash_lights=lights, hash_extra=0.0, seed=s, **HASH) for s in range(6)]
        means = [float(image.mean()) for image in images]
        here = Mean(float(np.mean(means)), float(np.std(means, ddof=1) / 6**0.5))
        agree(here, Mean(float(truth.mean()), 0.002 * float(truth.mean())), tolerance=0.005)
        errors[lights] = float(np.median([np.median((image - truth) ** 2) for image in images]))
    assert errors[8] < 0.7 * errors[1]


def test_extra_samples_go_where_noise_is_and_change_no_mean() -> None:
    """Edges get most, and the picture's mean stays within half a per cent."""
    scene, size = cornell_box("glossy"), 32
    settings: dict[str, Any] = dict(size=size, diffuse_bounces=4, caustics_reflective=False, passes=["combined", "sample_count"])
    truth = [render(scene, method="PATH_TRACING", samples=1024, seed=s, **settings).image[..., :3].astype(np.float64)
             for s in range(2)]
    means, errors = {}, {}
    for extra in (0.0, 2.0):
        results = [render(scene, samples=8, seed=s, hash_extra=extra, **HASH, **settings) for s in range(8)]
        counts = results[0].passes["sample_count"]
        assert counts.min() >= 8 and counts.mean() <= 8 * (1 + extra) * 1.01
        assert extra == 0 or counts.max() > 4 * np.median(counts)
        images = [r.image[..., :3].astype(np.float64) for r in results]
        values = [image.mean() for image in images]
        means[extra] = Mean(float(np.mean(values)), float(np.std(values, ddof=1) / 8**0.5))
        errors[extra] = float(np.mean([((x - truth[0]) * (x - truth[1])).mean() for x in images]))
    agree(means[2.0], Mean(float(np.mean(truth)), 0.001 * float(np.mean(truth))), tolerance=0.005)
    agree(means[2.0], means[0.0], tolerance=0.005)
    assert errors[2.0] < 0.5 * errors[0.0]


@pytest.mark.parametrize("samples", [1, 8])
def test_extra_samples_are_as_many_as_the_noise_asks(samples: int) -> None:
    """None where nothing is noisy, few in a plain room, all that are allowed where much is."""
    def extra(scene: Description) -> float:
        live = Live(scene, samples=samples, hash_extra=2.0, hash_lights=1, passes=["sample_count", "diffuse_indirect"])
        return float(live.session.read("sample_count").mean()) / samples - 1

    assert extra(world_furnace(emission(1.0))) == 0.0
    assert 0.05 < extra(cornell_box()) < 1.0
    assert abs(extra(area_lights()) - 2.0) < 0.06


@pytest.mark.parametrize("variant", ["diffuse", "glossy", "emissive"])
def test_all_from_the_cache_has_the_same_light(variant: str) -> None:
    scene = cornell_box(variant)
    settings: dict[str, Any] = dict(size=16, diffuse_bounces=4, caustics_reflective=False, caustics_refractive=False)
    truth = [render(scene, method="PATH_TRACING", samples=128, seed=i, **settings).image[..., :3].mean(dtype=np.float64)
             for i in range(4)]
    results = [render(scene, samples=32, seed=i, hash_direct=True, **HASH, **settings) for i in range(6)]
    found = [r.image[..., :3].mean(dtype=np.float64) for r in results]
    agree(Mean(float(np.mean(found)), float(np.std(found, ddof=1) / 6**0.5)),
          Mean(float(np.mean(truth)), float(np.std(truth, ddof=1) / 2)), tolerance=0.01)
    if variant == "diffuse":
        assert results[0].statistics["rays"]["shadow"] == 0


def test_all_from_a_cache_that_few_paths_fill() -> None:
    """A tiled wall behind the camera, which only paths from the ground have met, then comes into view: what they found there is
    without direct light, so further paths are sent."""
    settings: dict[str, Any] = dict(samples=1, hash_direct=True, hash_resolution=0.1, hash_extra=0.0)

    def wall(**more: Any) -> float:
        scene = Description("ground and wall", Camera(look_at((0, -3, 2), (0, -1, 0)), math.radians(30)))
        scene.materials["white"] = diffuse((0.8, 0.8, 0.8))
        scene.add("Ground", quad((-3, -3, 0), (3, -3, 0), (3, 3, 0), (-3, 3, 0)), "white")
        for i in range(64):
            x, z = -1.6 + 0.4 * (i % 8), 0.2 + 0.4 * (i // 8)
            scene.add(f"Tile{i}", quad((x, -3.1, z), (x, -3.1, z + 0.4), (x + 0.4, -3.1, z + 0.4), (x + 0.4, -3.1, z)), "white")
        scene.lights = [Light("L", "point", translate((4, 30, 24)), 20000.0)]
        live = Live(scene, **more)
        live.run(seed=more.get("seed", 0) + 100, hash_resolution=1.0)
        live.run(hash_resolution=0.1)
        live.look_from((0, 0, 1.8), (0, -3, 1.8))
        return float(live.session.read("combined")[..., :3].mean())

    truth = wall(method="PATH_TRACING", samples=128)
    found = [wall(seed=i, **settings) for i in range(12)]
    agree(Mean(float(np.mean(found)), float(np.std(found, ddof=1) / 12**0.5)), Mean(truth, 0.003 * truth), tolerance=0.01)


def test_the_first_picture_of_an_empty_cache_takes_its_samples() -> None:
    """And no other, whatever is edited; a viewport takes what it is asked for."""
    live = Live(cornell_box(), samples=1, hash_first=5, hash_extra=0.0, passes=["sample_count", "diffuse_indirect"])
    counts = [int(live.session.read("sample_count").max())]
    live.look_from((0.1, -3.9, 1), (0, 0, 1))
    counts.append(int(live.session.read("sample_count").max()))
    live.session.forget_cache()
    live.run(seed=9)
    counts.append(int(live.session.read("sample_count").max()))
    live.run(seed=10, hash_first=0)
    counts.append(int(live.session.read("sample_count").max()))
    live.run(seed=11, hash_first=5, hash_cell=2.0)  # cells of another size: emptied in the same update
    counts.append(int(live.session.read("sample_count").max()))
    assert counts == [5, 1, 5, 1, 5]
    assert Live(cornell_box(), samples=1, hash_first=5, viewport=True).session.statistics()["samples"] == 1


def test_all_of_the_first_picture_fills_the_cache_and_a_share_of_what_follows() -> None:
    def paths(**settings: Any) -> list[float]:
        live = Live(cornell_box(), samples=4, hash_extra=0.0, hash_running=False, **settings)
        found = [live.session.statistics()["values"]["cache_paths"]]
        live.look_from((0.1, -3.9, 1), (0, 0, 1))
        return [*found, live.session.statistics()["values"]["cache_paths"] - found[0]]

    full, few, first = paths(), paths(hash_resolution=0.25), paths(hash_resolution=0.25, hash_first=1)
    assert few[0] < 0.2 * full[0] and first[0] == full[0]
    assert first[1] < 0.2 * full[1]


def test_the_picture_of_a_still_view_goes_on() -> None:
    still = Live(cornell_box(), hash_running=True)

    def samples(seed: int) -> int:
        still.session.update({"seed": seed})
        still.session.wait()
        return int(still.session.statistics()["samples"])

    assert samples(1) == 4  # the first run had seed 0
    two = still.session.read("combined")
    assert samples(2) == 6
    assert not np.array_equal(two, still.session.read("combined"))
    assert samples(2) == 2  # the same again is a picture of its own
    assert samples(3) == 4
    still.look_from((0.1, -3.5, 1.0), (0, 0, 1.0))
    assert int(still.session.statistics()["samples"]) == 2
    assert samples(4) == 4
    still.edit(lambda: still.built.scene.set_light(still.built.lights["Lamp"], power=0.0))
    assert int(still.session.statistics()["samples"]) == 2 and still.session.read("diffuse_indirect").max() == 0.0


def test_pixels_converge_and_much_sooner_than_paths() -> None:
    scene = cornell_box()
    settings = dict(size=32, diffuse_bounces=4, passes=["diffuse_indirect"], seed=3)
    truth = render(scene, method="PATH_TRACING", samples=2048, **{**settings, "seed": 77}).passes["diffuse_indirect"]

    def error(samples: int, **more: Any) -> float:
        image = render(scene, samples=samples, **settings, **more).passes["diffuse_indirect"]
        return float(((image - truth) ** 2).mean() / (truth**2).mean())

    cached = [error(n, hash_cell=2.0, **HASH) for n in (1, 8, 64)]
    assert cached[0] > 2.0 * cached[1] > 4.0 * cached[2]
    assert cached[1] < 0.25 * error(8, method="PATH_TRACING")


@pytest.mark.parametrize("variant", ["diffuse", "glossy", "glass"])
def test_any_number_of_threads(variant: str) -> None:
    one, two, three = (render(cornell_box(variant), size=32, samples=3, threads=n, seed=5, **HASH).image for n in (1, 2, 3))
    assert np.array_equal(one, two) and np.array_equal(one, three)


def test_fewer_paths_than_pixels_leave_no_holes() -> None:
    scene = cornell_box()
    truth = indirect(scene, 4, method="PATH_TRACING", samples=128, diffuse_bounces=4)
    found = indirect(scene, 6, samples=64, diffuse_bounces=4, hash_resolution=0.5, **HASH)
    agree(found, truth, tolerance=0.02)
    bare = render(furnace(0.8), size=16, samples=1, passes=["diffuse_indirect"], hash_resolution=0.0, **HASH)
    assert bare.passes["diffuse_indirect"].min() > 0.0  # nothing but holes, and each was filled
    assert bare.statistics["values"]["cache_holes"] == bare.statistics["values"]["cache_paths"] > 0


def test_the_second_frame_profits_from_the_first() -> None:
    still: dict[str, Any] = dict(pixel_filter="BOX", filter_width=0.01)  # every sample of a pixel sees the same surface
    truth = render(cornell_box(), size=32, samples=1024, diffuse_bounces=4, passes=["diffuse_indirect"],
                   **still).passes["diffuse_indirect"]
    first = last = 0.0
    for walk in range(3):  # one walk alone is within its noise of the bound
        live = Live(cornell_box(), hash_cell=2.0, **still)
        errors = [float(np.median((live.run(seed=100 * walk + i, samples=2) - truth) ** 2)) for i in range(12)]
        first, last = first + errors[0], last + errors[11]
        assert live.number("cache_resets") == 1
    assert last < 0.5 * first


def test_a_walk_of_the_camera_keeps_the_cells() -> None:
    live = Live(cornell_box())
    cells = live.number("cells")
    live.look_from((0.1, -3.5, 1.0), (0, 0, 1.0))
    assert live.number("cache_resets") == 1 and live.number("cells") >= cells


def test_edits_forget_what_was() -> None:
    live = Live(cornell_box(), hash_keep=0)
    lamp = live.built.lights["Lamp"]
    bright = live.session.read("diffuse_indirect").mean()
    dark = live.edit(lambda: live.built.scene.set_light(lamp, power=0.0))
    assert dark.max() == 0.0 and live.number("cache_resets") == 2
    red = live.edit(lambda: live.built.scene.set_light(lamp, power=25.0))
    assert abs(red.mean() / bright - 1) < 0.2
    live.edit(lambda: live.built.scene.set_material(live.built.materials["red"], graph(diffuse((0.1, 0.2, 0.9)))))
    assert live.number("cache_resets") == 4


def test_cells_that_are_kept_heal() -> None:
    live = Live(cornell_box(), hash_keep=4, samples=4)
    before = live.session.read("diffuse_indirect").mean()
    live.edit(lambda: live.built.scene.set_light(live.built.lights["Lamp"], power=12.5))
    assert live.number("cache_resets") == 1
    for _ in range(8):
        after = live.run(samples=8).mean()
    assert abs(after / before - 0.5) < 0.05


@pytest.mark.parametrize("sheets", [1, 2])
def test_two_sheets_lit_from_one_side(sheets: int) -> None:
    """A tenth of a millimetre apart, or one alone: what shines on the upper one's top is in no other side's cells."""
    scene = Description("sheets", Camera(look_at((0, -1.0, 1.2), (0, 0, 0)), math.radians(40)))
    scene.materials.update(paper=diffuse((0.8, 0.8, 0.8)), lamp=emission(20.0))
    for name, z in (("Upper", 1e-4), ("Lower", 0.0))[:sheets]:
        scene.add(name, quad((-2, -2, z), (2, -2, z), (2, 2, z), (-2, 2, z)), "paper")
    scene.add("Ceiling", quad((-2, -2, 1.5), (-2, 2, 1.5), (2, 2, 1.5), (2, -2, 1.5)), "paper")
    scene.lights = [Light("L", "point", translate((0, 0, 0.7)), 200.0)]
    live = Live(scene, samples=8)
    lit = live.look_from((0, -1.0, 1.2), (0, 0, 0))
    truth = render(scene, size=32, samples=256, diffuse_bounces=4, passes=["diffuse_indirect"]).passes["diffuse_indirect"].mean()
    assert abs(lit.mean() / truth - 1) < 0.05
    assert live.look_from((0, -1.0, -1.5), (0, 0, 0)).max() == 0.0


def red_and_blue() -> Description:
    """Two closed rooms that share a wall thinner than a cell, each with a lamp: whatever bounces is red in one and blue in the
    other. A tenth of a millimetre before each face hangs a sheet of its own, so that four faces stand within a cell."""
    scene = Description("red and blue", Camera(look_at((-0.9, 0, 0), (0, 0, 0)), math.radians(60)))
    scene.materials.update(red=diffuse((0.8, 0, 0)), blue=diffuse((0, 0, 0.8)), white=diffuse((0.8, 0.8, 0.8)))
    scene.add("Wall", box((-0.0001, -1, -1), (0.0001, 1, 1)), "white")
    for side, name in ((-1, "red"), (1, "blue")):
        scene.add(f"Room {name}", box((min(side, 0), -1, -1), (max(side, 0), 1, 1), inward=True), name)
        x = side * 0.0002
        scene.add(f"Sheet {name}", quad((x, -0.5, -0.5), (x, 0.5, -0.5), (x, 0.5, 0.5), (x, -0.5, 0.5)), "white")
        scene.lights.append(Light(name, "point", translate((side * 0.5, 0, 0.6)), 20.0, radius=0.05))
    return scene


def test_jittered_look_ups_stay_on_their_own_face() -> None:
    for jitter in (0.0, 4.0):
        live = Live(red_and_blue(), hash_jitter=jitter, hash_cell=8.0, samples=4)
        for eye, other in ((-0.9, 2), (0.9, 0), (-0.9, 2)):
            image = live.look_from((eye, 0, 0), (0, 0, 0))
            assert image[..., other].max() == 0.0 and image[..., 2 - other].mean() > 0.01


def test_sealed_box_stays_black() -> None:
    assert render(sealed_box(), size=16, samples=2, **HASH).image[..., :3].max() == 0.0


def test_light_of_a_million_and_a_millionth() -> None:
    """No half floats: brightness changes nothing but itself."""
    images = [render(furnace(0.8, radiance), size=8, samples=8, seed=1, diffuse_bounces=4, **HASH).image[..., :3] / radiance
              for radiance in (1.0, 2.0**20, 2.0**-20)]
    assert np.allclose(images[1], images[0], rtol=1e-5) and np.allclose(images[2], images[0], rtol=1e-5)


def test_translucent_surfaces() -> None:
    scene = Description("cloth", Camera(look_at((0, -3, 0.5), (0, 0, 0.8)), math.radians(50)))
    scene.materials.update(cloth=node("translucent_bsdf", color=(0.8, 0.8, 0.8)), white=diffuse((0.7, 0.7, 0.7)))
    scene.add("Floor", quad((-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0)), "white")
    scene.add("Cloth", quad((-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)), "cloth")
    scene.lights = [Light("L", "area", look_at((0, 0, 2), (0, 0, 0), (0, 1, 0)), 50.0, size=(0.5, 0.5))]
    truth = indirect(scene, 4, method="PATH_TRACING", samples=256)
    agree(indirect(scene, 6, samples=32, **HASH), truth, tolerance=0.02)


def test_nothing_to_light_and_nothing_to_light_it() -> None:
    empty = Description("empty", Camera(look_at((0, -2, 0), (0, 0, 0))))
    assert render(empty, size=8, samples=2, **HASH).image[..., :3].max() == 0.0


def test_settings_are_described() -> None:
    described = {m["id"]: m for m in afterglow.method_descriptions()}["HASH_CACHE"]
    assert {"hash_cell", "hash_store", "hash_length", "hash_memory"} <= {s["name"] for s in described["settings"]}


METHODS = [m["id"] for m in afterglow.method_descriptions()]


@pytest.mark.parametrize("method", METHODS)
def test_what_is_not_given_is_as_described(method: str) -> None:
    """Each setting of each method by itself, and all together, make the same picture as none."""
    described = {m["id"]: m for m in afterglow.method_descriptions()}[method]["settings"]
    defaults = {s["name"]: s["default"] for s in described}

    def picture(**settings: Any) -> np.ndarray:
        return afterglow.render(cornell_box("glossy"), width=16, height=16, samples=48, method=method, seed=1,
                                **settings).image

    expected = picture()
    assert np.array_equal(picture(**defaults), expected)
    for name, value in defaults.items():
        assert np.array_equal(picture(**{name: value}), expected), name
