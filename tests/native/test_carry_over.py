# SPDX-License-Identifier: GPL-3.0-or-later
"""A viewport's samples outlive edits where these change nothing, and nothing of the old state is left where they do."""

from __future__ import annotations

import functools
import time
from typing import Any

import afterglow
import numpy as np
import pytest
from afterglow.scenes import Description, look_at, translate
from afterglow.scenes.native import Built
from afterglow.scenes.rooms import cornell_box, diffuse
from afterglow.scenes.shapes import sphere

SIZE, SAMPLES = 64, 24
HERE, THERE = (0.5, -0.3, 1.3), (-0.5, -0.3, 1.3)
SETTINGS: dict[str, Any] = dict(method="INSTANT_CACHE", width=SIZE, height=SIZE, viewport=True, carry_over=True, samples=SAMPLES,
                                virtual_lights=64, diffuse_bounces=3, accuracy=0.0, cache_accuracy=0.02)


def room(place: tuple[float, float, float] = HERE) -> Description:
    scene = cornell_box()
    scene.materials["ball"] = diffuse((0.2, 0.3, 0.8))
    scene.add("Ball", sphere(0.25, 24, 12), "ball", transform=translate(place))
    return scene


class View:
    def __init__(self, description: Description, **settings: Any) -> None:
        self.built = Built(description)
        self.session = afterglow.Session(self.built.scene, {**SETTINGS, **settings})
        self.session.start()
        self.session.wait()

    def move(self, place: tuple[float, float, float], wait: bool = True) -> None:
        with self.session.edit():
            self.built.scene.set_transforms(self.built.instances["Ball"], np.asarray(translate(place), np.float64)[None])
            self.built.scene.commit()
        if wait:
            self.session.wait()

    def picture(self) -> np.ndarray:
        return self.session.read("combined")[..., :3]

    def rays(self) -> float:
        """Camera rays since the last edit."""
        return float(self.session.statistics()["rays"]["camera"])

    def counts(self) -> np.ndarray:
        return np.squeeze(self.session.read("sample_count"))


@functools.cache
def truth(*places: tuple[float, float, float]) -> np.ndarray:
    """Of the last place, with the records of the way there."""
    view = View(room(places[0]), carry_over=False, samples=256)
    for place in places[1:]:
        view.move(place)
    return view.picture()


def distance(picture: np.ndarray, other: np.ndarray) -> float:
    return float(np.sqrt(((picture - other) ** 2 / (other**2 + 0.01)).mean()))


def ghost(picture: np.ndarray, old: np.ndarray, new: np.ndarray) -> float:
    """How much of the way back to the old picture it is, where the two differ."""
    changed = np.abs(new - old).sum(-1) > 0.1
    return float(((picture - new) * (old - new))[changed].sum() / ((old - new)[changed] ** 2).sum())


def test_samples_outlive_an_edit_and_the_picture_is_the_new_one() -> None:
    view = View(room(), sight=False)  # of the lamp's edges, which get rays of their own, nothing is to be learnt here
    assert view.counts().min() >= SAMPLES
    view.move(THERE)
    assert view.counts().min() >= SAMPLES
    assert view.rays() < 0.75 * SAMPLES * SIZE * SIZE, "nothing was kept"
    new, old = truth(HERE, THERE), truth(HERE)
    fresh = View(room(HERE), carry_over=False, sight=False)
    fresh.move(THERE)
    assert distance(view.picture(), new) < 1.25 * distance(fresh.picture(), new)
    # Fewer samples have fewer records: what is off without any old sample is no ghost.
    left = ghost(view.picture(), old, new) - ghost(fresh.picture(), old, new)
    assert abs(left) < 0.01, f"{left:.1%} of the old picture are left"


def test_short_rays_follow_the_first_picture_and_end_in_the_right_one() -> None:
    """They are left aside until a picture stands; what they find is then taken into the samples as an edit is."""
    wide: dict[str, Any] = dict(light_bound=4.0, samples=64)
    moved = [View(room(), **{**wide, **more}) for more in (
        dict(light_compensation=16), dict(light_compensation=16, carry_over=False, samples=256), dict(light_compensation=0))]
    for view in moved:
        view.move(THERE)
    lazy, whole, without = (view.picture().reshape(8, 8, 8, 8, 3).mean((1, 3)) for view in moved)
    seconds = [view.session.statistics()["values"]["seconds_refine"] for view in moved]
    assert seconds[0] > 0 and seconds[1] == seconds[2] == 0
    off, dark = (float(np.abs(picture / whole - 1.0).mean()) for picture in (lazy, without))
    assert off < 0.025 < 0.06 < dark, (off, dark)


def test_short_rays_that_waited_are_those_of_a_fresh_cache() -> None:
    """Edits that came before them are all remembered: another render on the same scene finds every record right."""
    more: dict[str, Any] = dict(light_compensation=8, light_bound=4.0)
    view = View(room(), **more)
    for i in range(24):
        share = i % 12 / 11
        view.move(tuple((1 - share) * a + share * b for a, b in zip(HERE, THERE, strict=True)), wait=i % 5 == 0)
        time.sleep(0.003 * (i % 4))
        if i % 7 == 3:
            with view.session.edit():
                view.built.scene.set_light(next(iter(view.built.lights.values())), power=20.0 + i)
                view.built.scene.commit()
    view.session.wait()
    view.session.cancel()
    other = afterglow.Session(view.built.scene, {**SETTINGS, **more, "viewport": False, "samples": 1, "cache_verify": True})
    other.start()
    other.wait()
    values = other.statistics()["values"]
    assert values["resets"] == 1 and values["verified_records"] > 100 and values["verified_worst"] <= 1e-5


