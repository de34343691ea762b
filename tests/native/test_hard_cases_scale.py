# SPDX-License-Identifier: GPL-3.0-or-later
"""The same picture at any size, place and brightness, and on any number of threads."""

import numpy as np
import pytest
from hard_cases import Built, Light, agree, diffuse, mean, one_quad, render, scenes, translate


def image_of(scene: scenes.Description, **settings: object) -> np.ndarray:
    return render(scene, size=32, samples=64, seed=7, **settings).image[..., :3].astype(np.float64)


@pytest.mark.parametrize("factor", [1e-4, 1e-2, 1e4, 1e6])
@pytest.mark.parametrize("name", ["cornell_box", "cornell_glass"])
def test_a_scaled_scene_looks_the_same(factor: float, name: str) -> None:
    scene = scenes.make(name)
    agree(mean(scene), mean(scene.scaled(factor)), 1e-3)
    a, b = image_of(scene), image_of(scene.scaled(factor))
    assert np.median(np.abs(a - b)) < 0.05 * a.mean()


@pytest.mark.parametrize("offset", [1e3, 1e5])
def test_a_moved_scene_looks_the_same(offset: float) -> None:
    """Rays are traced relative to the camera in 64-bit transforms: 1e5 times the scene's size away nothing changes."""
    scene = scenes.make("cornell_box")
    far = scene.moved((2 * offset, -offset, 0.5 * offset))
    agree(mean(scene), mean(far), 1e-3)
    a, b = image_of(scene), image_of(far)
    assert np.median(np.abs(a - b)) < 0.05 * a.mean()


def test_lights_far_from_the_origin() -> None:
    scene = scenes.make("area_lights")
    agree(mean(scene, repeats=6), mean(scene.moved((1e5, 1e5, 0)), repeats=6), 1e-3)


@pytest.mark.parametrize("factor", [1e-4, 1e4])
def test_a_brighter_scene_is_the_same_times_the_factor(factor: float) -> None:
    scene, brighter = scenes.make("cornell_box"), scenes.make("cornell_box")
    brighter.lights[0].power *= factor
    np.testing.assert_allclose(image_of(brighter) / factor, image_of(scene), rtol=2e-3, atol=1e-6)


def test_radiance_of_1e_8_beside_1e8() -> None:
    """A dim lamp's light is right while a bright one stands behind a wall, and the other way round."""
    scene = one_quad()
    dim = [Light("Dim", "point", translate((0, 0, 1.5)), 1e-8, radius=0.1)]
    bright = [Light("Bright", "point", translate((0, 0, -1.5)), 1e8, radius=0.1)]
    scene.lights = dim
    alone = mean(scene, samples=256, max_bounces=0, diffuse_bounces=0)
    assert alone.value > 0
    scene.lights = dim + bright
    both = mean(scene, samples=256, repeats=8, max_bounces=0, diffuse_bounces=0)
    agree(alone, both, 0.02)


@pytest.mark.parametrize("name", ["cornell_box", "cornell_glossy", "textured_room", "many_lights", "sun_and_sky"])
def test_threads_do_not_decide(name: str) -> None:
    built = Built(scenes.make(name))
    one = render(built, size=48, samples=16, threads=1, seed=3)
    two = render(built, size=48, samples=16, threads=2, seed=3)
    np.testing.assert_array_equal(one.image, two.image)


def test_a_seed_repeats_and_another_differs() -> None:
    built = Built(scenes.make("cornell_box"))
    a, b, c = (render(built, samples=4, seed=s).image for s in (1, 1, 2))
    np.testing.assert_array_equal(a, b)
    assert np.abs(a - c).max() > 0


def test_a_region_is_a_part_of_the_whole() -> None:
    built = Built(scenes.make("cornell_box"))
    whole = render(built, size=40, samples=8, seed=5).image
    part = render(built, size=40, samples=8, seed=5, region=(8, 4, 30, 36)).image
    np.testing.assert_array_equal(part, whole[4:36, 8:30])


@pytest.mark.parametrize("frame", [0, -7, 12.5])
def test_any_frame_renders(frame: float) -> None:
    for name in ("kite", "wobbling_cylinder"):
        assert render(scenes.make(name), frame=frame, samples=2).image.max() > 0


def test_an_edited_scene_equals_a_fresh_one() -> None:
    """A light, a material and objects that change in every frame: after the edits the picture is that of a new scene."""
    description = scenes.SCENES["spheres"](12, 16)
    built = Built(description, 1)
    for frame in (3, 8, 5):
        built.move_to(frame)
        render(built, samples=1)
    edited = render(built, samples=8, seed=2).image
    np.testing.assert_array_equal(edited, render(Built(description, 5), samples=8, seed=2).image)


def test_a_deformed_mesh_equals_a_fresh_one() -> None:
    description = scenes.SCENES["wobbling_cylinder"](24, 24)
    built = Built(description, 1)
    for frame in range(2, 9):
        built.move_to(frame)
    edited = render(built, samples=8, seed=2).image
    np.testing.assert_allclose(edited, render(Built(description, 8), samples=8, seed=2).image, rtol=1e-5, atol=1e-6)


def test_materials_and_lights_change() -> None:
    description = scenes.make("cornell_box")
    built = Built(description)
    first = render(built, samples=8).image
    from afterglow.scenes import native

    for value in (0.2, 0.9, 0.5):
        built.scene.set_material(built.materials["white"], native.graph(diffuse((value,) * 3)), name="white")
        built.scene.set_light(built.lights["Lamp"], power=100 * value)
        built.scene.commit()
        assert np.abs(render(built, samples=8).image - first).max() > 0
