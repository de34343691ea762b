# SPDX-License-Identifier: GPL-3.0-or-later
"""The structure: density and memory of occupied cells level by level (table 1 of the paper), the time to build them, look-ups,
and reconstruction alone."""

from __future__ import annotations

import statistics

from ..figure import Context, Figure, Pairs
from . import walk

# The paper's table 1, Country Kitchen: level, density, MiB of data and map.
PAPER = {0: (1.0, 2.7e-5), 1: (0.5, 1.08e-4), 2: (0.375, 6.5e-4), 3: (0.193, 2.69e-3), 4: (0.124, 0.01379), 5: (0.070, 0.06248),
         6: (0.038, 0.271), 7: (0.023, 1.314), 8: (0.012, 5.51), 9: (0.006, 22.99), 10: (0.003, 96.56), 11: (0.002, 428.47),
         12: (0.001, 2071.9)}
JUDGED = (8, 10, 12)


def occupied(context: Context) -> list[Figure]:
    answers, _ = walk.run([{"do": "cells", "levels": 11}, {"do": "cells", "levels": 12}])
    half, whole = answers[1], answers[2]
    figures = []
    table = {level: {"cells": n, "density": n / 8.0**level, "data": whole["data_bytes"][level], "map": whole["map_bytes"][level]}
             for level, n in enumerate(whole["cells"])}
    for level in JUDGED:
        density, found = PAPER[level][0], table[level]["density"]
        figures.append(Figure(f"density of occupied cells at {2**level}³", "country_kitchen", found, "", "table 1 of the paper",
                              density, found / density, "≤ 1.5", details={"table": table}).judged())
    for name, found, goal in (("2048³", half, 555 * 2**20), ("4096³", whole, 2.57 * 2**30)):
        size = sum(found["data_bytes"]) + sum(found["map_bytes"])
        figures.append(Figure(f"memory of all levels at {name}, data, maps and keys", "country_kitchen", size / 2**20, "MiB",
                              "table 1, without keys", goal / 2**20, size / goal, "≤ 1.0",
                              details={"peak_bytes": found["peak_bytes"]}).judged())
        figures.append(Figure(f"most memory while building {name}, over the finished", "country_kitchen",
                              found["peak_bytes"] / size, "", "", None, None, "≤ 1.5",
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
    """Frames a second with a warm cache and no caching paths: camera rays, direct light, look-ups, filter, film. Further samples,
    those of edges too, are left out."""
    size = (800, 600)
    jobs = [walk.render(None, f, 4) for f in range(2)]
    jobs += [walk.render(None, 10 + f, 1, hash_resolution=0.0, hash_running=False, hash_lights=1, hash_extra=0.0,
                         sight=False)
             for f in range(context.pairs)]
    answers, _ = walk.run(jobs, size)
    seconds = sorted(a["seconds"] for a in answers[3:])
    middle = seconds[len(seconds) // 2]
    return [Figure("reconstruction alone", "country_kitchen 800×600", 1 / middle, "frames/s", "the paper, 1024², a graphics card",
                   17, None, "≥ 4", details={"seconds": seconds, "stages": answers[-1]["values"]}).judged()]


RESOLUTIONS = (0.125, 0.25, 0.5, 1.0)


def caching(context: Context) -> list[Figure]:
    """Figure 17: the steps of warm frames by the number of stored surfaces, the length of paths and the caching resolution. Each
    view of a walk is rendered at every resolution in turn, there and back, so that a machine's moods meet all of them."""
    settings: dict[str, list[dict[str, float]]] = {}
    measured: dict[str, Pairs] = {}
    for store, length in ((1, 1), (3, 3), (8, 8)):
        name = f"{store} stored, {length} further"
        order = [(f, r) for f in range(2 + context.pairs) for r in RESOLUTIONS[::1 - 2 * (f % 2)]]
        answers, _ = walk.run([walk.render(f / 100, 40 + f, 1, hash_resolution=r, hash_store=store, hash_length=length,
                                           hash_extra=0.0, hash_running=False) for f, r in order])
        steps: dict[float, list[dict[str, float]]] = {r: [] for r in RESOLUTIONS}
        for (f, r), before, answer in zip(order, answers, answers[1:]):
            now = answer["values"]
            if f >= 2:
                steps[r].append({"caching": now["seconds_prepare"], "cells": now["cells_updated"] - before["values"]["cells_updated"],
                                 "reconstruction": sum(now[f"seconds_{it}"] for it in ("walk", "gather", "filter", "film"))})
        settings[name] = [{"resolution": r, **{key: statistics.median(step[key] for step in steps[r]) for key in steps[r][0]}}
                          for r in RESOLUTIONS]
        measured[name] = Pairs(*([step["reconstruction"] for step in steps[r]] for r in (RESOLUTIONS[-1], RESOLUTIONS[0])))
    return [Figure(f"reconstruction's time over that with the fewest caching paths, {name}", "country_kitchen 640×360",
                   statistics.median(pairs.ours), "s", f"caching resolution {RESOLUTIONS[0]}", statistics.median(pairs.theirs),
                   pairs.median, "≤ 1.3", spread=pairs.spread, details={"settings": settings}).judged()
            for name, pairs in measured.items()]
