# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds the `afterglow` package, wherever this add-on came from. The rest of the add-on says
`from .library import afterglow` and nothing else.

In this order: the folder that the environment variable AFTERGLOW_LIBRARY names (a build from source: build/blender sets
it), the folder `lib` beside this file (the legacy zip), and Python's own path (an extension's wheel, installed by
Blender). ImportError's text is what Blender shows to the user who ticks the add-on's box."""

from __future__ import annotations

import importlib
import os
import sys
from pathlib import Path
from types import ModuleType


def _find() -> ModuleType:
    named = os.environ.get("AFTERGLOW_LIBRARY", "")
    beside = Path(__file__).resolve().parent / "lib"
    folder = named if named and (Path(named) / "afterglow").is_dir() else str(beside) if beside.is_dir() else ""
    if named and folder != named:
        raise ImportError(
            f"AFTERGLOW_LIBRARY names '{named}', which holds no folder 'afterglow': run `make build`, "
            "or unset the variable"
        )
    if folder and folder not in sys.path:
        sys.path.insert(0, folder)
    try:
        return importlib.import_module("afterglow")
    except ModuleNotFoundError as missing:
        if missing.name != "afterglow":
            raise
        raise ImportError(
            "Afterglow's native part is not installed with this add-on: install the zip made for this "
            "Blender (see the README), or start Blender through build/blender"
        ) from missing


afterglow = _find()
