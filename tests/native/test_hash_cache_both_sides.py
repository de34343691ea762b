# SPDX-License-Identifier: GPL-3.0-or-later
"""The 15 bytes that a cell of the paper's own structure keeps: light of both sides, counts, normal, frame."""

from __future__ import annotations

from typing import Any

import afterglow
import numpy as np
import pytest
from afterglow import _native
from afterglow.scenes.native import Built
from afterglow.scenes.rooms import cornell_box

UNIT = 2.0**-10  # of a mantissa, relative to the brightest channel, at most
WINDOW = 2048


def kept(sums: Any, samples: int = 1, normal: Any = (0, 0, 1), frames: Any = 0, changed: int = 0) -> dict[str, Any]:
    rows = np.atleast_2d(np.asarray(sums, float))
    n = len(rows)
    return _native.both_sides(np.broadcast_to(np.asarray(normal, float), (n, 3)), rows, np.full(n, samples),
                              np.broadcast_to(frames, n), changed)


@pytest.mark.parametrize("light", [(1.0, 1.0, 1.0), (1e6, 2e6, 3e6), (65504.0, 65505.0, 1e5), (1e-20, 1e-21, 0.0),
                                   (1e30, 1.0, 0.0)])
def test_light_beyond_halves(light: tuple[float, float, float]) -> None:
    found = kept([light])
    assert (np.abs(np.asarray(found["front"]) - light) <= UNIT * max(light)).all()
    assert found["back"] == (0, 0, 0) and found["counts"] == (1, 0) and found["bytes"] <= 15
    assert (np.asarray(kept([(3e38, 0, 0)])["front"]) < np.inf).all() and kept([(1e-34,) * 3])["front"] == (0, 0, 0)


def test_sides_are_told_by_geometry() -> None:
    """Whatever came first: the front is where the normal's largest component is positive."""
    rng = np.random.default_rng(1)
    for normal in rng.normal(size=(200, 3)):
        front = normal * np.sign(normal[np.abs(normal).argmax()])
        for first in (1, -1):
            found = kept([(1, 1, 1), (4, 4, 4)] if first > 0 else [(4, 4, 4), (1, 1, 1)], 1, [first * front, -first * front])
            assert found["front"] == (1, 1, 1) and found["back"] == (4, 4, 4) and found["counts"] == (1, 1)
            cosine = np.asarray(found["normal"]) @ (front / np.linalg.norm(front))
            assert cosine > np.cos(np.radians(9))  # two updates, each to half of that


def test_more_than_two_to_the_24_samples() -> None:
    rng = np.random.default_rng(2)
    runs = [kept(rng.gamma(1024, 1e6, size=(2**15, 1)).repeat(3, 1), 1024) for _ in range(16)]
    counts = [r["counts"][0] / 2**25 for r in runs]
    assert abs(np.mean(counts) - 1) < 4.5 * np.std(counts, ddof=1) / 4 + 1e-9 and 0.4 < min(counts) and max(counts) < 1.8
    for r in runs:
        assert (np.abs(np.asarray(r["front"]) / 1e6 - 1) < 0.1).all()


def test_means_neither_stall_nor_drift() -> None:
    """A window of 2048 samples, units of 2^-10: rounding leaves sqrt(2048 / 12) units of noise, the samples half of
    sqrt(2 / 2048)."""
    rng = np.random.default_rng(3)
    runs = np.array([kept(rng.exponential(size=(20_000, 1)).repeat(3, 1))["front"] for _ in range(24)])
    noise = (UNIT**2 * WINDOW / 12 + 1 / (2 * WINDOW)) ** 0.5
    assert abs(runs.mean() - 1) < 4.5 * noise / 24**0.5 + 1e-3 and runs.std() < 2 * noise
    changes = [np.concatenate([np.full((5000, 3), 1.0 + i * 1e-3), np.full((20_000, 3), 1.2)]) for i in range(24)]
    healed = np.array([kept(change)["front"] for change in changes])
    assert abs(healed.mean() - 1.2) < 4.5 * noise / 24**0.5


def test_a_change_of_the_scene_forgets_what_was_before() -> None:
    both = [(1, 1, 1), (4, 4, 4)]
    for frame in (0, 100, 250, 1000):
        kept_on = kept(both, frames=[frame, frame + 1], changed=frame)
        assert kept_on["counts"] == (2, 0) and kept_on["frame"] == frame % 256
        anew = kept(both, frames=[frame, frame + 3], changed=frame + 2)
        assert anew["counts"] == (1, 0) and anew["front"] == (4, 4, 4) and anew["frame"] == (frame + 3) % 256


def test_cells_of_a_room_keep_light() -> None:
    built = Built(cornell_box())
    built.scene.commit()
    rng = np.random.default_rng(4)
    directions = rng.normal(size=(3000, 3))
    origins = np.broadcast_to(np.array([0.0, 0.0, 1.0]), directions.shape)
    hit = built.scene.intersect(origins, directions)
    met = np.isfinite(hit["distance"])
    points = (origins + directions / np.linalg.norm(directions, axis=1)[:, None] * hit["distance"][:, None])[met]
    normals = -directions[met]
    found = _native.occupied_cells(built.scene, 8, points, normals=normals, light=np.full((len(points), 3), 1e6))
    assert np.allclose(found["light"], 1e6, rtol=UNIT) and found["data_bytes"] == [15 * n for n in found["cells"]]
    size = sum(found["data_bytes"]) + sum(found["map_bytes"])
    assert size <= found["peak_bytes"] <= 1.5 * size + 2**20


def test_wrong_input_says_so() -> None:
    with pytest.raises(afterglow.InvalidInput, match="as many rows"):
        _native.both_sides(np.ones((2, 3)), np.ones((1, 3)), np.ones(1, int), np.ones(1, int))
    with pytest.raises(afterglow.InvalidInput, match="samples"):
        kept([(1, 1, 1)], 0)
    built = Built(cornell_box())
    built.scene.commit()
    with pytest.raises(afterglow.InvalidInput, match="row for each point"):
        _native.occupied_cells(built.scene, 2, np.zeros((2, 3)), normals=np.ones((1, 3)), light=np.ones((1, 3)))
