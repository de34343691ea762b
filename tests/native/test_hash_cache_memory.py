# SPDX-License-Identifier: GPL-3.0-or-later
"""Cells of the HashCache within a limit of memory: what goes, what stays, and that nobody pays for it with all the rest."""

from __future__ import annotations

from typing import Any

import afterglow
import pytest
from afterglow.scenes.rooms import cornell_box
from hard_cases import render
from test_hash_cache import Live

SMALL: dict[str, Any] = dict(width=96, height=96, samples=1, hash_cell=0.25, hash_extra=0.0)
MIB = 2**20


def light() -> float:
    return float(render(cornell_box(), size=32, samples=64, passes=["diffuse_indirect"],
                        diffuse_bounces=4).passes["diffuse_indirect"].mean())


def logged(action: Any) -> list[str]:
    told: list[str] = []
    afterglow.set_log(lambda level, text: told.append(text))
    try:
        action()
    finally:
        afterglow.set_log(None)
    return [text for text in told if "hash_memory" in text]


def test_memory_has_a_limit() -> None:
    told: list[str] = []
    afterglow.set_log(lambda level, text: told.append(text))
    live = Live(cornell_box(), width=96, height=96, samples=1, hash_cell=0.25, hash_memory=1.0)
    afterglow.set_log(None)
    assert sum("hash_memory" in text for text in told) == 1
    assert sum("hash_memory" in text for text in live.session.statistics()["warnings"]) == 1
    assert live.number("cache_bytes") <= MIB
    assert live.number("cells_refused") > 0
    truth = render(cornell_box(), size=32, samples=64, passes=["diffuse_indirect"],
                   diffuse_bounces=4).passes["diffuse_indirect"].mean()
    assert abs(live.session.read("diffuse_indirect").mean() / truth - 1) < 0.2


def test_a_full_cache_lives_on() -> None:
    """Later pictures of other views push out what was not seen for longest, and nothing else."""
    live = Live(cornell_box(), hash_memory=1.0, **SMALL)
    for i in range(6):
        image = live.look_from((0.05 * i, -3.9, 1), (0, 0, 1))
        assert live.number("cache_bytes") <= MIB and live.number("cache_resets") == 1
    assert live.number("cells_evicted") > 0 and live.number("cells") > 0.5 * MIB / 32
    assert abs(image.mean() / light() - 1) < 0.1


def test_a_smaller_limit_keeps_the_youngest() -> None:
    live = Live(cornell_box(), **SMALL)
    cells = live.number("cells")
    assert live.number("cache_bytes") > 1.1 * MIB
    told = logged(lambda: live.run(seed=1, hash_memory=1.0))
    assert len(told) == 1 and any("hash_memory" in text for text in live.session.statistics()["warnings"])
    assert live.number("cache_bytes") <= MIB and live.number("cache_resets") == 1
    assert 0 < live.number("cells") < cells and live.number("cells_evicted") > 0
    assert abs(live.run(seed=2).mean() / light() - 1) < 0.2


@pytest.mark.parametrize("before", [False, True])
def test_a_file_larger_than_the_memory_is_trimmed(tmp_path: Any, before: bool) -> None:
    """Whether the limit was known before it was loaded or is told after; and it is said."""
    first = Live(cornell_box(), **SMALL)
    path = str(tmp_path / "cells")
    first.session.save_cache(path)
    second = Live(cornell_box(), start=before, hash_memory=1.0, **SMALL)
    told = logged(lambda: (second.session.load_cache(path), second.run(seed=3)))
    assert told and second.number("cache_resets") == 0 and second.number("cells_evicted") > 0
    assert second.number("cache_bytes") <= MIB
    assert abs(second.session.read("diffuse_indirect").mean() / light() - 1) < 0.2
