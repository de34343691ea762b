# SPDX-License-Identifier: GPL-3.0-or-later
"""What the figures were measured on."""

from __future__ import annotations

import os
import platform
import subprocess
from typing import Any

from .. import blenders


def machine() -> dict[str, Any]:
    model = ""
    memory = 0
    with open("/proc/cpuinfo") as file:
        for line in file:
            if line.startswith("model name"):
                model = line.split(":", 1)[1].strip()
                break
    with open("/proc/meminfo") as file:
        memory = int(file.readline().split()[1]) * 1024
    return {"processor": model, "cores": len(os.sched_getaffinity(0)), "memory": memory, "system": platform.platform()}


def versions() -> dict[str, str]:
    from .. import __version__
    from .. import versions as native

    result = {"afterglow": __version__, **native(), "python": platform.python_version()}
    for name, command in (("commit", ["git", "-C", str(blenders.project()), "rev-parse", "HEAD"]),
                          ("blender", ["blender", "--version"]), ("valgrind", ["valgrind", "--version"])):
        try:
            text = subprocess.run(command, capture_output=True, text=True, timeout=60).stdout
        except OSError:
            continue
        result[name] = text.splitlines()[0].strip() if text else ""
    return result
