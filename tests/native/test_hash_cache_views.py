# SPDX-License-Identifier: GPL-3.0-or-later
"""What the debug views of the HashCache show: colours of the cells that answer, and nothing on top of them."""

from __future__ import annotations

import math
from typing import Any

import afterglow
import numpy as np
import pytest
from afterglow.scenes import Camera, Description, Light, look_at, translate
from afterglow.scenes.rooms import cornell_box, diffuse
from afterglow.scenes.shapes import quad
from hard_cases import render
from test_hash_cache import HASH, Live

VIEWS = ["LEVEL", "COUNT", "AGE", "SIDE"]


def wall(albedo: float, lit: bool = True) -> Description:
    """In y = 0, seen from y = -3, a ceiling over both of its sides."""
    scene = Description("wall", Camera(look_at((0, -3, 0), (0, 0, 0)), math.radians(30)))
    scene.materials.update(wall=diffuse((albedo, albedo, albedo)), white=diffuse((0.7, 0.7, 0.7)))
    scene.add("Wall", quad((-4, 0, -4), (4, 0, -4), (4, 0, 4), (-4, 0, 4)), "wall")
    scene.add("Ceiling", quad((-8, -8, 5), (-8, 8, 5), (8, 8, 5), (8, -8, 5)), "white")
    scene.lights = [Light(f"L{y}", "point", translate((0, y, 1)), 200.0 if lit else 0.0) for y in (-4, 4)]
    return scene


def picture(scene: Description, view: str, **settings: Any) -> np.ndarray:
    return render(scene, size=24, samples=1, **{"hash_view": view, "hash_extra": 0.0, **HASH, **settings}).image[..., :3]


@pytest.mark.parametrize("view", VIEWS)
def test_colours_are_shown_as_they_are(view: str) -> None:
    """On a surface of any albedo and under any light the same; each pixel has its cell's colour, not a mixture."""
    images = [picture(wall(albedo, lit), view, pixel_filter="BOX", filter_width=0.01)
              for albedo, lit in ((1e-4, True), (0.8, True), (0.8, False))]
    assert images[0].max() > 0.5
    if view != "COUNT":  # paths from the ceiling end in what the wall sends
        assert np.array_equal(images[0], images[1]) and np.array_equal(images[1], images[2])
    assert np.allclose(images[0].max(-1), images[1].max(-1), atol=0.3)
    levels = len(np.unique(images[1].reshape(-1, 3), axis=0))
    assert levels <= {"LEVEL": 2, "COUNT": 24, "AGE": 1, "SIDE": 1}[view]


@pytest.mark.parametrize("view", VIEWS)
def test_debug_views_show_something(view: str) -> None:
    shown, light = picture(cornell_box(), view), picture(cornell_box(), "LIGHT")
    assert shown.max() > 0 and not np.allclose(shown, light)


def test_the_sides_of_a_wall() -> None:
    """Blue where the normal's largest component is positive, red where it is negative."""
    live = Live(wall(0.5), hash_view="SIDE", hash_extra=0.0, passes=["combined", "diffuse_indirect"])
    colours = []
    for y in (-3.0, 3.0):
        live.look_from((0, y, 0), (0, 0, 0))
        colours.append(live.session.read("combined")[..., :3].mean((0, 1)))
    assert colours[0][0] > 0.9 and colours[0][2] < 0.1  # seen against the axis: its back
    assert colours[1][2] > 0.9 and colours[1][0] < 0.1


@pytest.mark.parametrize(("view", "resolution"), [("COUNT", 1.0), ("AGE", 0.0)])
def test_count_and_age_grow(view: str, resolution: float) -> None:
    """From blue towards red: samples with every picture, or passes since the last of them."""
    live = Live(wall(0.5), hash_view=view, hash_extra=0.0, samples=1)
    colours = []
    for seed in range(41):
        live.run(seed=seed, **({"hash_resolution": resolution} if seed else {}))
        if seed % 20 == 0:
            colours.append(live.session.read("combined")[..., :3].mean((0, 1)))
    blue = [c[2] for c in colours]
    assert blue[0] > blue[1] + 0.1 and blue[1] >= blue[2] and colours[2][0] >= colours[0][0]


def test_an_unknown_view_says_so() -> None:
    with pytest.raises(afterglow.InvalidInput, match="hash_view"):
        render(cornell_box(), size=8, samples=1, hash_view="NOISE", **HASH)
