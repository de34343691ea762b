# SPDX-License-Identifier: GPL-3.0-or-later
"""Reading a mesh of a million triangles from Blender: the add-on's sync against Cycles' own in the same Blender process, in
turns. Both read the whole file anew in every render; building the BVH counts for neither.

The add-on's statistics have it as the stage "sync". Debian's Cycles logs it ("Total time spent synchronizing data") when asked;
official ones tell their stages: from the first object that is synchronized to the stage after it.
"""

from __future__ import annotations

import re
import statistics
import tempfile
from pathlib import Path
from typing import Any

from ... import blenders
from ..figure import Context, Figure, alternate

TRIANGLES = 1_000_000
LOGGED = re.compile(r"Total time spent synchronizing data: ([0-9.e+-]+)")


def staged(stages: list[list[Any]]) -> float | None:
    """Seconds from the first "Synchronizing object" to what comes after the last."""
    times = [(float(time), str(words)) for time, words in stages]
    inside = [i for i, (_, words) in enumerate(times) if "Synchronizing object" in words]
    if not inside or inside[-1] + 1 >= len(times):
        return None
    return times[inside[-1] + 1][0] - times[inside[0]][0]


def of_cycles(worker: blenders.Worker) -> float:
    before = worker.log.stat().st_size
    answer = worker.render("CYCLES", samples=1)
    logged = LOGGED.findall(worker.printed(before))
    seconds = float(logged[-1]) if logged else staged(answer["stages"])
    if seconds is None:
        raise blenders.Unavailable("this Blender's Cycles does not tell what its synchronizing took")
    return seconds


def of_afterglow(worker: blenders.Worker) -> float:
    return float(worker.render("AFTERGLOW", samples=1, accuracy=0.0)["statistics"]["seconds"]["sync"])


def measure(context: Context) -> list[Figure]:
    figures = []
    with tempfile.TemporaryDirectory(prefix="afterglow_sync_") as folder:
        file = Path(folder) / "grid.blend"
        for start in (lambda: blenders.Worker.of_debian("--debug-cycles"), lambda: blenders.Worker.of_official("5.0")):
            with start() as worker:
                if not file.is_file():
                    triangles = worker.job("grid", triangles=TRIANGLES)["triangles"]
                    worker.job("save", file=str(file))
                worker.open(file)
                of_cycles(worker), of_afterglow(worker)  # the first reading pays for pages and modules
                pairs = alternate(max(7, context.pairs), lambda: of_afterglow(worker), lambda: of_cycles(worker))
                figures.append(Figure(
                    "sync of a mesh", f"{triangles:,} triangles, Blender {worker.version}",
                    1e3 * statistics.median(pairs.ours), "ms",
                    "Cycles in the same Blender", 1e3 * statistics.median(pairs.theirs), pairs.median, "≤ 1", spread=pairs.spread,
                    details={"ours": pairs.ours, "cycles": pairs.theirs, "ratios": pairs.ratios}).judged())
    return figures
