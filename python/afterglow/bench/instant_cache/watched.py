# SPDX-License-Identifier: GPL-3.0-or-later
"""Sessions on procedural scenes whose stages are read frame by frame: 600 × 400 pixels, one sample a pixel, 256 virtual lights.
The diffuse part is everything but the camera's paths and the film: light paths, update, filling, interpolation, filter."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

from ... import scenes
from ...scenes import Description

WIDTH, HEIGHT = 600, 400
SETTINGS: dict[str, Any] = {"width": WIDTH, "height": HEIGHT, "samples": 1, "virtual_lights": 256, "diffuse_bounces": 4,
                            "pixel_filter": "GAUSSIAN", "filter_width": 0.01}
METHODS = {"IGI": "INSTANT_RADIOSITY", "IC": "INSTANT_CACHE", "TIC": "INSTANT_CACHE"}


@dataclass(frozen=True)
class Case:
    """A scene and the paper's figures of one like it: seconds of the diffuse part by IGI, IC and TIC (tables 2 and 4)."""

    make: Callable[[], Description]
    first: tuple[float, float] | None = None
    moving: tuple[float, float, float] | None = None

    def paper(self, numerator: int, denominator: int) -> float | None:
        return self.moving[numerator] / self.moving[denominator] if self.moving else None


def bunnies(moving: int) -> Callable[[], Description]:
    return partial(scenes.SCENES["bouncing_bunnies"], 9, 76, moving)


@dataclass(frozen=True)
class Frame:
    """Seconds of one frame's stages."""

    update: float
    fill: float
    interpolate: float
    filter: float
    walk: float
    film: float

    @property
    def repair(self) -> float:
        return self.update + self.fill

    @property
    def diffuse(self) -> float:
        return self.repair + self.interpolate + self.filter

    @property
    def specular(self) -> float:
        """Camera paths with direct and specular light, and the film: all but the diffuse part."""
        return self.walk + self.film

    @property
    def whole(self) -> float:
        return self.diffuse + self.specular


class Watched:
    """A session on a scene of its own."""

    def __init__(self, make: Callable[[], Description], method: str, **settings: Any) -> None:
        from ..._native import Session
        from ...scenes.native import Built

        self.built = Built(make())
        self.built.set_camera((WIDTH, HEIGHT), self.built.description.frames[0])
        self.built.scene.commit()
        self.session = Session(self.built.scene, {**SETTINGS, **settings, "method": method})
        self.sums = {"seconds_lights": 0.0, "seconds_update": 0.0}
        self.session.start()
        self.session.wait()

    def move_to(self, frame: float, anew: bool = False) -> None:
        """Renders another frame; anew: the cache is filled from nothing."""
        if anew:
            self.session.forget_cache()
            self.sums = dict.fromkeys(self.sums, 0.0)
        with self.session.edit():
            self.built.move_to(frame, (WIDTH, HEIGHT))
        self.session.wait()

    def again(self, **settings: Any) -> None:
        self.session.update(settings)
        self.session.start()
        self.session.wait()

    def values(self) -> dict[str, Any]:
        found = self.session.statistics()
        return {**found["values"], **{f"{kind}_rays": n for kind, n in found["rays"].items()}, "elapsed": found["elapsed"]}

    def frame(self) -> Frame:
        """The last frame's stages; to be asked once a frame, because light paths and updates are counted on."""
        values = self.values()
        sums = {name: values.get(name, 0.0) for name in self.sums}
        lights, update = (sums[name] - self.sums[name] for name in ("seconds_lights", "seconds_update"))
        self.sums = sums
        return Frame(max(lights, update), values.get("seconds_prepare", 0.0), values.get("seconds_gather", 0.0),
                     values.get("seconds_filter", 0.0), values.get("seconds_walk", 0.0), values.get("seconds_film", 0.0))