def test_an_edit_of_nothing_keeps_everything() -> None:
    view = View(room())
    before = view.counts()
    view.move(HERE)
    assert (view.counts() >= before).all()
    assert view.rays() <= 1.05 * SIZE * SIZE


@pytest.mark.slow
def test_a_drag_that_interrupts_every_picture_ends_in_the_right_one() -> None:
    view = View(room())
    for i in range(12):
        share = i / 11
        view.move(tuple((1 - share) * a + share * b for a, b in zip(HERE, THERE, strict=True)), wait=False)
        time.sleep(0.004 * (i % 4))
    view.session.wait()
    new = truth(HERE, THERE)
    assert distance(view.picture(), new) < 1.3 * distance(View(room(THERE)).picture(), new)


@pytest.mark.slow
def test_there_and_back_again() -> None:
    view = View(room())
    for _ in range(3):
        view.move(THERE)
        view.move(HERE)
    new = truth(HERE)
    assert distance(view.picture(), new) < 1.25 * distance(View(room()).picture(), new)


def test_brighter_light_is_seen_everywhere() -> None:
    view = View(room())
    before = view.picture()
    with view.session.edit():
        view.built.scene.set_light(next(iter(view.built.lights.values())), power=60.0)
        view.built.scene.commit()
    view.session.wait()
    dark = before.sum(-1) < 0.5
    more = view.picture()[~dark].mean() / before[~dark].mean()
    assert abs((view.picture()[dark].mean() / before[dark].mean()) / more - 1.0) < 0.1, "shade and light grew apart"
    assert abs(more - 1.0) > 0.2


def test_another_camera_starts_anew() -> None:
    view = View(room())
    camera = room().camera
    with view.session.edit():
        view.built.scene.set_camera("perspective", np.asarray(look_at((0.3, -3.0, 1.2), (0.0, 0.0, 1.0)), np.float64),
                                    window=(-0.4, 0.4, -0.4, 0.4))
        view.built.scene.commit()
    view.session.wait()
    assert camera is not None
    assert view.counts().max() <= 2 * SAMPLES and view.counts().min() >= SAMPLES


def test_threads_do_not_matter() -> None:
    pictures = []
    for threads in (1, 2):
        built = Built(room())
        for place in (HERE, THERE):
            built.scene.set_transforms(built.instances["Ball"], np.asarray(translate(place), np.float64)[None])
            built.scene.commit()
            session = afterglow.Session(built.scene, {**SETTINGS, "viewport": False, "threads": threads})
            session.start()
            session.wait()
        pictures.append(session.read("combined"))
    assert np.array_equal(*pictures)


def test_frames_of_an_animation_keep_what_stands_still() -> None:
    built = Built(room())

    def frame(place: tuple[float, float, float], seed: int) -> tuple[np.ndarray, np.ndarray, float]:
        built.scene.set_transforms(built.instances["Ball"], np.asarray(translate(place), np.float64)[None])
        built.scene.commit()
        session = afterglow.Session(built.scene, {**SETTINGS, "viewport": False, "seed": seed, "passes": ["combined", "depth"]})
        session.start()
        session.wait()
        rays = session.statistics()["rays"]["camera"]
        return session.read("combined")[..., :3], np.squeeze(session.read("depth")), float(rays)

    _, _, first_rays = frame(HERE, 1)
    picture, depth, rays = frame(THERE, 2)
    assert rays < 0.75 * first_rays, "samples were not kept"
    _, fresh_depth, _ = (np.squeeze(x) for x in frame(THERE, 3))
    left = ghost(picture, truth(HERE), truth(HERE, THERE))
    assert abs(left) < 0.03, f"{left:.1%} of the old picture are left"
    assert np.array_equal(depth, fresh_depth)
    still, _, rays = frame(THERE, 4)
    assert distance(still, picture) < 0.02, "a frame in which nothing moves is another picture"
    assert rays < 0.1 * first_rays


def test_the_first_frame_takes_samples_for_those_that_follow() -> None:
    """Once: where nothing changes they stay, and what changes gets no more than any frame's."""
    built = Built(room())

    def counts(place: tuple[float, float, float], **more: Any) -> np.ndarray:
        built.scene.set_transforms(built.instances["Ball"], np.asarray(translate(place), np.float64)[None])
        built.scene.commit()
        settings = {**SETTINGS, "viewport": False, "samples": 3, "cache_first": 20, "passes": ["combined", "sample_count"],
                    **more}
        session = afterglow.Session(built.scene, settings)
        session.start()
        session.wait()
        return np.squeeze(session.read("sample_count"))

    assert counts(HERE).min() == 20
    moved = counts(THERE)
    assert moved.min() == 3 and np.median(moved) == 20
    assert counts(HERE, carry_over=False).max() == 3, "the cache was not empty"


def test_a_frame_that_cannot_be_denoised_is_smoothed() -> None:
    """What is denoised is not: the denoiser does better with noise as it is."""
    pictures = []
    for denoise in (False, True):
        built = Built(room())
        session = afterglow.Session(built.scene, {**SETTINGS, "viewport": False, "samples": 3, "denoise": denoise})
        session.start()
        session.wait()
        if session.statistics()["denoiser"]:
            pytest.skip("a copy of OpenImageDenoise is there")
        pictures.append(session.read("combined"))
    np.testing.assert_allclose(*pictures, rtol=1e-4)
