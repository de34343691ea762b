# SPDX-License-Identifier: GPL-3.0-or-later
"""From an object's move to the first viewport image of the new state, seen from outside a real window under Xvfb
(../shared/tools/viewport_latency.py)."""

from __future__ import annotations

import re
import shutil
import statistics
import subprocess
import sys

from ... import blenders
from ..figure import Context, Figure, spread_of_median
from .kitchen import scene

OBJECT, STEP, SETTLE, WATCH = "Mesh291", "0.3", "7", "4"


def first_image(engine: str, settings: tuple[str, ...] = ()) -> float:
    """Seconds until half of what the edit changes is shown."""
    command = [sys.executable, str(blenders.shared_tool("viewport_latency.py")), *blenders.debian(), str(scene()[0]), engine, OBJECT,
               STEP, SETTLE, WATCH, *settings]
    ended = subprocess.run(command, capture_output=True, text=True, errors="replace", timeout=400)
    found = re.search(r"FIRST (-?[0-9.]+)", ended.stdout)
    if ended.returncode or not found or float(found[1]) < 0:
        raise RuntimeError(f"no first image was seen: {(ended.stdout + ended.stderr)[-600:]}")
    return float(found[1])


def measure(context: Context) -> list[Figure]:
    if shutil.which("Xvfb") is None:
        raise blenders.Unavailable("Xvfb is absent: a window cannot be opened (Debian: xvfb)")
    first_image("AFTERGLOW")  # shaders and pages are cached now
    times, theirs = [], []
    for number in range(max(5, context.pairs)):
        times.append(first_image("AFTERGLOW"))
        if number % 2 == 0:
            theirs.append(first_image("CYCLES"))
    return [Figure("edit to first viewport image", "country_kitchen 800×600", 1e3 * statistics.median(times), "ms",
                   "Cycles in Debian's Blender", 1e3 * statistics.median(theirs), None, "≤ 150", spread=1e3 * spread_of_median(times),
                   details={"seconds": times, "cycles": theirs}).judged()]
