# SPDX-License-Identifier: GPL-3.0-or-later
"""What the tests of lobes share: one-node graphs, integrals over the sphere, and Pearson's χ² test of sampled directions."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import afterglow._native as native
import numpy as np
from numpy.typing import NDArray

DIRECTIONS = {"normal": (0.0, 0.0, 1.0), "slanted": (0.5, 0.3, 0.81240384), "grazing": (-0.96, 0.1, 0.26153394)}


def graph(kind: str, params: dict[str, Any] | None = None, **inputs: Any) -> dict[str, Any]:
    return {"nodes": [{"type": kind, "name": kind, "params": params or {}, "inputs": inputs}], "surface": ("link", 0, "shader")}


def sphere(z: NDArray[Any], phi: NDArray[Any]) -> NDArray[np.float32]:
    r = np.sqrt(np.maximum(0.0, 1.0 - z * z))
    return np.stack([r * np.cos(phi), r * np.sin(phi), z], -1).astype(np.float32)


def sphere_integral(function: Callable[[NDArray[np.float32]], NDArray[Any]], side: int = 512) -> NDArray[Any]:
    z = (np.arange(side) + 0.5) / side * 2 - 1
    phi = (np.arange(2 * side) + 0.5) / (2 * side) * 2 * np.pi
    grid = sphere(*np.meshgrid(z, phi, indexing="ij")).reshape(-1, 3)
    return function(grid).astype(np.float64).mean(0) * 4 * np.pi


def albedo_by_sampling(material: dict[str, Any], wo: tuple[float, float, float], count: int
                       ) -> tuple[NDArray[Any], NDArray[Any]]:
    u = np.random.default_rng(11).random((count, 3), dtype=np.float32)
    s = native.bsdf_sample(material, np.array([wo], np.float32), u)
    weight = np.where(s["valid"][:, None], s["value"] / np.maximum(s["density"], 1e-30)[:, None], 0.0).astype(np.float64)
    return weight.mean(0), weight.std(0) / math.sqrt(count)


def chi_square(material: dict[str, Any], wo: tuple[float, float, float], count: int = 60_000, **options: Any) -> float:
    """The chance that samples of bsdf_sample come from the density of bsdf_evaluate (both sides of the surface)."""
    rows, columns, fine = 24, 32, 16
    o = np.array([wo], np.float32)
    u = np.random.default_rng(7).random((count, 3), dtype=np.float32)
    s = native.bsdf_sample(material, o, u, **options)
    d = s["direction"][s["valid"]].astype(np.float64)
    theta = np.arctan2(np.hypot(d[:, 0], d[:, 1]), d[:, 2])
    row = np.clip((theta / np.pi * rows).astype(int), 0, rows - 1)
    column = (((np.arctan2(d[:, 1], d[:, 0]) / (2 * np.pi)) % 1.0) * columns).astype(int) % columns
    seen = np.zeros((rows, columns))
    np.add.at(seen, (row, column), 1)
    polar = (np.arange(rows * fine) + 0.5) / (rows * fine) * np.pi
    phi = (np.arange(columns * fine) + 0.5) / (columns * fine) * 2 * np.pi
    grid = sphere(*np.meshgrid(np.cos(polar), phi, indexing="ij")).reshape(-1, 3)
    density = native.bsdf_evaluate(material, o, grid, **options)[1].astype(np.float64).reshape(polar.size, phi.size)
    density *= np.sin(polar)[:, None] * (np.pi / polar.size) * (2 * np.pi / phi.size) * count
    expected = density.reshape(rows, fine, columns, fine).sum((1, 3))
    lost = count - len(d)
    expected_lost = count - expected.sum()
    cells = sorted(zip(expected.ravel(), seen.ravel(), strict=True))
    groups: list[tuple[float, float]] = []
    small = [0.0, 0.0]
    for e, n in cells:  # bins with few expected counts are taken together
        small[0] += e
        small[1] += n
        if small[0] >= 20:
            groups.append((small[0], small[1]))
            small = [0.0, 0.0]
    if small[0] > 0 and groups:
        groups[-1] = (groups[-1][0] + small[0], groups[-1][1] + small[1])
    if expected_lost > 200:
        groups.append((expected_lost, lost))
    # the quadrature of a bin is not exact: its own error is allowed for as a share of the bin
    statistic = sum((n - e) ** 2 / (e + (0.01 * e) ** 2) for e, n in groups)
    freedom = max(len(groups) - 1, 1)
    # Wilson and Hilferty's normal approximation of the χ² distribution
    normal = ((statistic / freedom) ** (1 / 3) - (1 - 2 / (9 * freedom))) / math.sqrt(2 / (9 * freedom))
    return 0.5 * math.erfc(normal / math.sqrt(2))
