# SPDX-License-Identifier: GPL-3.0-or-later
"""What the tests of hard cases share: small scenes, renders that count what is wrong, means with their own error bars."""

from __future__ import annotations

from typing import Any, NamedTuple

import afterglow
import numpy as np
from afterglow import scenes
from afterglow.scenes import Camera, Description, Light, look_at, translate
from afterglow.scenes.native import Built
from afterglow.scenes.rooms import background, diffuse, emission
from afterglow.scenes.shapes import quad, sphere

SIZE = 24
METHOD = "PATH_TRACING"  # of renders that name none


class Mean(NamedTuple):
    """Mean radiance of an image and the standard error over independent renders."""

    value: float
    error: float


def render(scene: Any, size: int = SIZE, samples: int = 32, **settings: Any) -> afterglow.Result:
    """A small render that must be finite and not negative, whatever the scene."""
    defaults = dict(method=METHOD, width=size, height=size, samples=samples, max_bounces=12, diffuse_bounces=12,
                    glossy_bounces=12, transmission_bounces=12, caustics_reflective=True, caustics_refractive=True)
    result = afterglow.render(scene, **{**defaults, **settings})
    for name, pixels in result.passes.items():
        assert np.isfinite(pixels).all(), f"pass {name} holds values that are not finite"
    assert (result.image >= 0).all(), "negative light"
    return result


def mean(scene: Any, repeats: int = 4, **settings: Any) -> Mean:
    """Mean over the image, channels and `repeats` seeds."""
    values = np.array([float(render(scene, seed=100 + i, **settings).image[..., :3].mean(dtype=np.float64))
                       for i in range(repeats)])
    return Mean(float(values.mean()), float(values.std(ddof=1) / repeats**0.5))


def agree(a: Mean, b: Mean, tolerance: float = 0.0) -> None:
    """Two means agree within 4.5 standard errors and `tolerance` of the larger."""
    bound = 4.5 * np.hypot(a.error, b.error) + tolerance * max(abs(a.value), abs(b.value)) + 1e-12
    assert abs(a.value - b.value) <= bound, f"{a} and {b} differ by more than {bound:.3g}"


def one_quad(material: Any = None, **camera: Any) -> Description:
    """A square of 2 × 2 in z = 0 that fills the view from above."""
    scene = Description("one_quad", Camera(look_at((0, 0, 2), (0, 0, 0), (0, 1, 0)), **camera))
    scene.materials["surface"] = material or diffuse((0.8, 0.8, 0.8))
    scene.add("Quad", quad((-3, -3, 0), (3, -3, 0), (3, 3, 0), (-3, 3, 0)), "surface")
    return scene


def ball_under_sky(material: Any = None, radiance: float = 1.0) -> Description:
    return scenes.SCENES["world_furnace"](material, radiance)


def ball_grid() -> tuple[Description, np.ndarray]:
    """A hundred by a hundred balls under an even sky, and their matrices."""
    scene = Description("instances", Camera(look_at((0, -60, 40), (0, 0, 0)), 1.2))
    scene.materials["m"] = diffuse((0.6, 0.6, 0.6))
    scene.world = background((1, 1, 1))
    y, x = np.mgrid[0:100, 0:100] - 49.5
    places = np.tile(np.eye(4), (10000, 1, 1))
    places[:, 0, 3], places[:, 1, 3] = x.ravel(), y.ravel()
    scene.add("Ball", sphere(0.4, 12, 6), "m", transform=places)
    return scene, places


__all__ = [
    "SIZE", "Built", "Camera", "Description", "Light", "Mean", "agree", "background", "ball_grid", "ball_under_sky", "diffuse",
    "emission", "look_at", "mean", "one_quad", "quad", "render", "scenes", "sphere", "translate",
]
