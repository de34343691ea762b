# SPDX-License-Identifier: GPL-3.0-or-later
"""The layered filter over finished pictures: less error by every method, edges and textures kept, no library needed."""

from __future__ import annotations

import time
from typing import Any

import afterglow
import numpy as np
import pytest
from afterglow import metrics, scenes
from afterglow.scenes.native import Built

SIZE = 72
FILTERED: dict[str, Any] = {"denoise": True, "denoiser": "LAYERED"}
GUIDES = ["denoise_normal", "denoise_surface", "emission", "environment"]


def shot(scene: str, samples: int, seed: int = 1, **settings: Any) -> Any:
    return afterglow.render(scene, width=SIZE, height=SIZE, samples=samples, seed=seed, **settings)


@pytest.fixture(scope="module")
def truths() -> dict[str, np.ndarray]:
    return {name: shot(name, 512, 2).image for name in ("cornell_box", "cornell_textured")}


@pytest.mark.parametrize("scene", ["cornell_box", "cornell_textured"])
@pytest.mark.parametrize(("samples", "share"), [(4, 0.5), (16, 0.75)])
def test_path_tracing_has_less_error(truths: dict[str, np.ndarray], scene: str, samples: int, share: float) -> None:
    plain, clean = shot(scene, samples), shot(scene, samples, **FILTERED)
    assert clean.statistics["denoiser"] == "LAYERED" and not clean.statistics["warnings"]
    before, after = (metrics.relmse(image.image, truths[scene]) for image in (plain, clean))
    assert after < share * before
    assert metrics.ms_ssim(clean.image, truths[scene]) > metrics.ms_ssim(plain.image, truths[scene])
    assert clean.image[..., :3].mean() == pytest.approx(plain.image[..., :3].mean(), rel=0.03), "no light is made or lost"
    np.testing.assert_array_equal(clean.image[..., 3], plain.image[..., 3])


@pytest.mark.parametrize("method", ["INSTANT_CACHE", "HASH_CACHE"])
def test_every_method_may_have_it(truths: dict[str, np.ndarray], method: str) -> None:
    errors = []
    for on in ({}, FILTERED):
        shots = [shot("cornell_box", 1, seed, method=method, **on) for seed in range(1, 7)]
        assert not on or shots[0].statistics["denoiser"] == "LAYERED"
        errors.append(float(np.mean([metrics.relmse(s.image, truths["cornell_box"]) for s in shots])))
    assert errors[1] < 1.05 * errors[0]


def test_it_fades_as_samples_come() -> None:
    changed = []
    for samples in (4, 64, 1024):
        plain, clean = (shot("cornell_box", samples, **on).image[..., :3] for on in ({}, FILTERED))
        changed.append(float(np.abs(clean - plain).mean() / plain.mean()))
    assert changed[0] > 2 * changed[1] > 8 * changed[2], changed


def guides(colors: np.ndarray, normals: np.ndarray | None = None) -> dict[str, np.ndarray]:
    """A wall of these albedos, a unit a pixel, seen from ten units away."""
    h, w, _ = colors.shape
    surface = np.zeros((h, w, 12), np.float32)
    surface[..., 1], surface[..., 0] = np.mgrid[0:h, 0:w]
    surface[..., 3], surface[..., 4], surface[..., 5], surface[..., 6:9] = 1, 10, 1, colors
    facing = np.zeros((h, w, 3), np.float32)
    facing[..., 2] = 1
    return {"normal": facing if normals is None else normals, "surface": surface}


