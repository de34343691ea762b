# SPDX-License-Identifier: GPL-3.0-or-later
"""The structure: density and memory of occupied cells level by level (table 1 of the paper), the time to build them, look-ups,
and reconstruction alone."""

from __future__ import annotations

from ..figure import Context, Figure
from . import walk

DENSITIES = {8: 0.012, 10: 0.003, 12: 0.001}  # by level, of the paper
RECORD = 24


def occupied(context: Context) -> list[Figure]:
    answers, _ = walk.run([{"do": "cells", "levels": 11}, {"do": "cells", "levels": 12}])
    half, whole = answers[1], answers[2]
    figures = []
    table = {level: {"cells": n, "density": n / 8.0**level, "data": n * RECORD, "map": whole["map_bytes"][level]}
             for level, n in enumerate(whole["cells"])}
    for level, density in DENSITIES.items():
        found = table[level]["density"]
        figures.append(Figure(f"density of occupied cells at {2**level}³", "country_kitchen", found, "", "table 1 of the paper",
                              density, found / density, "≤ 1.5", details={"table": table}).judged())
    for name, found, goal in (("2048³", half, 555 * 2**20), ("4096³", whole, 2.57 * 2**30)):
        size = sum(n * RECORD + m for n, m in zip(found["cells"], found["map_bytes"]))
        figures.append(Figure(f"memory of all levels at {name}, data, maps and keys", "country_kitchen", size / 2**20, "MiB",
                              "table 1, without keys", goal / 2**20, size / goal, "≤ 1.0",
                              details={"peak_bytes": found["peak_bytes"]}).judged())
    seconds = half["seconds_mark"] + half["seconds_maps"]
    figures.append(Figure("build of 2048³", "country_kitchen", seconds, "s", "the paper, a graphics card", None, None, "≤ 6",
                          details={"mark": half["seconds_mark"], "maps": half["seconds_maps"]}).judged())
    return figures


def lookups(context: Context) -> list[Figure]:
    """Among ten million cells, in random order, on one thread: the table of cells made when needed, and the paper's maps."""
    answers, _ = walk.run([{"do": "lookups", "cells": 10_000_000, "lookups": 20_000_000}])
    found = answers[1]
    return [Figure(f"look-ups a second over random reads, {name}", "10 million cells", found[key], "1/s", "random reads",
                   found["reads"], found[key] / found["reads"], "≥ 0.5", details={"bytes": found[f"{key}_bytes"]}).judged()
            for key, name in (("table", "cells when needed"), ("map", "map of occupied cells"))]


def reconstruction(context: Context) -> list[Figure]:
    """Frames a second with a warm cache and no caching paths: camera rays, direct light, look-ups, filter, film."""
    size = (800, 600)
    jobs = [walk.render(None, f, 4) for f in range(2)]
    jobs += [walk.render(None, 10 + f, 1, hash_resolution=0.0, hash_running=False, hash_lights=1) for f in range(context.pairs)]
    answers, _ = walk.run(jobs, size)
    seconds = sorted(a["seconds"] for a in answers[3:])
    middle = seconds[len(seconds) // 2]
    return [Figure("reconstruction alone", "country_kitchen 800×600", 1 / middle, "frames/s", "the paper, 1024², a graphics card",
                   17, None, "≥ 4", details={"seconds": seconds, "stages": answers[-1]["values"]}).judged()]
