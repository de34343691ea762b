# SPDX-License-Identifier: GPL-3.0-or-later
"""The Python package behind the add-on, or the reason why it could not be loaded.

The add-on registers even without its package, so that a broken installation shows a sentence in the panels and in the
render's report, and never a missing engine.
"""

from __future__ import annotations

from typing import Any

afterglow: Any = None
problem = ""

try:
    from .library import afterglow as _package

    if not hasattr(_package, "Session"):
        raise ImportError(f"the package at {_package.__file__} has no native module")
    afterglow = _package
except (
    Exception
) as error:  # Whatever stops the native module from loading is told to the user, not to the console alone.
    problem = f"The native module of Afterglow could not be loaded: {error}"
    print("Afterglow:", problem)

_FALLBACK_METHODS: list[dict[str, Any]] = [
    {
        "id": "PATH_TRACING",
        "label": "Path Tracing",
        "description": "Follow the light of every pixel anew",
        "settings": [],
    }
]


def method_descriptions() -> list[dict[str, Any]]:
    """What each method says about itself; the path tracer's bare name where the package is missing."""
    if afterglow is None:
        return _FALLBACK_METHODS
    return list(afterglow.method_descriptions()) or _FALLBACK_METHODS


def chosen_method(method: str, viewport: bool) -> str:
    """The method that renders where the engine may choose; the one that is named otherwise."""
    return method if afterglow is None else afterglow.chosen_method(method, viewport)


def denoisers() -> list[dict[str, Any]]:
    """Every known denoiser, with the reason where it is not available."""
    if afterglow is None:
        return [{"id": "NONE", "label": "None", "available": False, "reason": problem, "path": "", "version": ""}]
    global _denoisers
    if _denoisers is None:
        _denoisers = list(afterglow.denoisers())
    return _denoisers


_denoisers: list[dict[str, Any]] | None = None


def denoise_problem(wanted: str = "AUTO") -> str:
    """Why this denoiser, or any, cannot be used here; empty when it can."""
    known = [d for d in denoisers() if wanted in ("AUTO", d["id"])]
    if any(d["available"] for d in known):
        return ""
    return "; ".join(f"{d['label']}: {d['reason']}" for d in known) or "no denoiser is known"
