# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures 11 and 17 and table 1 of Roth et al. 2020 in our numbers, as charts, from what the bench measured:
python -m afterglow.bench.hash_cache.charts [folder [details.json ...]], build/bench and all figures there by default."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ... import chart
from ..figure import FOLDER, recorded
from .cells import PAPER

Details = Mapping[str, Any]


def points(values: Mapping[str, float]) -> list[tuple[float, float]]:
    return sorted((float(n), float(v)) for n, v in values.items())


def quality(path: Details | None, cached: Details | None, single: Details | None) -> dict[str, str]:
    """Figure 11: relMSE and MS-SSIM over samples a pixel; `cached` has all from the cache along the camera path."""
    charts = {}
    for kind, name, file, log in (("errors", "relMSE", "relmse", True), ("similarity", "MS-SSIM", "ms_ssim", False)):
        lines = []
        for details, ours, theirs in ((single, "HashCache, first frame", "path tracing, first frame"),
                                      (path, "HashCache, camera path", "path tracing, camera path")):
            if details is not None:
                lines += [chart.Line(ours, points(details[kind])), chart.Line(theirs, points(details["path_tracing"][kind]))]
        if cached is not None:
            lines.append(chart.Line("HashCache, camera path, all from the cache", points(cached[kind])))
        if lines:
            shown = [chart.Line(line.name, [(x, 1 - y) for x, y in line.points]) if not log else line for line in lines]
            charts[f"hash_cache_{file}.svg"] = chart.lines(
                f"Country Kitchen, {name} by samples a pixel", shown, "samples a pixel", name if log else "1 − MS-SSIM")
    return charts


def caching(details: Details) -> dict[str, str]:
    """Figure 17: seconds of a frame's steps, and cells updated, over the caching resolution."""
    times, cells = [], []
    for name, rows in details["settings"].items():
        times.append(chart.Line(f"caching, {name}", [(r["resolution"], r["caching"]) for r in rows]))
        times.append(chart.Line(f"reconstruction, {name}", [(r["resolution"], r["reconstruction"]) for r in rows]))
        cells.append(chart.Line(name, [(r["resolution"], r["cells"]) for r in rows]))
    return {"hash_cache_caching.svg": chart.lines("Seconds of a frame by caching resolution", times, "caching resolution", "s"),
            "hash_cache_updated.svg": chart.lines("Cells updated in a frame", cells, "caching resolution", "cells")}


def density(details: Details) -> dict[str, str]:
    """Table 1: density and memory level by level."""
    table = {int(level): row for level, row in details["table"].items()}
    densities = [chart.Line("here", [(2.0**k, row["density"]) for k, row in table.items()]),
                 chart.Line("paper", [(2.0**k, value) for k, (value, _) in PAPER.items()])]
    own = [(2.0**k, (row["data"] + row["map"]) / 2**20) for k, row in table.items()]
    memory = [chart.Line("here, data and maps with keys", own),
              chart.Line("paper, maps without keys", [(2.0**k, mib) for k, (_, mib) in PAPER.items()])]
    return {"hash_cache_density.svg": chart.lines("Density of occupied cells", densities, "cells to an edge", "density"),
            "hash_cache_memory.svg": chart.lines("Memory of a level", memory, "cells to an edge", "MiB")}


def charts(figures: list[dict[str, Any]]) -> dict[str, str]:
    """File names and SVG texts of what was measured."""

    def details(beginning: str, key: str) -> Details | None:
        found = (f["details"] for f in figures if f["figure"].startswith(beginning) and key in f["details"])
        return next(found, None)

    worth = "path-traced samples that 64 samples are worth, "
    made = quality(*(details(worth + name, "similarity")
                     for name in ("camera path, direct", "camera path, all", "first frame")))
    for function, found in ((caching, details("reconstruction's time", "settings")), (density, details("density", "table"))):
        if found is not None:
            made |= function(found)
    return made


def main(arguments: list[str]) -> None:
    folder = Path(arguments[0]) if arguments else FOLDER
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in charts(recorded("hash_cache", arguments[1:])).items():
        (folder / name).write_text(text)
        print(folder / name)


if __name__ == "__main__":
    main(sys.argv[1:])
