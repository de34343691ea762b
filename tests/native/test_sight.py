# SPDX-License-Identifier: GPL-3.0-or-later
"""Rays that only look at edges of what shines: the mean that the samples have, less noise, and nothing where nothing shines."""

from __future__ import annotations

from typing import Any

import afterglow
import numpy as np
import pytest
from afterglow.scenes import Camera, Description, look_at, node
from afterglow.scenes.native import Built, graph
from afterglow.scenes.rooms import background, cornell_box, diffuse, emission
from afterglow.scenes.shapes import join, quad
from hard_cases import render

SETTINGS: dict[str, Any] = dict(method="HASH_CACHE", size=24, caustics_reflective=False, caustics_refractive=False,
                                hash_extra=0.0, hash_running=False, filter_width=1.5)


def bars(slanted: float = 0.13) -> Description:
    """A bright window behind slanted bars, a floor before it."""
    scene = Description("bars", Camera(look_at((0, -4, 0), (0, 0, 0))))
    scene.materials.update(window=emission(20.0, (1.0, 0.9, 0.7)), bar=diffuse((0.5, 0.5, 0.5)))
    scene.add("Window", quad((-1, 1, -1), (1, 1, -1), (1, 1, 1), (-1, 1, 1)), "window")
    edges = [-0.9, -0.5, -0.1, 0.3, 0.7]
    scene.add("Bars", join(*[quad((x, 0, -1.5), (x + 0.17, 0, -1.5), (x + 0.17 + slanted, 0, 1.5), (x + slanted, 0, 1.5))
                             for x in edges]), "bar")
    scene.add("Floor", quad((-3, -3, -1.3), (3, -3, -1.3), (3, 3, -1.3), (-3, 3, -1.3)), "bar")
    return scene


def veiled() -> Description:
    """The window seen through a half transparent sheet that ends in the middle of the picture, before a sky."""
    scene = bars()
    scene.materials["sheet"] = node("mix_shader", shader_1=diffuse((0.2, 0.6, 0.2)),
                                    shader_2=node("transparent_bsdf", color=(1, 1, 1)), factor=0.5)
    scene.add("Sheet", quad((-2, -0.5, -0.05), (2, -0.5, -0.05), (2, -0.5, 2), (-2, -0.5, 2)), "sheet")
    scene.world = background((0.5, 0.7, 1.0), 3.0)
    return scene


def pictures(scene: Any, count: int, name: str = "combined", **settings: Any) -> np.ndarray:
    results = [render(scene, seed=10 + i, passes=["combined", name], **{**SETTINGS, **settings}) for i in range(count)]
    return np.array([r.passes[name][..., :3] for r in results], np.float64)


@pytest.mark.parametrize("make", [bars, veiled])
def test_the_mean_is_that_of_the_samples_and_edges_have_far_less_noise(make: Any) -> None:
    count = 48
    without = pictures(make(), count, samples=2, sight=False)
    looked = pictures(make(), count, samples=2)
    off = looked.mean(axis=(1, 2)) - without.mean(axis=(1, 2))
    assert (abs(off.mean(axis=0)) < 4.5 * off.std(axis=0, ddof=1) / count**0.5).all(), off.mean(axis=0)
    # Pixel by pixel, too: the square of the difference is what both errors make it.
    spread = (without.var(axis=0, ddof=1) + looked.var(axis=0, ddof=1)) / count
    square = (without.mean(axis=0) - looked.mean(axis=0)) ** 2
    assert square.sum() < 1.5 * spread.sum()
    assert looked.var(axis=0).sum() < 0.2 * without.var(axis=0).sum()


def test_passes_still_add_up_to_the_picture() -> None:
    lights = [f"{lobe}_{way}" for lobe in ("diffuse", "glossy", "transmission") for way in ("direct", "indirect")]
    colors = ["diffuse_color", "glossy_color", "transmission_color"]
    result = render(veiled(), samples=2, passes=["combined", "emission", "environment", *lights, *colors], **SETTINGS)
    total = result.passes["emission"] + result.passes["environment"]
    for light in lights:
        total = total + result.passes[light] * result.passes[f"{light.split('_')[0]}_color"]
    assert np.allclose(total, result.passes["combined"][..., :3], rtol=1e-4, atol=1e-4)


