# SPDX-License-Identifier: GPL-3.0-or-later
"""Denoising by OpenImageDenoise, found at run time: the copy that an official Blender brings, and those in the folders that
AFTERGLOW_OIDN names (separated by colons), version 1 or 2. Without any, everything says so and goes on."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import afterglow
import numpy as np
import pytest
from afterglow import _native, metrics, scenes
from afterglow.scenes.native import Built
from hard_cases import ball_under_sky, render
from test_sight import bars

SIZE = 72
GUIDES = ("combined", "albedo", "denoise_normal")


@pytest.fixture(scope="module")
def copies(bpy_venv: Callable[[str], Path]) -> list[str]:
    """Folders that hold a copy."""
    found = [place for place in os.environ.get("AFTERGLOW_OIDN", "").split(":") if place]
    pattern = "lib/python*/site-packages/bpy/lib/libOpenImageDenoise.so*"
    found += [str(path.parent) for path in bpy_venv("5.0").parent.parent.glob(pattern)]
    if not found:
        pytest.skip("no copy of OpenImageDenoise: official Blender 5.0 is absent")
    return list(dict.fromkeys(found))


@pytest.fixture(scope="module")
def noisy() -> dict[str, np.ndarray]:
    return afterglow.render("cornell_textured", width=SIZE, height=SIZE, samples=8, seed=1, passes=GUIDES).passes


@pytest.fixture(scope="module")
def truth() -> np.ndarray:
    return afterglow.render("cornell_textured", width=SIZE, height=SIZE, samples=512, seed=2).image


def test_a_copy_is_listed(copies: list[str]) -> None:
    for place in copies:
        found, layered = afterglow.denoisers([place])
        assert layered["id"] == "LAYERED" and layered["available"]
        assert found["available"] and found["reason"] == "", found
        assert found["id"] == "OPENIMAGEDENOISE" and found["path"] and int(found["version"].split(".")[0]) in (1, 2)


def test_the_error_falls(copies: list[str], noisy: dict[str, np.ndarray], truth: np.ndarray) -> None:
    """To less than a third, and guides help: they know the texture that the colour alone hides in noise."""
    before = metrics.relmse(noisy["combined"], truth)
    for place in copies:
        bare = afterglow.denoise(noisy["combined"], search=[place])
        albedo = afterglow.denoise(noisy["combined"], noisy["albedo"], search=[place])
        guided = afterglow.denoise(*(noisy[name] for name in GUIDES), search=[place])
        clean = afterglow.denoise(*(noisy[name] for name in GUIDES), search=[place], prefilter=True)
        errors = [metrics.relmse(image, truth) for image in (bare, albedo, guided, clean)]
        assert errors[2] < before / 3 and errors[3] < before / 3, (before, errors)
        assert errors[2] < errors[0] and errors[1] < errors[0] and errors[3] < errors[0], errors
        for image in (bare, albedo, guided, clean):
            assert image.shape == (SIZE, SIZE, 3) and image.dtype == np.float32 and np.isfinite(image).all()


def test_inputs_stay_and_alpha_is_left_out(copies: list[str], noisy: dict[str, np.ndarray]) -> None:
    kept = {name: image.copy() for name, image in noisy.items()}
    rgba = afterglow.denoise(*(noisy[name] for name in GUIDES), search=copies)
    rgb = afterglow.denoise(np.ascontiguousarray(noisy["combined"][..., :3]), noisy["albedo"], noisy["denoise_normal"],
                            search=copies)
    np.testing.assert_array_equal(rgba, rgb)
    for name in GUIDES:
        np.testing.assert_array_equal(noisy[name], kept[name])


def test_calls_do_not_disturb_each_other(copies: list[str], noisy: dict[str, np.ndarray]) -> None:
    """One denoiser serves many calls, with and without guides, of several sizes: each answers as the first did."""
    first = afterglow.denoise(*(noisy[name] for name in GUIDES), search=copies)
    bare = afterglow.denoise(noisy["combined"], search=copies)
    small = afterglow.denoise(noisy["combined"][:20, :31], search=copies)
    assert small.shape == (20, 31, 3)
    np.testing.assert_array_equal(afterglow.denoise(*(noisy[name] for name in GUIDES), search=copies), first)
    np.testing.assert_array_equal(afterglow.denoise(noisy["combined"], search=copies), bare)


@pytest.mark.parametrize("value", [1e-4, 1.0, 3e4])
def test_high_dynamic_range(copies: list[str], value: float) -> None:
    image = afterglow.denoise(np.full((48, 48, 3), value, np.float32), search=copies)
    assert image.mean() == pytest.approx(value, rel=0.03)
    np.testing.assert_allclose(image, value, rtol=0.15)  # worst at the corners


def test_values_that_are_not_finite(copies: list[str], noisy: dict[str, np.ndarray]) -> None:
    whole = afterglow.denoise(*(noisy[name] for name in GUIDES), search=copies)
    broken = {name: noisy[name].copy() for name in GUIDES}
    for name, value in zip(GUIDES, (np.nan, np.inf, -np.inf)):
        broken[name][5, 7], broken[name][30:33, 40] = value, value
    broken["combined"][60, 60, 1] = np.inf
    for prefilter in (False, True):
        mended = afterglow.denoise(*(broken[name] for name in GUIDES), search=copies, prefilter=prefilter)
        assert np.isfinite(mended).all()
    far = np.abs(mended - whole).max(-1) > 0.3 * whole.mean()
    assert far.mean() < 0.02, "what is broken stays where it is"
    nothing = afterglow.denoise(np.full((9, 9, 3), np.nan, np.float32), search=copies)
    assert np.isfinite(nothing).all()


@pytest.mark.parametrize("shape", [(1, 1), (1, 37), (53, 1), (17, 33), (131, 7)])
def test_odd_sizes(copies: list[str], shape: tuple[int, int]) -> None:
    image = np.random.default_rng(3).random((*shape, 3), np.float32)
    for prefilter in (False, True):
        out = afterglow.denoise(image, image, image, search=copies, prefilter=prefilter)
        assert out.shape == image.shape and np.isfinite(out).all()


def test_wrong_input_is_refused(copies: list[str]) -> None:
    image = np.ones((8, 9, 3), np.float32)
    for arguments in ((image[..., 0],), (image[:, :0],), (image, image[:4]), (image, image, image[:, :4]), (image[..., :2],)):
        with pytest.raises(afterglow.InvalidInput, match="denoise"):
            afterglow.denoise(*arguments, search=copies)
    with pytest.raises(afterglow.InvalidInput, match="nobody"):
        afterglow.denoise(image, denoiser="nobody", search=copies)


def test_no_edge_is_drawn_anew_that_rays_have_seen(copies: list[str]) -> None:
    """Bars before a bright window at one sample: rays that only look know them, and the library would blur them."""
    settings: dict[str, object] = dict(method="HASH_CACHE", size=48, samples=1, seed=3, denoiser_search=copies)
    truth = render(bars(), method="HASH_CACHE", size=48, samples=256).image[..., :3]
    noisy, clean = (render(bars(), denoise=on, **settings).image[..., :3] for on in (False, True))
    edge = np.abs(np.gradient(truth[..., 0], axis=1)) > 1.0
    before, after = (np.sqrt(np.mean((picture - truth)[edge] ** 2)) for picture in (noisy, clean))
    assert after < 1.1 * before


def session(built: Built, copies: list[str], width: int, height: int, **settings: object) -> afterglow.Session:
    built.set_camera((width, height), 0)
    built.scene.commit()
    return afterglow.Session(built.scene, {"width": width, "height": height, "denoise": True, "denoiser_search": copies,
                                           **settings})


def test_guides_are_filtered_until_kept_samples_make_them_clean() -> None:
    """(prefilter, small network)"""
    for samples in (1, 3, 4, 64):
        for exact in (False, True):
            assert _native.denoise_plan(True, samples, 0, exact) == (False, True)
            assert _native.denoise_plan(False, samples, 0, exact) == (samples >= 4, samples == 1 and not exact)
    assert _native.denoise_plan(False, 4, 11, False) == (True, False)
    assert _native.denoise_plan(False, 4, 12, False) == (False, True)


def test_a_render_is_denoised(copies: list[str], truth: np.ndarray) -> None:
    """The picture alone, its alpha as it was; guides are kept without being asked for. Few samples or many."""
    for samples in (2, 8):
        plain = afterglow.render("cornell_textured", width=SIZE, height=SIZE, samples=samples, seed=1)
        clean = afterglow.render("cornell_textured", width=SIZE, height=SIZE, samples=samples, seed=1, denoise=True,
                                 denoiser_search=copies)
        assert clean.statistics["denoiser"] and not clean.statistics["warnings"], clean.statistics
        assert clean.statistics["seconds"]["denoise"] > 0
        assert metrics.relmse(clean.image, truth) < metrics.relmse(plain.image, truth) / 2
        np.testing.assert_array_equal(clean.image[..., 3], plain.image[..., 3])


def test_a_viewport_is_denoised(copies: list[str], truth: np.ndarray) -> None:
    built = Built(scenes.make("cornell_textured"))
    view = session(built, copies, SIZE, SIZE, samples=4, viewport=True)
    view.start()
    view.wait()
    plain = afterglow.render(built, samples=4, width=SIZE, height=SIZE)
    assert metrics.relmse(view.read("combined"), truth) < metrics.relmse(plain.image, truth) / 2


def test_cancel_while_denoising(copies: list[str]) -> None:
    """Within 50 ms, though the library asks only between its layers; the next render is denoised all the same."""
    built = Built(ball_under_sky())
    taken = []
    for delay in (0.0, 0.02, 0.05):
        running = session(built, copies, 1600, 900, samples=1, max_bounces=0)
        running.start()
        while running.progress()["stage"] != "denoising" and running.progress()["state"] == "running":
            time.sleep(0.001)
        time.sleep(delay)
        assert running.progress()["stage"] == "denoising", "too fast to be cancelled"
        start = time.perf_counter()
        running.cancel()
        taken.append(time.perf_counter() - start)
        assert running.progress()["state"] == "cancelled"
    # A loaded machine keeps threads waiting; by itself a cancel takes some ten milliseconds.
    if os.getloadavg()[0] <= (os.cpu_count() or 1):
        assert np.median(taken) < 0.05, taken
    after = session(built, copies, 32, 32, samples=1)
    after.start()
    after.wait()
    assert after.statistics()["denoiser"] and not after.statistics()["warnings"]


WITHOUT = """
import sys
import numpy as np, afterglow
known, layered = afterglow.denoisers(sys.argv[1:])
assert layered["id"] == "LAYERED" and layered["available"], layered
assert not known["available"] and known["reason"], known
try:
    afterglow.denoise(np.ones((4, 4, 3), np.float32), denoiser="OPENIMAGEDENOISE", search=sys.argv[1:])
