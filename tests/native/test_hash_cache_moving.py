# SPDX-License-Identifier: GPL-3.0-or-later
"""A viewport whose view moves: its coarse pictures send a share of the caching paths, its resting ones all of them."""

from __future__ import annotations

from typing import Any

import numpy as np
from afterglow import _native
from afterglow.scenes.rooms import cornell_box
from hard_cases import Mean, agree, render
from test_hash_cache import Live

# So few pixels that passes are never timed: the first one is always of every eighth pixel.
SMALL: dict[str, Any] = dict(width=11, height=11, viewport=True, samples=1, hash_extra=0.0)
STEPS = [8, 4, 2, 1]
PLACES = [((0.1 * i, -3.5, 1.0), (0, 0, 1.0)) for i in range(4)]


def test_the_share_is_of_the_view_and_the_step_alone() -> None:
    for step in (1, 2, 4, 8, 16, 32):
        assert _native.caching_share(False, step) == 1.0
        assert _native.caching_share(True, step) == (1.0 if step == 1 else 0.25)


def paths(live: Live) -> float:
    assert [p["step"] for p in live.session.statistics()["passes_log"]] == STEPS
    return live.number("cache_paths")


def test_only_coarse_pictures_of_a_view_that_moved_send_fewer_paths() -> None:
    """A quarter of them. Cells that were filled before, so that none is sent for a hole."""
    live = Live(cornell_box(), hash_enough=1e9, **SMALL)
    for _ in range(3):
        for place in PLACES[:2]:
            live.look_from(*place)
    before = paths(live)
    live.look_from(*PLACES[0])
    moved = paths(live) - before
    live.run(seed=5)  # it rests: nothing but the seed is another
    rested = paths(live) - before - moved
    questions = live.session.statistics()["values"]["questions"]
    coarse, full = questions * 36 / 121, questions * 85 / 121
    assert rested == questions and abs(moved - (full + coarse / 4)) < 4.5 * (coarse * 0.25 * 0.75) ** 0.5 + 1


def test_moving_views_have_the_same_pictures_on_any_number_of_threads() -> None:
    pictures = []
    for threads in (1, 2):
        live = Live(cornell_box("glossy"), threads=threads, **SMALL)
        pictures.append(np.array([live.look_from(*place) for place in PLACES]))
    assert np.array_equal(*pictures)


def test_a_walk_ends_with_the_right_light() -> None:
    """Coarse pictures' few paths are no other than the rest's."""
    found = []
    for seed in range(6):
        live = Live(cornell_box(), seed=100 * seed, **{**SMALL, "samples": 4})
        for place in PLACES[1:] * 4:
            live.look_from(*place)
        found.append(float(live.session.read("diffuse_indirect").mean(dtype=np.float64)))
    scene = cornell_box()
    scene.camera = live.built.description.camera
    truth = [float(render(scene, size=11, samples=128, seed=s, diffuse_bounces=4, passes=["diffuse_indirect"]
                          ).passes["diffuse_indirect"].mean(dtype=np.float64)) for s in range(4)]
    means = [Mean(float(np.mean(v)), float(np.std(v, ddof=1) / len(v) ** 0.5)) for v in (found, truth)]
    agree(*means, tolerance=0.01)


def test_other_methods_know_nothing_of_it() -> None:
    """A view that moved ends with the picture of one that did not."""
    moved, still = (Live(cornell_box(), start=False, **{**SMALL, "method": "PATH_TRACING"}) for _ in range(2))
    moved.run()
    image = moved.look_from(*PLACES[2])
    still.look_from(*PLACES[2])
    np.testing.assert_allclose(image, still.run(), rtol=1e-4, atol=1e-5 * float(image.mean()))
