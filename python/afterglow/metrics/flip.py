# SPDX-License-Identifier: GPL-3.0-or-later
"""LDR-FLIP after Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström and Fairchild, "FLIP: a difference evaluator for
alternating images" (2020): what an observer notices who flips between two displayed images.

A colour part (contrast sensitivity as Gaussians in an opponent space, HyAB distance in Hunt-adjusted L*a*b*) raised to
one minus a feature part (edges and points in luma).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..images import from_display, to_display
from .error import Array, exposure, rgb

# Sensitivity of the achromatic, red-green and blue-yellow channels: (a₁, b₁, a₂, b₂) of two Gaussians each, section 4.1.1.
SENSITIVITY = ((1.0, 0.0047, 0.0, 1e-5), (1.0, 0.0053, 0.0, 1e-5), (34.1, 0.04, 13.5, 0.025))
EXPONENT_COLOR, CUT, CUT_AT, EXPONENT_FEATURE, FEATURE_WIDTH = 0.7, 0.4, 0.95, 0.5, 0.082
TO_XYZ = np.array([[10135552 / 24577794, 8788810 / 24577794, 4435075 / 24577794],
                   [2613072 / 12288897, 8788810 / 12288897, 887015 / 12288897],
                   [1425312 / 73733382, 8788810 / 73733382, 70074185 / 73733382]])
FROM_XYZ = np.linalg.inv(TO_XYZ)
WHITE = TO_XYZ.sum(1)
PIXELS_PER_DEGREE = 0.7 * 3840 / 0.7 * math.pi / 180  # a 0.7 m wide 4K screen at 0.7 m


def _opponent(linear: Array) -> Array:
    x, y, z = np.moveaxis(linear @ TO_XYZ.T / WHITE, -1, 0)
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], -1)


def _from_opponent(image: Array) -> Array:
    y = (image[..., 0] + 16) / 116
    xyz = np.stack([y + image[..., 1] / 500, y, y - image[..., 2] / 200], -1) * WHITE
    return xyz @ FROM_XYZ.T


def _hunt_lab(linear: Array) -> Array:
    ratio, delta = linear @ TO_XYZ.T / WHITE, 6 / 29
    f = np.where(ratio > delta**3, np.cbrt(ratio), ratio / (3 * delta**2) + 4 / 29)
    lightness = 116 * f[..., 1] - 16
    ab = np.stack([500 * (f[..., 0] - f[..., 1]), 200 * (f[..., 1] - f[..., 2])], -1)
    return np.concatenate([lightness[..., None], 0.01 * lightness[..., None] * ab], -1)


def _hyab(a: Array, b: Array) -> Array:
    difference = a - b
    return np.abs(difference[..., 0]) + np.hypot(difference[..., 1], difference[..., 2])


def _filter(image: Array, column: Array, row: Array) -> Array:
    """Separable convolution with the border's pixels repeated."""
    radius = len(column) // 2
    padded = np.pad(image, radius, mode="edge")
    rows = np.lib.stride_tricks.sliding_window_view(padded, len(column), 0) @ column[::-1]
    return np.lib.stride_tricks.sliding_window_view(rows, len(row), 1) @ row[::-1]


def _seen(image: Array, pixels_per_degree: float) -> Array:
    """What contrast sensitivity leaves of an image in the opponent space, back in linear RGB, cut to [0, 1]."""
    widest = max(b for _, b1, _, b2 in SENSITIVITY for b in (b1, b2))
    radius = math.ceil(3 * math.sqrt(widest / (2 * math.pi**2)) * pixels_per_degree)
    degrees = np.arange(-radius, radius + 1) / pixels_per_degree
    channels = []
    for channel, (a1, b1, a2, b2) in enumerate(SENSITIVITY):
        total, weight = np.zeros(image.shape[:2]), 0.0
        for a, b in ((a1, b1), (a2, b2)):
            if a == 0:
                continue
            line = np.exp(-(math.pi**2) * degrees**2 / b)
            share = a * math.sqrt(math.pi / b) * line.sum() ** 2
            total += share * _filter(image[..., channel], line / line.sum(), line / line.sum())
            weight += share
        channels.append(total / weight)
    return np.clip(_from_opponent(np.stack(channels, -1)), 0, 1)


def _features(luma: Array, pixels_per_degree: float) -> tuple[Array, Array]:
    """Strength of edges and of points, from Gaussian derivatives as wide as an edge is seen."""
    sigma = 0.5 * FEATURE_WIDTH * pixels_per_degree
    offsets = np.arange(-math.ceil(3 * sigma), math.ceil(3 * sigma) + 1)
    gauss = np.exp(-(offsets**2) / (2 * sigma**2))
    strength = []
    for line in (-offsets * gauss, (offsets**2 / sigma**2 - 1) * gauss):
        # The two-dimensional kernel's positive and negative weights each sum to one.
        positive, negative = np.maximum(line, 0), np.maximum(-line, 0)
        line = positive / (positive.sum() * gauss.sum()) - negative / (negative.sum() * gauss.sum())
        strength.append(np.hypot(_filter(luma, gauss, line), _filter(luma, line, gauss)))
    return strength[0], strength[1]


def flip_map(image: Any, reference: Any, scale: float | None = None, pixels_per_degree: float = PIXELS_PER_DEGREE) -> Array:
    """FLIP of every pixel, (height, width), 0: no difference, 1: the greatest.

    scale: exposure of the linear images before display (None: `exposure(reference)`).
    """
    scale = exposure(reference) if scale is None else scale
    shown = [from_display(to_display(rgb(v) * scale)).astype(np.float64) for v in (reference, image)]
    if shown[0].shape != shown[1].shape:
        raise ValueError(f"image {shown[1].shape} and reference {shown[0].shape} differ in size")
    opponent = [_opponent(v) for v in shown]
    reference_lab, image_lab = (_hunt_lab(_seen(v, pixels_per_degree)) for v in opponent)
    largest = float(_hyab(_hunt_lab(np.array([0.0, 1.0, 0.0])), _hunt_lab(np.array([0.0, 0.0, 1.0])))) ** EXPONENT_COLOR
    color, knee = _hyab(reference_lab, image_lab) ** EXPONENT_COLOR, CUT * largest
    color = np.where(color < knee, CUT_AT / knee * color, CUT_AT + (color - knee) / (largest - knee) * (1 - CUT_AT))
    edges, points = zip(*(_features((v[..., 0] + 16) / 116, pixels_per_degree) for v in opponent))
    feature = np.maximum(np.abs(edges[1] - edges[0]), np.abs(points[1] - points[0]))
    feature = np.clip((feature / math.sqrt(2)) ** EXPONENT_FEATURE, 0, 1)
    return color ** (1 - feature)


def flip(image: Any, reference: Any, scale: float | None = None, pixels_per_degree: float = PIXELS_PER_DEGREE) -> float:
    """The mean of `flip_map`."""
    return float(flip_map(image, reference, scale, pixels_per_degree).mean())
