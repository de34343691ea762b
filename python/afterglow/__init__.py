# SPDX-License-Identifier: GPL-3.0-or-later
"""Afterglow: a render engine that remembers light.

    import afterglow
    result = afterglow.render("cornell_box", samples=64)     # or an afterglow.Scene, or a scenes.Description
    afterglow.images.write("box.exr", result.image)

Light is scene-linear Rec. 709, lengths scene units, angles radians, times seconds; row 0 of every image is its bottom.
With AFTERGLOW_WITHOUT_MODULE=1 in the environment the package can be imported without its native module, for its
scenes and metrics alone.
"""

from __future__ import annotations

from importlib.util import find_spec as _find_spec

from ._loader import load as _load

_native, _problem = _load()

if _native is not None:
    from ._native import (
        ALL_RAYS,
        CAMERA,
        DIFFUSE,
        GLOSSY,
        SHADOW,
        TRANSMISSION,
        VOLUME,
        Cancelled,
        Error,
        FileError,
        InvalidHandle,
        InvalidInput,
        OutOfMemory,
        Scene,
        Session,
        Unsupported,
        __version__,
        bsdf_evaluate,
        bsdf_sample,
        chosen_method,
        denoise,
        denoisers,
        evaluate_graph,
        light_density,
        light_sample,
        method_descriptions,
        set_log,
        sobol,
        versions,
    )
    from .api import Result, render
    from .records import clear_statistics, record_statistics, statistics

    __all__ = [
        "ALL_RAYS",
        "CAMERA",
        "DIFFUSE",
        "GLOSSY",
        "SHADOW",
        "TRANSMISSION",
        "VOLUME",
        "Cancelled",
        "Error",
        "FileError",
        "InvalidHandle",
        "InvalidInput",
        "OutOfMemory",
        "Result",
        "Scene",
        "Session",
        "Unsupported",
        "__version__",
        "bsdf_evaluate",
        "bsdf_sample",
        "chosen_method",
        "clear_statistics",
        "denoise",
        "denoisers",
        "evaluate_graph",
        "images",
        "light_density",
        "light_sample",
        "method_descriptions",
        "metrics",
        "record_statistics",
        "render",
        "scenes",
        "set_log",
        "sobol",
        "statistics",
        "versions",
    ]
else:

    def __getattr__(name: str) -> object:
        if name.startswith("__") or _find_spec(f"{__name__}.{name}") is not None:
            raise AttributeError(name)  # a submodule: Python goes on and imports it
        raise ImportError(f"afterglow.{name} needs the native module. {_problem}")


from . import images, metrics, scenes  # noqa: E402  (they need the names above)
