# SPDX-License-Identifier: GPL-3.0-or-later
"""The error that a render believes it has is honest: a pixel's 95 % interval (± 2.131 standard errors, Student's t of sixteen
batches) holds the truth 93–97 times in a hundred, and the whole image's error is the one that is measured.

Coverage is counted over pixels and seeds, at those pixels whose truth is known: its own error, told by independent long
renders, is below a fifth of the error under test; what is left of it widens the interval."""

from __future__ import annotations

from dataclasses import dataclass

import afterglow
import numpy as np
import pytest
from afterglow import scenes
from afterglow.scenes.native import Built

STUDENT_15 = 2.1314  # 97.5 % quantile of Student's t with 15 degrees of freedom
LUMA = np.array([0.2126, 0.7152, 0.0722])
BOXES = ("cornell_box", "cornell_emissive", "cornell_glossy", "cornell_glass", "cornell_textured", "cornell_many_lights")


def luminance(result: afterglow.Result) -> np.ndarray:
    return result.image[..., :3].astype(float) @ LUMA


def shoot(built: Built, size: int, samples: int, seed: int, **more: object) -> afterglow.Result:
    return afterglow.render(built, width=size, height=size, samples=samples, seed=seed, passes=("combined", "error", "batches"),
                            max_bounces=12, diffuse_bounces=12, glossy_bounces=12, transmission_bounces=12, **more)


@dataclass
class Coverage:
    share: float  # of intervals that hold the truth
    error: float  # of that share, from the spread over seeds
    alone: float  # the same with each pixel's own batches only
    known: float  # share of pixels whose truth is known well enough
    over: float  # share of these whose intervals hold it less than every other time


def coverage(name: str, samples: int, size: int, tried: int, truths: int = 6, long: int = 2048) -> Coverage:
    built = Built(scenes.make(name))
    references = np.array([luminance(shoot(built, size, long, 9000 + i)) for i in range(truths)])
    truth, truth_error = references.mean(0), references.std(0, ddof=1) / truths**0.5
    renders = [shoot(built, size, samples, i) for i in range(tried)]
    errors = np.array([r.passes["error"][..., 0] for r in renders], float)
    alone = np.array([r.passes["batches"].std(-1, ddof=1) / 4 for r in renders], float)
    off = np.abs(np.array([luminance(r) for r in renders]) - truth)
    known = truth_error < 0.2 * np.sqrt((errors**2).mean(0))
    inside = (off <= STUDENT_15 * np.hypot(errors, truth_error))[:, known]
    inside_alone = (off <= STUDENT_15 * np.hypot(alone, truth_error))[:, known]
    by_seed = inside.mean(1)
    return Coverage(float(by_seed.mean()), float(by_seed.std(ddof=1) / tried**0.5), float(inside_alone.mean()),
                    float(known.mean()), float((inside.mean(0) < 0.5).mean()))


def check(found: Coverage) -> None:
    assert found.known > 0.8, found
    assert 0.93 <= found.share <= 0.97, found
    assert found.error < 0.01 and found.over < 0.03, found


def test_pixel_intervals_cover_the_truth() -> None:
    check(coverage("cornell_box", 64, size=20, tried=12, truths=4))


@pytest.mark.slow
@pytest.mark.parametrize(("name", "samples"), [*((name, 64) for name in BOXES), ("cornell_box", 256), ("cornell_glossy", 256)])
def test_pixel_intervals_of_all_boxes(name: str, samples: int) -> None:
    check(coverage(name, samples, size=24, tried=8, truths=4, long=32 * samples))


@pytest.mark.parametrize("samples", [1, 4, 5, 8, 63, 64, 65, 100, 128])
def test_batches_are_runs_of_four_in_turn(samples: int) -> None:
    """Sample i is in batch i / 4 mod 16: counted with a light that only shows in the mean."""
    built = Built(scenes.make("cornell_box"))
    result = shoot(built, 8, samples, 0)
    counts = np.bincount(np.arange(samples) // 4 % 16, minlength=16)
    mean = (result.passes["batches"] * counts).sum(-1) / samples
    np.testing.assert_allclose(mean, luminance(result), rtol=1e-4, atol=1e-6)
    assert ((result.passes["batches"] != 0).any((0, 1)) == (counts > 0)).all()
    assert (result.passes["error"].max() > 0) == (samples > 4)


def pooled(batches: np.ndarray, samples: int) -> np.ndarray:
    """The estimate by its definition, with equal batches: own variances relative to the 3×3 brightness, averaged over 5×5."""

    def blur(plane: np.ndarray, kernel: list[int]) -> np.ndarray:
        reach = len(kernel) // 2
        for axis in (0, 1):
            padded = np.moveaxis(np.pad(plane, reach), axis, 0)
            size = padded.shape[0] - 2 * reach
            plane = np.moveaxis(sum(w * padded[i : i + size] for i, w in enumerate(kernel)), 0, axis)
            plane = plane[reach:-reach] if axis == 1 else plane[:, reach:-reach]
        return plane

    ones = np.ones(batches.shape[:2])
    mean = batches.mean(-1, dtype=float)
    smooth = blur(mean, [1, 2, 1]) / blur(ones, [1, 2, 1])
    scale = smooth**2 + 1e-3 * mean.mean() ** 2
    relative = batches.var(-1, ddof=1, dtype=float) / 16 / scale
    return np.sqrt(blur(relative, [1, 4, 6, 4, 1]) / blur(ones, [1, 4, 6, 4, 1]) * scale)


def test_the_error_pass_is_the_batches_shared_by_neighbours() -> None:
    result = shoot(Built(scenes.make("cornell_box")), 24, 64, 0)
    np.testing.assert_allclose(result.passes["error"][..., 0], pooled(result.passes["batches"], 64), rtol=2e-3, atol=1e-6)


def test_the_believed_error_is_the_measured_one() -> None:
    """That of the whole image against the truth, over seeds."""
    built = Built(scenes.make("cornell_box"))
    tried = [shoot(built, 24, 64, seed) for seed in range(40)]
    truth = np.mean([luminance(r) for r in tried], 0)
    scale = 0.5 / truth.mean()
    measured, believed = [], []
    for result in tried:
        # The image is one of those that the truth was made of: 1 − 1/n of its error is left.
        error = ((luminance(result) - truth) * scale) ** 2 / (1 - 1 / len(tried))
        measured.append(float((error / ((truth * scale) ** 2 + 0.01)).mean()) ** 0.5)
        believed.append(result.statistics["believed_error"])
    assert np.mean(believed) == pytest.approx(np.mean(measured), rel=0.08)


@pytest.mark.parametrize("accuracy", [0.2, 0.1])
def test_a_target_error_is_met(accuracy: float) -> None:
    """With an accuracy a render stops by itself, and the error that it has is the one that was asked for."""
    built = Built(scenes.make("cornell_box"))
    truth = luminance(shoot(built, 24, 8192, 99))
    scale = 0.5 / truth.mean()
    result = shoot(built, 24, 100_000, 3, accuracy=accuracy)
    error = float((((luminance(result) - truth) * scale) ** 2 / ((truth * scale) ** 2 + 0.01)).mean()) ** 0.5
    assert 64 <= result.statistics["samples"] < 20_000
    assert error < 1.15 * accuracy
    if result.statistics["samples"] > 64:  # no more samples than it takes, but for the last sixteen
        assert error > 0.7 * accuracy
