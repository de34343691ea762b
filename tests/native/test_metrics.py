# SPDX-License-Identifier: GPL-3.0-or-later
"""The metrics against values known from elsewhere and against what must hold for every image."""

import os
import sys
from pathlib import Path

import numpy as np
import pytest
from afterglow import images, metrics


def pictures() -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(0)
    y, x = np.mgrid[0:96, 0:128] / 64
    reference = np.stack([0.5 + 0.4 * np.sin(7 * x), 0.5 + 0.4 * np.cos(5 * y + x), x / 2 * y / 2], -1).astype(np.float32)
    return reference, np.clip(reference + 0.1 * rng.standard_normal(reference.shape), 0, 1).astype(np.float32)


def test_flip_equals_its_authors_program() -> None:
    """Values of flip-evaluator 1.x from PyPI (NVIDIA), LDR, linear input, for the same pictures."""
    r, noisy = pictures()
    assert metrics.flip(noisy, r, 1.0) == pytest.approx(0.19226170, abs=2e-4)
    assert metrics.flip(r * 0.8, r, 1.0) == pytest.approx(0.37735784, abs=2e-4)
    assert metrics.flip(np.roll(r, 3, 1), r, 1.0) == pytest.approx(0.24671204, abs=2e-4)
    assert metrics.flip(np.ones_like(r), np.zeros_like(r), 1.0) == pytest.approx(0.9674570, abs=2e-4)
    assert metrics.flip(np.ones_like(r) * [0, 0, 1], np.ones_like(r) * [0, 1, 0], 1.0) == pytest.approx(1.0, abs=1e-6)
    assert metrics.flip(r, r) == 0.0


def test_relmse_equals_the_shared_tool(root: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    tools = Path(os.environ.get("AFTERGLOW_SHARED", root.parent / "shared")) / "tools"
    pytest.importorskip("OpenImageIO")
    if not (tools / "compare.py").is_file():
        pytest.skip(f"{tools}/compare.py is absent")
    r, noisy = pictures()
    noisy = noisy.copy()
    noisy[3, 4] = np.nan
    images.write(tmp_path / "r.exr", r)
    images.write(tmp_path / "x.exr", noisy)
    sys.path.insert(0, str(tools))
    import compare

    compare.main(str(tmp_path / "r.exr"), str(tmp_path / "x.exr"))
    words = capsys.readouterr().out.split()
    assert metrics.relmse(noisy, r) == pytest.approx(float(words[2]), abs=6e-6)
    assert metrics.trimmed_relmse(noisy, r) == pytest.approx(float(words[4]), abs=6e-6)


def test_relmse_by_hand() -> None:
    r, x = np.full((4, 4, 3), 0.5), np.full((4, 4, 3), 0.6)
    assert metrics.relmse(x, r) == pytest.approx(0.01 / 0.26)
    assert metrics.relmse(x * 1e4, r * 1e4) == pytest.approx(0.01 / 0.26)
    x[0, 0] = 100.0
    assert metrics.trimmed_relmse(x, r, 0.07) == pytest.approx(0.01 / 0.26)


def test_halves_are_free_of_the_references_noise() -> None:
    rng = np.random.default_rng(1)
    truth = rng.uniform(0.2, 1.0, (128, 128, 3))
    image = truth * (1 + 0.03 * rng.standard_normal(truth.shape))
    parts = [truth * (1 + 0.1 * rng.standard_normal(truth.shape)) for _ in range(6)]
    exact = metrics.relmse(image, truth)
    for chosen in (parts[:2], parts):
        value, error = metrics.halves_relmse(image, chosen)
        assert 0 < error < 0.1 * exact
        assert abs(value - exact) < 4 * error
    assert metrics.relmse(image, np.mean(parts, 0)) > 2 * exact


def test_the_error_bar_of_halves_is_honest() -> None:
    """The deviation over its error bar has a spread near one over many independent references."""
    rng = np.random.default_rng(2)
    truth = rng.uniform(0.2, 1.0, (32, 32, 3))
    image = truth * 1.05
    exact, pulls = metrics.relmse(image, truth), []
    for _ in range(150):
        value, error = metrics.halves_relmse(image, [truth * (1 + 0.1 * rng.standard_normal(truth.shape)) for _ in range(8)])
        pulls.append((value - exact) / error)
    assert 0.8 < np.std(pulls) < 1.4
    assert abs(np.mean(pulls)) < 0.5


def test_ms_ssim_properties() -> None:
    y, x = np.mgrid[0:200, 0:256] / 40
    r = (0.4 + 0.3 * np.sin(9 * x) * np.cos(7 * y))[..., None] * np.ones(3)
    rng = np.random.default_rng(3)
    noise = rng.standard_normal(r.shape)
    values = [metrics.ms_ssim(np.clip(r + s * noise, 0, 1), r, 1.0) for s in (0.0, 0.02, 0.1, 0.3)]
    assert values[0] == pytest.approx(1.0)
    assert values == sorted(values, reverse=True) and values[-1] < 0.9
    assert metrics.ms_ssim(r[:40, :40], r[:40, :40]) == pytest.approx(1.0)
    with pytest.raises(ValueError):
        metrics.ms_ssim(r[:8], r[:8])


def test_still_flicker() -> None:
    r = np.full((8, 8, 3), 2.0)
    value, error = metrics.still_flicker([r, r + 0.2, r], r)
    assert value == pytest.approx(0.1) and error == pytest.approx(0.0)


def test_moving_flicker_sees_only_what_the_reference_does_not_do() -> None:
    rng = np.random.default_rng(4)
    a, b = rng.uniform(0.5, 1.5, (2, 64, 64, 3))

    def noisy(image: np.ndarray, s: float) -> np.ndarray:
        return image + s * rng.standard_normal(image.shape)

    value, error = metrics.moving_flicker((noisy(a, 0.05), noisy(b, 0.05)), (noisy(a, 0.2), noisy(b, 0.2)),
                                          (noisy(a, 0.2), noisy(b, 0.2)))
    assert abs(value - 0.05 * 2**0.5) < 4 * error and error < 0.02
    still, bound = metrics.moving_flicker((a, b), (noisy(a, 0.2), noisy(b, 0.2)), (noisy(a, 0.2), noisy(b, 0.2)))
    assert still < 4 * bound


def test_images_come_back(tmp_path: Path) -> None:
    pytest.importorskip("OpenImageIO")
    r, _ = pictures()
    images.write(tmp_path / "a.exr", r * 7)
    np.testing.assert_array_equal(images.read(tmp_path / "a.exr"), r * 7)
    images.write(tmp_path / "a.png", r)
    np.testing.assert_allclose(images.read(tmp_path / "a.png"), images.to_display(r), atol=0.51 / 255)
    np.testing.assert_allclose(images.from_display(images.to_display(r)), np.clip(r, 0, 1), atol=1e-5)
    with pytest.raises(OSError):
        images.read(tmp_path / "none.exr")
