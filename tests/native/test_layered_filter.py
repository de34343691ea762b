# SPDX-License-Identifier: GPL-3.0-or-later
"""The layered filter as the HashCache uses it: less error where cells hold few samples, none of it across edges."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from afterglow.scenes.rooms import cornell_box, furnace
from hard_cases import render

SETTINGS: dict[str, Any] = dict(method="HASH_CACHE", diffuse_bounces=4, passes=["diffuse_indirect"], caustics_reflective=False)


def errors(variant: str, samples: int) -> tuple[float, float]:
    """Median relative square of the error without and with the filter."""
    scene = cornell_box(variant)
    truth = render(scene, size=40, samples=1024, **{**SETTINGS, "method": "PATH_TRACING"}).passes["diffuse_indirect"]
    scale = truth.mean()
    found = []
    for on in (False, True):
        images = [render(scene, size=40, samples=samples, seed=i, hash_filter=on, **SETTINGS).passes["diffuse_indirect"]
                  for i in range(4)]
        found.append(float(np.mean([np.median((x - truth) ** 2) for x in images])) / float(scale**2))
    return found[0], found[1]


def test_one_sample_is_smoother_with_it() -> None:
    for variant in ("diffuse", "mirror"):
        without, with_it = errors(variant, 1)
        assert with_it < 0.75 * without


def test_light_that_is_even_stays_as_it_is() -> None:
    on, off = (render(furnace(0.5, shape="box"), size=16, samples=8, hash_filter=f, seed=1, **SETTINGS).passes["diffuse_indirect"]
               for f in (True, False))
    assert abs(on.mean() / off.mean() - 1) < 0.01 and on.std() < off.std()


def test_any_number_of_threads() -> None:
    one, two = (render(cornell_box("mirror"), size=40, samples=2, threads=n, seed=5, **SETTINGS).image for n in (1, 2))
    assert np.array_equal(one, two)


@pytest.mark.parametrize("factor", [1024.0, 1 / 1024])
def test_a_scaled_scene_is_filtered_alike(factor: float) -> None:
    """Cells and all numbers scale with powers of two: nothing differs but what a length without a measure would change."""
    scene = cornell_box("mirror")
    a, b, bare = (render(s, size=40, samples=1, seed=3, hash_filter=f, **SETTINGS).passes["diffuse_indirect"]
                  for s, f in ((scene, True), (scene.scaled(factor), True), (scene, False)))
    assert np.array_equal(a, b) and np.abs(a - bare).mean() > 0.02 * a.mean()
