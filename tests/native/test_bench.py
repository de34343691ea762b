# SPDX-License-Identifier: GPL-3.0-or-later
"""The arithmetic of figures: goals, pairs, crossings, deviations of means."""

import math

import numpy as np
import pytest
from afterglow import cache
from afterglow.bench.figure import Figure, Pairs, alternate
from afterglow.bench.foundation.kitchen import crossing
from afterglow.bench.foundation.light_passes import compare


@pytest.mark.parametrize(("goal", "value", "holds", "margin"), [
    ("≥ 1.2", 1.8, True, 1.5), ("≥ 1.2", 0.6, False, 0.5), ("≤ 0.012", 0.006, True, 2.0), ("≤ 0.012", 0.024, False, 0.5),
    ("= 0", 0.0, True, 1.0), ("= 0", 1e-9, False, 0.1), ("≥ 1", math.nan, False, math.nan)])
def test_goals(goal: str, value: float, holds: bool, margin: float) -> None:
    figure = Figure("f", "s", value, goal=goal).judged()
    assert figure.holds is holds
    assert figure.margin() == pytest.approx(margin, nan_ok=True)


def test_the_ratio_is_judged_where_there_is_one() -> None:
    assert Figure("f", "s", 3.0, ratio=0.5, goal="≥ 1").judged().holds is False


def test_pairs_alternate_and_have_a_median() -> None:
    order: list[str] = []
    values = iter([2.0, 1.0, 1.0, 4.0, 3.0, 1.0])
    pairs = alternate(3, lambda: (order.append("a"), next(values))[1], lambda: (order.append("b"), next(values))[1])
    assert order == ["a", "b", "b", "a", "a", "b"]
    assert pairs.ratios == [2.0, 4.0, 3.0] and pairs.median == 3.0 and pairs.spread > 0


def test_the_spread_is_that_of_a_median() -> None:
    rng = np.random.default_rng(0)
    medians, spreads = [], []
    for _ in range(400):
        pairs = Pairs(list(1 + 0.1 * rng.standard_normal(9)), [1.0] * 9)
        medians.append(pairs.median)
        spreads.append(pairs.spread)
    assert np.mean(spreads) == pytest.approx(np.std(medians), rel=0.25)


def test_crossing() -> None:
    assert crossing([(1, 0.1), (10, 0.001)], 0.01) == pytest.approx(10**0.5)
    assert crossing([(2, 0.001)], 0.01) == 2
    assert crossing([(1, 0.1), (2, 0.05)], 0.01) == math.inf


def test_means_are_compared_beyond_three_standard_errors() -> None:
    rng = np.random.default_rng(0)
    theirs = {"combined": 1 + 1e-3 * rng.standard_normal(8), "DiffInd": 0.5 + 1e-3 * rng.standard_normal(8),
              "Emit": np.full(8, 1e-6)}
    near = {name: values * 1.0001 for name, values in theirs.items()}
    assert compare(near, theirs)[0] < 1e-3
    far = {**near, "DiffInd": theirs["DiffInd"] * 1.05}
    worst, name, _ = compare(far, theirs)
    assert name == "DiffInd" and 3 < worst < 5
    assert compare({"combined": theirs["combined"]}, theirs)[0] == math.inf


def test_the_cache_keeps_arrays_by_key(tmp_path, monkeypatch) -> None:  # noqa: ANN001
    monkeypatch.setenv("AFTERGLOW_CACHE", str(tmp_path))
    made = []

    def make() -> dict[str, np.ndarray]:
        made.append(1)
        return {"a": np.arange(3)}

    for samples in (1, 1, 2):
        np.testing.assert_array_equal(cache.arrays({"kind": "test", "samples": samples}, make)["a"], np.arange(3))
    assert len(made) == 2
    for path in tmp_path.iterdir():
        path.write_bytes(b"broken")
    cache.arrays({"kind": "test", "samples": 1}, make)
    assert len(made) == 3
