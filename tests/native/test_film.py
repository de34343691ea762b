# SPDX-License-Identifier: GPL-3.0-or-later
"""The film: pixel filters, regions, batches and the honesty of the error estimate."""

from __future__ import annotations

import numpy as np
import pytest
from afterglow.scenes import Camera, Description, look_at
from afterglow.scenes.rooms import emission
from afterglow.scenes.shapes import quad
from hard_cases import mean, render

T_975_15 = 2.1314  # Student's t, 15 degrees of freedom, two-sided 95 %


def half_plane() -> Description:
    """White to the right of the image's middle, which lies on a pixel's border."""
    scene = Description("half_plane", Camera(look_at((0, -1, 0), (0, 0, 0)), kind="orthographic", width=16.0))
    scene.materials["white"] = emission(1.0)
    scene.add("Half", quad((0, 0, -9), (9, 0, -9), (9, 0, 9), (0, 0, 9)), "white")
    return scene


def share_beyond(kind: str, width: float, x: float) -> float:
    """Integral of the filter from x to its end."""
    half = {"BOX": 0.5, "GAUSSIAN": 1.5 * width, "BLACKMAN_HARRIS": width}[kind]  # as Blender's setting means it
    at = (np.arange(200_000) + 0.5) / 200_000 * 2 * half - half
    if kind == "BOX":
        f = np.ones_like(at)
    elif kind == "GAUSSIAN":
        f = np.exp(-2 * (3 * at / half) ** 2)
    else:
        v = np.pi * (at / half + 1)
        f = 0.35875 - 0.48829 * np.cos(v) + 0.14128 * np.cos(2 * v) - 0.01168 * np.cos(3 * v)
    return float(f[at > x].sum() / f.sum())


@pytest.mark.parametrize(("kind", "width"), [("BLACKMAN_HARRIS", 1.5), ("BLACKMAN_HARRIS", 2.5), ("GAUSSIAN", 1.5), ("BOX", 1.5)])
def test_filter_spreads_an_edge_as_its_integral(kind: str, width: float) -> None:
    image = render(half_plane(), size=16, samples=1024, pixel_filter=kind, filter_width=width).image
    profile = image[4:12, :, 0].mean(0)
    for pixel in range(4, 12):
        assert profile[pixel] == pytest.approx(share_beyond(kind, width, 8 - (pixel + 0.5)), abs=0.012), pixel


def test_region_is_a_crop_of_the_whole() -> None:
    whole = render("cornell_box", size=40, samples=4, passes=["depth", "normal"])
    part = render("cornell_box", size=40, samples=4, passes=["depth", "normal"], region=(7, 3, 29, 37))
    for name in whole.passes:
        np.testing.assert_array_equal(part.passes[name], whole.passes[name][3:37, 7:29])


def test_batches_hold_the_picture() -> None:
    r = render("cornell_box", size=24, samples=128, passes=["batches", "sample_count"])
    luma = r.image[..., :3] @ np.array([0.2126, 0.7152, 0.0722], np.float32)
    batches = r.passes["batches"]
    np.testing.assert_allclose(batches.mean(-1), luma, rtol=1e-4, atol=1e-5)
    assert (r.passes["sample_count"] == 128).all()


@pytest.mark.parametrize("samples", [1, 2, 5, 16, 17, 40])
def test_any_number_of_samples_counts_right(samples: int) -> None:
    r = render("cornell_box", size=8, samples=samples, passes=["sample_count", "error", "batches"])
    assert (r.passes["sample_count"] == samples).all()
    assert ((r.passes["batches"] != 0).any((0, 1)).sum()) == min(-(-samples // 4), 16)
    assert (r.passes["error"].max() > 0) == (samples > 4)


def test_samples_in_passes_equal_samples_at_once() -> None:
    """The order of passes changes sums by rounding alone."""
    a = render("cornell_box", size=16, samples=40).image
    b = render("cornell_box", size=16, samples=40, time_limit=1e6).image
    np.testing.assert_allclose(a, b, rtol=1e-5, atol=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize(("scene", "samples"), [("cornell_box", 256), ("cornell_textured", 256), ("cornell_statue", 1024)])
def test_intervals_cover_the_truth(scene: str, samples: int) -> None:
    """95 % intervals of Student's t over sixteen batches hold the truth in 93–97 % of all pixels and seeds."""
    size, truth_seeds = 16, 8
    quiet = dict(caustics_reflective=False, caustics_refractive=False)  # caustics have no variance worth the name
    luma = np.array([0.2126, 0.7152, 0.0722])
    truths = np.array([render(scene, size=size, samples=2048, seed=1000 + i, **quiet).image[..., :3].astype(float) @ luma
                       for i in range(truth_seeds)])
    truth, truth_error = truths.mean(0), truths.std(0, ddof=1) / truth_seeds**0.5
    inside = []
    for seed in range(max(8, 4096 // samples)):
        r = render(scene, size=size, samples=samples, seed=seed, passes=["error"], **quiet)
        error = r.passes["error"][..., 0].astype(float)
        off = np.abs(r.image[..., :3].astype(float) @ luma - truth)
        seen = error > 0
        inside.append((off <= T_975_15 * np.hypot(error, truth_error))[seen].mean())
    coverage = float(np.mean(inside))
    assert 0.93 <= coverage <= 0.97, coverage


def test_believed_error_falls_with_the_root_of_the_samples() -> None:
    few = render("cornell_box", size=24, samples=64).statistics
    many = render("cornell_box", size=24, samples=256).statistics
    assert many["believed_error"] / few["believed_error"] == pytest.approx(0.5, rel=0.15)
    assert many["error_low"] < many["believed_error"] < many["error_high"]


def test_black_image_has_no_error() -> None:
    scene = Description("black", Camera(look_at((0, -1, 0), (0, 0, 0))))
    r = render(scene, size=8, samples=32)
    assert r.statistics["believed_error"] == 0 and r.image[..., :3].max() == 0


def test_more_samples_do_not_shift_the_mean() -> None:
    a, b = mean("cornell_box", size=16, samples=16, repeats=16), mean("cornell_box", size=16, samples=256, repeats=4)
    assert abs(a.value - b.value) < 4.5 * np.hypot(a.error, b.error)
