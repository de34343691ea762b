# SPDX-License-Identifier: GPL-3.0-or-later
"""What a cell of the HashCache keeps in 16 bytes, and the keys by which cells are found."""

from __future__ import annotations

import afterglow
import numpy as np
import pytest
from afterglow import _native

MOST = 2**19 - 1
UNIT = 2.0**-18  # of a mantissa, relative to the brightest channel, at most


def kept(light: float | tuple[float, float, float]) -> np.ndarray:
    value = np.broadcast_to(np.asarray(light, float), 3)
    return np.asarray(_native.updated_cell(0.0, 0, value[None])["light"])


def running(start: float, count: int, values: np.ndarray) -> float:
    """The mean that no rounding touched."""
    mean = start
    for value in values:
        count = min(count + 1, MOST)
        mean += (value - mean) / count
    return mean


@pytest.mark.parametrize("light", [1.0, 1e6, 1e30, 1e-6, 1e-30, (1.0, 1e-3, 0.0), (3.0, 1e6, 2e5)])
def test_light_is_kept_to_one_part_in_a_quarter_of_a_million(light: float | tuple[float, float, float]) -> None:
    found = kept(light)
    assert (np.abs(found - light) <= UNIT * np.max(light)).all() and (found[np.broadcast_to(light, 3) == 0.0] == 0).all()


def test_beyond_the_limits() -> None:
    assert (kept(1e-33) == 0.0).all()
    assert np.isfinite(kept(3e38)).all() and (kept(3e38) > 1.6e38).all()
    with pytest.raises(afterglow.InvalidInput, match="samples"):
        _native.updated_cell(0.0, 0, np.ones((1, 3)), 0)
    with pytest.raises(afterglow.InvalidInput, match="sums"):
        _native.updated_cell(0.0, 0, np.ones(3))


def test_a_million_samples_one_by_one() -> None:
    """Rounding adds a noise of units × sqrt(samples / 12) at most; the samples' own noise stands in both means."""
    rng = np.random.default_rng(1)
    values = rng.exponential(size=10**6)
    found = _native.updated_cell(0.0, 0, np.repeat(values[:, None], 3, 1))
    noise = UNIT * (MOST / 12) ** 0.5
    assert found["count"] == MOST
    assert (np.abs(np.asarray(found["light"]) - running(0.0, 0, values)) < 4.5 * noise).all()
    assert noise < 0.6 / MOST**0.5  # below what the samples themselves leave in it


def test_equal_samples_give_themselves() -> None:
    found = _native.updated_cell(0.0, 0, np.tile([1.0, 0.5, 0.25], (10**6, 1)))
    assert found["light"] == (1.0, 0.5, 0.25)


@pytest.mark.parametrize("change", [1.01, 0.99, 2.0, 0.0])
def test_a_full_count_heals(change: float) -> None:
    """A sample's share in the mean is a hundredth of what the mantissas tell apart, or less: yet the mean follows."""
    updates, cells = 10**6, 8
    left = (1 - 1 / MOST) ** updates
    starts = [1.0 + 1e-4 * i for i in range(cells)]
    errors = [_native.updated_cell(start, MOST, np.full((updates, 3), change))["light"][1]
              - (change + (start - change) * left) for start in starts]
    noise = 2 * UNIT * (MOST / 12) ** 0.5 / cells**0.5  # a unit is twice as large above 2
    assert abs(np.mean(errors)) < min(4.5 * noise, 0.5 * abs(change - 1) * (1 - left))


def test_more_than_two_to_the_24_samples() -> None:
    rng = np.random.default_rng(2)
    sums = rng.gamma(1024, 1e6, size=(2**15, 1)).repeat(3, 1)
    found = _native.updated_cell(0.0, 0, sums, 1024)
    assert found["count"] == MOST
    window = MOST / 1024  # updates that the mean remembers
    assert (np.abs(np.asarray(found["light"]) / 1e6 - 1) < 4.5 * (1 / (1024 * window)) ** 0.5 + 1e-3).all()


def lattice(edge: int, level: int = 0, owner: int = 8) -> np.ndarray:
    at = np.stack(np.meshgrid(*[np.arange(-edge, edge)] * 3, indexing="ij"), -1).reshape(-1, 3)
    return np.concatenate([at, np.full((len(at), 1), owner), np.full((len(at), 1), level)], 1)


def test_keys_of_neighbours_differ_and_spread_evenly() -> None:
    cells = np.concatenate([lattice(40, level, owner) for level in (0, 1, 20) for owner in (0, 1, 9, 2**31 + 1)])
    keys = _native.cell_keys(cells)
    assert len(np.unique(keys)) == len(keys) and ((keys & np.uint64(0xFFFFFFFF)) != 0).all()
    halves, n = keys & np.uint64(0xFFFFFFFF), len(keys)
    pairs = n - len(np.unique(halves))
    expected = n * n / 2 / 2**32
    assert abs(pairs - expected) < 5 * expected**0.5
    for shift in (0, 16, 24, 40, 48):  # parts, buckets, tags
        counts = np.bincount(((keys >> np.uint64(shift)) & np.uint64(0xFFFF)).astype(np.int64), minlength=65536)
        chi2 = ((counts - n / 65536) ** 2 / (n / 65536)).sum()
        assert abs(chi2 - 65535) < 5 * (2 * 65535) ** 0.5, shift


def test_every_bit_of_a_cell_changes_half_of_its_key() -> None:
    rng = np.random.default_rng(3)
    parts = [rng.integers(-2000, 2000, (4000, 3)), rng.integers(0, 2**20, (4000, 1)), rng.integers(0, 20, (4000, 1))]
    cells = np.concatenate(parts, 1)
    keys = _native.cell_keys(cells)
    for column, bits in ((0, 20), (1, 20), (2, 20), (3, 32), (4, 5)):
        for bit in range(bits):
            other = cells.copy()
            other[:, column] ^= 1 << bit
            changed = keys ^ _native.cell_keys(other)
            share = np.unpackbits(changed.view(np.uint8).reshape(len(cells), 8), axis=1).mean(0)
            assert (np.abs(share - 0.5) < 6 * 0.5 / len(cells) ** 0.5).all(), (column, bit)
