# SPDX-License-Identifier: GPL-3.0-or-later
"""The HashCache in files: what is saved comes back as it was, and what does not fit is refused."""

from __future__ import annotations

import itertools
from typing import Any

import afterglow
import numpy as np
import pytest
from afterglow import _native
from afterglow.scenes.rooms import cornell_box, furnace
from test_hash_cache import Live


def test_a_saved_cache_is_the_same_after_reload(tmp_path: Any) -> None:
    first = Live(cornell_box())
    path, again = str(tmp_path / "cells"), str(tmp_path / "again")
    first.session.save_cache(path)
    second = Live(cornell_box(), start=False)
    second.session.load_cache(path)
    second.session.save_cache(again)
    assert open(path, "rb").read() == open(again, "rb").read()
    assert np.array_equal(first.run(seed=7), second.run(seed=7))
    assert second.number("cache_resets") == 0 and second.number("cells") == first.number("cells")


def test_what_cannot_be_loaded_says_so(tmp_path: Any) -> None:
    live = Live(cornell_box(), start=False)
    path = tmp_path / "cells"
    with pytest.raises(afterglow.InvalidInput, match="remembers nothing"):
        live.session.save_cache(str(path))
    with pytest.raises(afterglow.FileError):
        live.session.load_cache(str(tmp_path / "nowhere" / "cells"))
    live.run()
    live.session.save_cache(str(path))
    with pytest.raises(afterglow.FileError):
        live.session.save_cache(str(tmp_path / "nowhere" / "cells"))
    with pytest.raises(afterglow.InvalidInput, match="another scene"):
        Live(furnace(0.5), start=False).session.load_cache(str(path))
    whole = path.read_bytes()
    for broken in (b"", whole[:100], whole[:-5], b"x" + whole[1:], whole[:-24] + bytes(24)):
        path.write_bytes(broken)
        with pytest.raises(afterglow.InvalidInput):
            live.session.load_cache(str(path))
    light = live.run(seed=3)
    assert np.isfinite(light).all() and live.number("cache_resets") == 1  # nothing was lost


OTHERS: dict[str, Any] = dict(hash_store=2, hash_length=3, hash_cell=2.0, hash_direct=True, hash_long_paths=0.5, max_bounces=7,
                              diffuse_bounces=3, glossy_bounces=2, transmission_bounces=5, transparent_max_bounces=6,
                              caustics_reflective=False, caustics_refractive=False, sample_clamp_indirect=4.0)


@pytest.mark.parametrize("name", [*OTHERS, "all"])
def test_a_loaded_cache_stays_whatever_it_was_filled_with(tmp_path: Any, name: str) -> None:
    """And is dropped where the settings say other light."""
    settings = OTHERS if name == "all" else {name: OTHERS[name]}
    first = Live(cornell_box(), **settings)
    path = str(tmp_path / "cells")
    first.session.save_cache(path)
    second = Live(cornell_box(), start=False, **settings)
    second.session.load_cache(path)
    second.run(seed=5)
    assert second.number("cache_resets") == 0
    other = Live(cornell_box(), start=False)
    other.session.load_cache(path)
    other.run(seed=5)
    assert other.number("cache_resets") == 1


HEADER, ENTRY = 160, np.dtype([("key", "<u8"), ("tag", "<u4"), ("word", "<u4"), ("packed", "<u8")])


def cells_of(whole: bytes, level: int, owners: int) -> dict[tuple[int, ...], tuple[int, np.ndarray]]:
    """(x, y, z, owner): samples and sum of light of the file's cells of a level, by the keys of all cells within bounds."""
    records = int(np.frombuffer(whole, "<u8", 1, 24)[0])
    entries = np.frombuffer(whole, ENTRY, records, HEADER)
    low, high = np.frombuffer(whole, "<f4", 6, 40).reshape(2, 3)
    finest, *corner = np.frombuffer(whole, "<f4", 4, 88)
    first, last = (np.floor((at - corner) / finest).astype(np.int64) >> level for at in (low, high))
    ranges = [np.arange(a - 1, b + 2) for a, b in zip(first, last, strict=True)]
    places = np.stack(np.meshgrid(*ranges, indexing="ij"), -1).reshape(-1, 3)
    found = {}
    order = np.argsort(entries["key"])
    for owner in (o | way for o in range(owners) for way in (0, 1 << 31)):
        cells = np.concatenate([places, np.full((len(places), 1), owner), np.full((len(places), 1), level)], 1)
        keys = _native.cell_keys(cells)
        there = entries[order[np.searchsorted(entries["key"], keys, sorter=order).clip(0, records - 1)]]
        known = there["key"] == keys
        for cell, e in zip(cells[known], there[known], strict=True):
            word, packed = int(e["word"]), int(e["packed"])
            unit = 2.0 ** (((packed >> 57) << 1 | word & 1) - 127)
            light = np.array([packed >> 19 * c & (1 << 19) - 1 for c in range(3)]) * unit
            found[(*(int(v) for v in cell[:4]),)] = (word >> 13, light * (word >> 13))
    return found


def test_a_cell_is_the_sum_of_its_children(tmp_path: Any) -> None:
    """Above the levels of the picture's footprints, where samples join their cells first."""
    live = Live(cornell_box(), hash_cell=0.25)
    path = tmp_path / "cells"
    live.session.save_cache(str(path))
    levels = [cells_of(path.read_bytes(), level, 8 * 16) for level in (17, 18, 19)]
    for children, parents in itertools.pairwise(levels):
        sums: dict[tuple[int, ...], list[Any]] = {}
        for (x, y, z, owner), (count, light) in children.items():
            total = sums.setdefault((x >> 1, y >> 1, z >> 1, owner), [0, np.zeros(3)])
            total[0] += count
            total[1] = total[1] + light
        assert len(parents) > 10 and sums.keys() == parents.keys()
        for cell, (count, light) in parents.items():
            assert count == sums[cell][0] and np.allclose(light, sums[cell][1], rtol=1e-4, atol=1e-6 * count)