def test_batches_keep_the_picture_s_mean_and_tell_less_noise() -> None:
    told = {}
    for sight in (False, True):
        result = render(bars(), samples=64, passes=["combined", "batches"], **{**SETTINGS, "sight": sight})
        mean = result.image[..., :3] @ np.array([0.2126, 0.7152, 0.0722])
        batches = result.passes["batches"]
        assert np.allclose(batches.mean(axis=-1), mean, rtol=2e-3, atol=2e-3)
        told[sight] = batches.std(axis=-1).sum()
    assert told[True] < 0.5 * told[False]


def test_a_transparent_film_shows_no_sky() -> None:
    scene = veiled()
    scene.objects = [o for o in scene.objects if o.name != "Window"]
    count = 16
    without, looked = (pictures(scene, count, samples=2, film_transparent=True, sight=s) for s in (False, True))
    assert np.allclose(without, looked, rtol=1e-5, atol=1e-5)


def test_where_nothing_shines_the_picture_is_the_same_to_the_bit() -> None:
    scene = cornell_box("indirect")  # its lamp stands behind a shade
    images = [pictures(scene, 1, samples=4, sight=s, hash_extra=2.0) for s in (False, True)]
    assert np.array_equal(*images)


def test_a_pixel_that_is_a_point_has_no_edges() -> None:
    settings = {**SETTINGS, "pixel_filter": "GAUSSIAN", "samples": 1}
    wide, point = (render(bars(), **{**settings, "filter_width": width}).statistics["values"]["looks"] for width in (1.5, 0.01))
    assert wide > 0 and point == 0


def test_one_and_three_threads_look_alike() -> None:
    images = [pictures(veiled(), 1, samples=3, hash_extra=1.0, threads=n) for n in (1, 3)]
    assert np.array_equal(*images)


@pytest.mark.parametrize("method", ["INSTANT_RADIOSITY", "INSTANT_CACHE", "HASH_CACHE"])
def test_every_method_of_a_cache_looks(method: str) -> None:
    without, looked = (pictures(bars(), 8, method=method, samples=2, sight=s) for s in (False, True))
    assert looked.var(axis=0).sum() < 0.3 * without.var(axis=0).sum()


def test_after_an_edit_nothing_is_left_of_what_was_seen() -> None:
    """The window turns blue and dim under a film that keeps its samples: what it saw is forgotten."""
    built = Built(bars())
    built.set_camera((32, 32), 0)
    built.scene.commit()
    settings = {"width": 32, "height": 32, "samples": 2, "method": "INSTANT_CACHE", "carry_over": True, "passes": ["emission"]}
    session = afterglow.Session(built.scene, settings)
    session.start()
    session.wait()
    before = session.read("emission")
    assert before[..., 0].max() > 15
    first = session.statistics()["rays"]["camera"]
    with session.edit():
        built.scene.commit()
    session.wait()
    assert session.statistics()["rays"]["camera"] < 0.2 * first, "an edit of nothing keeps what was seen"
    with session.edit():
        built.scene.set_material(built.materials["window"], graph(emission(1.0, (0.0, 0.0, 1.0))))
        built.scene.commit()
    session.wait()
    after = session.read("emission")
    assert after[..., 0].max() < 1e-3 and 0.9 < after[..., 2].max() < 1.01


def test_a_bar_thinner_than_a_pixel_is_found() -> None:
    """One sample in eight meets it; what rays saw at its neighbours leads on along it, so that no part of it is missing."""
    scene = bars(0.03)
    scene.objects = [o for o in scene.objects if o.name != "Bars"]
    scene.add("Cord", quad((0, 0, -1.5), (0.02, 0, -1.5), (0.05, 0, 1.5), (0.03, 0, 1.5)), "bar")
    truth = pictures(scene, 1, "emission", samples=1024, sight=False)[0]
    window = truth[..., 0] > 0.5 * truth[..., 0].max()
    worst = [np.abs(picture - truth)[window].max() for picture in pictures(scene, 6, "emission", samples=1)]
    assert np.mean(worst) < 0.3 * truth.max(), worst