except afterglow.Unsupported as error:
    assert str(error) == known["reason"], error
else:
    raise AssertionError("denoised by nothing")
picture = dict(width=8, height=8, samples=2, denoise=True, denoiser_search=sys.argv[1:])
assert afterglow.render("cornell_box", **picture).statistics["denoiser"] == "LAYERED", "in its place"
render = afterglow.render("cornell_box", denoiser="OPENIMAGEDENOISE", **picture)
assert any("not denoised" in text for text in render.statistics["warnings"]), render.statistics
assert np.isfinite(render.image).all() and render.image.max() > 0
print(known["reason"])
"""


def test_without_a_copy_it_says_so_and_renders(library: Path, tmp_path: Path) -> None:
    """In a fresh process, where no test has loaded one."""
    broken = tmp_path / "libOpenImageDenoise.so.2"
    broken.write_text("no library\n")
    for search in ([], [str(tmp_path)], [str(tmp_path / "absent")]):
        ended = subprocess.run([sys.executable, "-c", WITHOUT, *search], capture_output=True, text=True,
                               env=os.environ | {"PYTHONPATH": str(library)})
        if "AssertionError" in ended.stderr and "'available': True" in ended.stderr:
            pytest.skip("this system has a copy that every process finds")
        assert ended.returncode == 0, ended.stderr
        assert (str(broken) if search == [str(tmp_path)] else "OpenImageDenoise") in ended.stdout
