# SPDX-License-Identifier: GPL-3.0-or-later
"""Reading a mesh of a million triangles from Blender: the add-on's sync against Cycles' own in the same Blender.

Cycles tells what its sync took when it is asked for its log ("Total time spent synchronizing data"); the add-on's statistics
have it as the stage "sync". Both read the whole file anew in every render.
"""

from __future__ import annotations

import re
import statistics
import subprocess
import tempfile
from pathlib import Path

from ... import blenders
from ..figure import Context, Figure, Pairs

TRIANGLES = 1_000_000
CYCLES = """
import bpy, sys
scene = bpy.context.scene
scene.render.engine = "CYCLES"
scene.cycles.samples = 1
for _ in range({count}):
    bpy.ops.render.render()
"""


def cycles_seconds(file: Path, count: int, folder: Path) -> list[float]:
    """Seconds that Cycles says it spent on synchronizing, in each of `count` renders of one process."""
    script = folder / "cycles.py"
    script.write_text(CYCLES.format(count=count))
    ended = subprocess.run([*blenders.debian(), "-b", str(file), "--debug-cycles", "--python", str(script)], capture_output=True,
                           text=True, errors="replace", timeout=900)
    times = [float(t) for t in re.findall(r"Total time spent synchronizing data: ([0-9.e+-]+)", ended.stdout + ended.stderr)]
    if len(times) < count:
        raise blenders.Unavailable("this Blender's Cycles does not tell what its synchronizing took")
    return times[-count:]


def measure(context: Context) -> list[Figure]:
    with tempfile.TemporaryDirectory(prefix="afterglow_sync_") as name, blenders.Worker.of_debian() as worker:
        folder = Path(name)
        made = worker.job("grid", triangles=TRIANGLES)
        file = folder / "grid.blend"
        worker.job("save", file=str(file))
        count = max(5, context.pairs)
        ours: list[float] = []
        theirs: list[float] = []
        for half in range(2):  # Cycles before and after, ours between: a drifting machine shows in the spread
            theirs += cycles_seconds(file, count, folder)
            if half == 0:
                for _ in range(2 * count):
                    answer = worker.render("AFTERGLOW", samples=1, accuracy=0.0)
                    ours.append(float(answer["statistics"]["seconds"]["sync"]))
    pairs = Pairs(ours, theirs)
    return [Figure("sync of a mesh", f"{made['triangles']:,} triangles", 1e3 * statistics.median(ours), "ms", "Cycles in Debian's Blender",
                   1e3 * statistics.median(theirs), pairs.median, "≤ 1", spread=pairs.spread,
                   details={"ours": ours, "cycles": theirs, "blender": worker.version}).judged()]
