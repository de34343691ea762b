# SPDX-License-Identifier: GPL-3.0-or-later
"""A few kept paths are walked again in every frame: they find what nobody announced, above all a saved cache that is loaded
into a scene whose light is another by now; where nothing changed, nothing does."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import afterglow
import numpy as np
import pytest
from afterglow.scenes import SCENES, Description
from afterglow.scenes.native import graph
from afterglow.scenes.rooms import cornell_box, diffuse
from test_hash_cache import Live
from test_hash_cache_edits import EDITS, SETTINGS, error, run, two_rooms

PROBES = 4096


def saved(path: Path, description: Description, pictures: int, **settings: Any) -> str:
    live = Live(description, start=False, **settings)
    for i in range(pictures):
        live.run(seed=500 + i)
    live.session.save_cache(str(path))
    return str(path)


@pytest.mark.parametrize("edit", ["halve_both", "switch_off", "recolour"])
def test_a_cache_that_is_loaded_into_a_changed_scene_heals(edit: str, tmp_path: Path) -> None:
    """As after the same edit with the cache alive; without walking again the old light would stay for long."""
    path = saved(tmp_path / "cells", two_rooms(), 16, **SETTINGS)
    errors = {}
    for validate in (96, 0):
        live = Live(two_rooms(), start=False, hash_validate=validate, **SETTINGS)
        EDITS[edit](live.built)
        live.built.scene.commit()
        live.session.load_cache(path)
        pictures = np.array([[live.run(seed=i) for i in range(9)]], np.float64)
        errors[validate] = [error(pictures[:, i], edit) for i in (0, 8)]
        assert live.number("cache_resets") == 0
        assert live.number("cache_unannounced") == live.number("cache_edits") == (validate > 0)
        assert (live.number("cache_validated") == 0) == (validate == 0)
    fresh = run(edit, 1, 0, 9)[0]
    assert errors[96][0] < 1.2 * error(fresh[:, 0], edit) and errors[96][1] < 1.2 * error(fresh[:, 8], edit), errors
    assert errors[0][1] > 2 * errors[96][1], errors


def test_a_lamp_halved_since_the_cache_was_saved(tmp_path: Path) -> None:
    """The light is the new one's from the first picture on: half of the old."""
    path = saved(tmp_path / "cells", cornell_box(), 16, samples=4)
    live = Live(cornell_box(), start=False, samples=4)
    live.built.scene.set_light(live.built.lights["Lamp"], power=12.5)
    live.built.scene.commit()
    live.session.load_cache(path)
    halved = [live.run(seed=i).mean(dtype=np.float64) for i in range(8)]
    fresh = Live(cornell_box(), start=False, samples=4)
    whole = [fresh.run(seed=i).mean(dtype=np.float64) for i in range(16)][8:]
    noise = np.std(whole, ddof=1)
    assert abs(halved[0] / np.mean(whole) - 0.5) < 0.02 + 3 * noise / np.mean(whole)
    assert abs(np.mean(halved) / np.mean(whole) - 0.5) < 0.01 + 3 * noise / np.mean(whole)
    assert abs(live.number("cache_ratio") - 0.5) < 0.01


def test_paths_in_turn_find_what_the_first_look_missed(tmp_path: Path) -> None:
    """A cache that was loaded while nothing was walked again; then a few paths are, others in each of the following frames."""
    path = saved(tmp_path / "cells", two_rooms(), 8, **SETTINGS)
    live = Live(two_rooms(), start=False, hash_validate=0, **SETTINGS)
    EDITS["recolour"](live.built)
    live.built.scene.commit()
    live.session.load_cache(path)
    live.run(seed=1)
    for i in range(24):
        live.run(seed=2 + i, hash_validate=8)
    assert live.number("cache_unannounced") > 0 and live.number("cache_validated") == 24 * 8
    assert live.number("cache_edits") == live.number("cache_unannounced")


@pytest.mark.parametrize("name", ["cornell_box", "cornell_glossy", "cornell_glass", "textured_room", "many_lights",
                                  "world_furnace", "veach_door"])
def test_where_nothing_changed_nothing_does(name: str) -> None:
    """All kept paths bring the same light to the bit, whatever their number; the pictures are those without walking any again."""
    pictures = []
    for validate in (0, 96, PROBES):
        live = Live(SCENES[name](), start=False, hash_validate=validate, width=24, height=24)
        for i in range(6):
            live.run(seed=i)
        pictures.append(np.array([live.look_from((0.05, -2.0, 1.0), (0, 0, 1.0)), live.run(seed=9)]))
        assert live.number("cache_unannounced") == 0 and live.number("cache_edits") == 0
        assert (live.number("cache_validated") > 0) == (validate > 0 and live.number("cache_paths") > 0)
    assert np.array_equal(pictures[0], pictures[1]) and np.array_equal(pictures[0], pictures[2])


def test_paths_take_turns() -> None:
    """As many as asked for in each frame, and after enough frames each of them."""
    live = Live(two_rooms(), start=False, hash_validate=50, **SETTINGS)
    for i in range(4):
        live.run(seed=i)
    before = live.number("cache_validated")
    live.run(seed=4)
    assert live.number("cache_validated") == before + 50


def test_an_announced_edit_is_no_surprise() -> None:
    live = Live(two_rooms(), start=False, **SETTINGS)
    for i in range(8):
        live.run(seed=i)
    live.edit(lambda: EDITS["halve_one"](live.built))
    live.edit(lambda: live.built.scene.set_material(live.built.materials["red"], graph(diffuse((0.1, 0.2, 0.7)))))
    for i in range(8):
        live.run(seed=20 + i)
    assert live.number("cache_edits") == 2 and live.number("cache_unannounced") == 0


def test_loaded_into_a_changed_scene_on_any_number_of_threads(tmp_path: Path) -> None:
    path = saved(tmp_path / "cells", two_rooms(), 4, **SETTINGS)
    images = []
    for threads in (1, 2):
        live = Live(two_rooms(), start=False, threads=threads, **SETTINGS)
        EDITS["halve_one"](live.built)
        live.built.scene.commit()
        live.session.load_cache(path)
        images.append(live.run(seed=3))
    assert np.array_equal(images[0], images[1])


def test_a_damaged_path_says_so(tmp_path: Path) -> None:
    path = Path(saved(tmp_path / "cells", cornell_box(), 2))
    whole = path.read_bytes()
    live = Live(cornell_box(), start=False)
    for at, value in ((-24, b"\xff" * 4), (-16, b"\x00" * 4), (-80, b"\x00\x00\xc0\x7f"), (-8, b"\xff\xff\xff\x7f")):
        end = len(whole) + at + len(value)
        path.write_bytes(whole[:at] + value + whole[end:])
        with pytest.raises(afterglow.InvalidInput, match="damaged"):
            live.session.load_cache(str(path))
