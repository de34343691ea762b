# SPDX-License-Identifier: GPL-3.0-or-later
"""`render`: a scene in, an image out, for scripts, tests and notebooks."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _native
from .scenes import Description, make
from .scenes.native import Built


@dataclass
class Result:
    """What a render gave: `image` is the combined pass (height, width, 4), `passes` all that were asked for."""

    image: NDArray[np.float32]
    passes: dict[str, NDArray[np.float32]] = field(default_factory=dict)
    statistics: dict[str, Any] = field(default_factory=dict)
    seconds: float = 0.0


def render(scene: _native.Scene | Description | Built | str, *, passes: Sequence[str] = ("combined",), frame: float | None = None,
           **settings: Any) -> Result:
    """Renders and waits. scene: a native scene, a description, one that is built already, or a procedural scene's name.

    settings are those of `Session` (width, height, samples, seed, threads, …); a description brings its own size.
    Raises what the session raises: `InvalidInput` for a wrong setting, `Cancelled`, `OutOfMemory`.
    """
    if isinstance(scene, str):
        scene = make(scene)
    if isinstance(scene, Description):
        scene = Built(scene, frame)
    if isinstance(scene, Built):
        width, height = scene.description.resolution
        settings.setdefault("width", width)
        settings.setdefault("height", height)
        scene.set_camera((settings["width"], settings["height"]), scene.description.frames[0] if frame is None else frame)
        scene.scene.commit()
        settings = {**scene.description.settings, **settings}
        scene = scene.scene
    settings.setdefault("method", "PATH_TRACING")
    settings.setdefault("accuracy", 0.0)
    settings["passes"] = list(dict.fromkeys(["combined", *passes]))
    start = time.perf_counter()
    session = _native.Session(scene, settings)
    session.start()
    try:
        session.wait()
    except KeyboardInterrupt:
        session.cancel()
        raise
    seconds = time.perf_counter() - start
    images = {name: session.read(name) for name in settings["passes"]}
    return Result(images["combined"], images, session.statistics(), seconds)
