# SPDX-License-Identifier: GPL-3.0-or-later
"""Official Blenders as Python modules: one venv for each version under build/venvs, from PyPI. Pinned, so that a test's
answer does not change by itself. `python tools/venvs.py 4.5 5.0` makes them; AFTERGLOW_VENVS names another folder."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
FOLDER = Path(os.environ.get("AFTERGLOW_VENVS") or ROOT / "build" / "venvs")
RELEASES = {"4.2": "4.2.23", "4.5": "4.5.15", "5.0": "5.0.1"}
PYTHON = "/usr/bin/python3" if Path("/usr/bin/python3").exists() else sys.executable


class Unavailable(Exception):
    """The venv cannot be made here: the text says why."""


def ensure(version: str) -> Path:
    """The Python of the venv of "4.2", "4.5" or "5.0"; made when absent. Raises Unavailable."""
    release = RELEASES[version]
    folder = FOLDER / release
    python = folder / "bin" / "python"
    done = folder / ".complete"
    # Asked first: a venv that is there may have been made by another system's Python.
    where = subprocess.run([PYTHON, "-c", "import sys; print('%d.%d' % sys.version_info[:2])"], capture_output=True, text=True)
    if where.stdout.strip() != "3.11":
        raise Unavailable(f"bpy {release} needs Python 3.11, {PYTHON} is {where.stdout.strip()}")
    if done.is_file() and python.exists():
        return python
    print(f"Making {folder} with the official Blender {release} from PyPI (about 350 MB)", file=sys.stderr, flush=True)
    subprocess.run([PYTHON, "-m", "venv", "--clear", str(folder)], check=True)
    for _ in range(3):
        ended = subprocess.run([str(python), "-m", "pip", "install", "-q", f"bpy=={release}"], capture_output=True, text=True)
        if ended.returncode == 0:
            done.write_text(release + "\n")
            return python
    raise Unavailable(f"bpy {release} could not be installed from PyPI: {ended.stderr.strip()[-400:]}")


if __name__ == "__main__":
    for wanted in sys.argv[1:] or list(RELEASES):
        print(ensure(wanted))
