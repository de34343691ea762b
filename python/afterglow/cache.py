# SPDX-License-Identifier: GPL-3.0-or-later
"""References that are expensive to make, kept by key in a folder outside the repository: AFTERGLOW_CACHE or ~/.cache/afterglow.

Images may be kept, times never: they are measured anew in every run.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

FORMAT = 1  # raise it when what the files hold changes its meaning


def folder() -> Path:
    named = os.environ.get("AFTERGLOW_CACHE")
    return Path(named) if named else Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "afterglow"


def key_of(values: Mapping[str, Any]) -> str:
    """A name that differs whenever a value does."""
    text = json.dumps({"format": FORMAT, **values}, sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()[:24]


def file_key(path: str | os.PathLike[str]) -> str:
    """A file's content as a key."""
    return hashlib.sha256(Path(path).read_bytes()).hexdigest()[:24]


def arrays(values: Mapping[str, Any], make: Callable[[], Mapping[str, Any]]) -> dict[str, Any]:
    """The arrays that were kept under these values, or those that `make` gives, which are kept then."""
    path = folder() / f"{values.get('kind', 'data')}_{key_of(values)}.npz"
    if path.is_file():
        try:
            with np.load(path) as kept:
                return dict(kept)
        except (OSError, ValueError):
            path.unlink(missing_ok=True)  # a half-written or broken file is made again
    made = dict(make())
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_suffix(f".{os.getpid()}.npz")
    np.savez_compressed(temporary, **made)
    temporary.replace(path)
    return made