def test_textures_and_edges_stay() -> None:
    """Noise goes; a checkerboard of albedos, and light that ends where the surface turns, do not blur at all."""
    rng = np.random.default_rng(1)
    y, x = np.mgrid[0:48, 0:48]
    colors = np.where(((x // 3 + y // 3) % 2)[..., None] == 0, 0.8, 0.1).astype(np.float32) * np.ones(3, np.float32)
    normals = np.zeros((48, 48, 3), np.float32)
    normals[:, :24, 2], normals[:, 24:, 0] = 1, 1
    light = np.where(x < 24, 1.0, 0.2)[..., None]
    noisy = (colors * light * rng.gamma(4, 0.25, (48, 48, 1))).astype(np.float32)
    clean = afterglow.denoise(noisy, denoiser="LAYERED", error=np.full((48, 48), 0.5), **guides(colors, normals))
    before, after = (np.abs(image / (colors * light) - 1).mean() for image in (noisy, clean))
    assert after < before / 3
    even = (colors * light).astype(np.float32)
    same = afterglow.denoise(even, denoiser="LAYERED", error=np.full((48, 48), 0.5), **guides(colors, normals))
    np.testing.assert_allclose(same, even, rtol=1e-4)


def test_light_that_no_surface_scatters_stays() -> None:
    colors = np.full((16, 16, 3), 0.5, np.float32)
    seen = np.zeros((16, 16, 3), np.float32)
    seen[5, 5] = 40.0
    image = 0.3 * np.ones((16, 16, 3), np.float32) + seen
    clean = afterglow.denoise(image, denoiser="LAYERED", error=np.ones((16, 16)), seen=seen, **guides(colors))
    np.testing.assert_allclose(clean, image, rtol=1e-4)


def test_values_that_are_not_finite_and_no_surface() -> None:
    colors = np.full((16, 16, 3), 0.5, np.float32)
    image = np.full((16, 16, 3), 0.3, np.float32)
    image[3, 4], image[9, 9, 1] = np.nan, np.inf
    error = np.ones((16, 16), np.float32)
    error[2, 2] = np.nan
    own = guides(colors)
    own["surface"][12, 12] = 0.0
    image[12, 12] = 7.0
    clean = afterglow.denoise(image, denoiser="LAYERED", error=error, **own)
    assert np.isfinite(clean).all() and (clean[12, 12] == 7.0).all()
    assert clean[3, 4] == pytest.approx(0.3, rel=1e-3), "a hole takes what surrounds it"


def test_any_number_of_threads() -> None:
    one, two = (shot("cornell_textured", 4, threads=n, **FILTERED).image for n in (1, 2))
    np.testing.assert_array_equal(one, two)


def test_without_guides_the_error_says_what_is_missing() -> None:
    image = np.ones((8, 9, 3), np.float32)
    with pytest.raises(afterglow.InvalidInput, match="denoise_surface"):
        afterglow.denoise(image, denoiser="LAYERED")
    with pytest.raises(afterglow.InvalidInput, match="surface"):
        afterglow.denoise(image, image, image, denoiser="LAYERED", surface=np.ones((8, 9, 3)), error=np.ones((8, 9)))


def test_who_does_not_use_it_keeps_nothing_for_it() -> None:
    plain, clean = (shot("cornell_box", 1, **on).statistics["bytes"]["film"] for on in ({}, FILTERED))
    assert clean > plain
    with pytest.raises(afterglow.InvalidInput):
        built = Built(scenes.make("cornell_box"))
        built.set_camera((8, 8), 0)
        built.scene.commit()
        session = afterglow.Session(built.scene, {"width": 8, "height": 8, "samples": 1})
        session.start()
        session.wait()
        session.read("denoise_surface")


@pytest.mark.timing
def test_a_stop_is_obeyed() -> None:
    """At once, though much is left to do. Of several tries the best counts: a loaded machine keeps threads waiting."""
    built = Built(scenes.make("cornell_box"))
    built.set_camera((1600, 1200), 0)
    built.scene.commit()
    taken = []
    for _ in range(3):
        running = afterglow.Session(built.scene, {"width": 1600, "height": 1200, "samples": 1, "max_bounces": 0, **FILTERED})
        running.start()
        while running.progress()["stage"] != "denoising" and running.progress()["state"] == "running":
            time.sleep(0.001)
        start = time.perf_counter()
        running.cancel()
        seconds = time.perf_counter() - start
        if running.progress()["state"] == "cancelled":  # else it was through before
            taken.append(seconds)
    assert taken and min(taken) < 0.05, taken
