# SPDX-License-Identifier: GPL-3.0-or-later
"""The sampler's points: stratified as Owen-scrambled Sobol points must be, uniform, and independent between blocks and
seeds."""

from __future__ import annotations

import numpy as np
import pytest


@pytest.fixture(scope="module")
def sobol(library):
    import afterglow

    return afterglow.sobol


def chi2_is_plausible(counts: np.ndarray, expected: float) -> bool:
    """Pearson's χ² within five standard deviations of its mean (χ² of k bins: mean k − 1, variance 2 (k − 1))."""
    degrees = counts.size - 1
    chi2 = ((counts - expected) ** 2 / expected).sum()
    return abs(chi2 - degrees) < 5.0 * np.sqrt(2.0 * degrees)


def test_shape_range_and_repeatability(sobol) -> None:
    points = sobol(1000, 13, 7)
    assert points.shape == (1000, 13) and points.dtype == np.float32
    assert points.min() >= 0.0 and points.max() < 1.0
    assert np.array_equal(points, sobol(1000, 13, 7))
    assert np.array_equal(points[:100, :5], sobol(100, 5, 7))
    assert not np.array_equal(points, sobol(1000, 13, 8))


@pytest.mark.parametrize("seed", [0, 1, 0xFFFFFFFF])
def test_every_dimension_is_stratified(sobol, seed: int) -> None:
    """The first 2^m points of a (0, 1)-sequence put exactly one into each interval of 2^-m."""
    for m in (1, 4, 8, 12):
        n = 1 << m
        cells = np.sort(np.floor(sobol(n, 24, seed) * n).astype(int), axis=0)
        assert np.array_equal(cells, np.repeat(np.arange(n)[:, None], 24, axis=1))


@pytest.mark.parametrize("seed", [0, 5])
def test_pairs_of_a_block_are_stratified_in_every_elementary_box(sobol, seed: int) -> None:
    """The first two Sobol dimensions are a (0, 2)-sequence: one point in each box of 2^-a × 2^-b, a + b = m."""
    m = 8
    points = sobol(1 << m, 12, seed)
    for block in range(3):
        x, y = points[:, 4 * block], points[:, 4 * block + 1]
        for a in range(m + 1):
            cells = np.floor(x * (1 << a)).astype(int) * (1 << (m - a)) + np.floor(y * (1 << (m - a))).astype(int)
            assert np.array_equal(np.sort(cells), np.arange(1 << m))


def star_discrepancy(points: np.ndarray) -> float:
    """Of 2-D points, over the boxes that have their corners on a grid of 64²."""
    grid = np.arange(1, 65) / 64
    inside = (points[:, None, 0] < grid)[:, :, None] & (points[:, None, 1] < grid)[:, None, :]
    return np.abs(inside.mean(axis=0) - grid[:, None] * grid[None, :]).max()


def test_discrepancy_is_far_below_random(sobol) -> None:
    random = np.random.default_rng(1)
    for pair in ((0, 1), (2, 3), (0, 3), (4, 5), (6, 7)):
        ours = np.mean([star_discrepancy(sobol(256, 8, seed)[:, pair]) for seed in range(8)])
        theirs = np.mean([star_discrepancy(random.random((256, 2))) for _ in range(8)])
        assert ours < 0.35 * theirs, pair


def test_error_of_an_integral_falls_faster_than_random(sobol) -> None:
    """A smooth function of four dimensions: a random estimate of n points has variance σ²/n."""
    def f(u: np.ndarray) -> np.ndarray:
        return np.prod(0.5 + u[:, :4] * (1.0 + 0.5 * np.sin(3.0 * u[:, :4])), axis=1)

    n = 1024
    variance = f(np.random.default_rng(2).random((1 << 18, 4))).var() / n
    estimates = np.array([f(sobol(n, 4, seed).astype(float)).mean() for seed in range(64)])
    assert estimates.var() < variance / 50.0


def test_first_samples_over_seeds_are_uniform(sobol) -> None:
    """Pixels take few samples each: over seeds, sample 0 and sample 5 must be uniform in two dimensions, too."""
    points = np.stack([sobol(6, 6, seed) for seed in range(16384)])
    for index in (0, 5):
        for pair in ((0, 1), (1, 2), (3, 4), (0, 5)):
            cells = np.floor(points[:, index, pair] * 16).astype(int) @ [16, 1]
            counts = np.bincount(cells, minlength=256)
            assert chi2_is_plausible(counts, 16384 / 256), (index, pair)


def test_blocks_and_seeds_are_not_correlated(sobol) -> None:
    points = sobol(4096, 16, 3).astype(float) - 0.5
    for a, b in ((0, 4), (1, 5), (0, 8), (3, 12)):
        correlation = (points[:, a] * points[:, b]).mean() * 12.0
        assert abs(correlation) < 5.0 / np.sqrt(4096), (a, b)
    other = sobol(4096, 16, 4).astype(float) - 0.5
    assert np.all(np.abs((points * other).mean(axis=0) * 12.0) < 5.0 / np.sqrt(4096))


def test_bad_arguments(sobol) -> None:
    import afterglow

    with pytest.raises(afterglow.InvalidInput):
        sobol(-1, 2, 0)
    assert sobol(0, 3, 0).shape == (0, 3)
