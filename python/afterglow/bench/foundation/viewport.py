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
from ..figure import Context, Figure
from .kitchen import scene

OBJECT, STEP, SETTLE, WATCH = "Mesh291", "0.3", "12", "6"


def first_image(engine: str, settings: tuple[str, ...] = ()) -> float:
    """Seconds until half of what the edit changes is shown."""
    tool = blenders.shared() / "tools" / "viewport_latency.py"
    command = [sys.executable, str(tool), *blenders.debian(), str(scene()[0]), engine, OBJECT, STEP, SETTLE, WATCH, *settings]
    ended = subprocess.run(command, capture_output=True, text=True, errors="replace", timeout=400)
    found = re.search(r"FIRST (-?[0-9.]+)", ended.stdout)
    if ended.returncode or not found or float(found[1]) < 0:
        raise RuntimeError(f"no first image was seen: {(ended.stdout + ended.stderr)[-600:]}")
    return float(found[1])


def measure(context: Context) -> list[Figure]:
    if shutil.which("Xvfb") is None:
        raise blenders.Unavailable("Xvfb is absent: a window cannot be opened (Debian: xvfb)")
    times = [first_image("AFTERGLOW") for _ in range(max(3, context.pairs))]
    theirs = first_image("CYCLES")
    middle = statistics.median(times)
    spread = 1.2533 * 1.4826 * statistics.median(abs(t - middle) for t in times) / len(times) ** 0.5
    return [Figure("edit to first viewport image", "country_kitchen 800×600", 1e3 * middle, "ms", "Cycles in Debian's Blender",
                   1e3 * theirs, None, "≤ 150", spread=1e3 * spread, details={"seconds": times}).judged()]
