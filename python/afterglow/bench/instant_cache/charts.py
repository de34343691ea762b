# SPDX-License-Identifier: GPL-3.0-or-later
"""Error against time at the default and two finer settings, every scene a line, from what the bench's figure `error` measured:
python -m afterglow.bench.instant_cache.charts [folder [details.json ...]], build/bench and all figures there by default."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from ... import chart
from ..figure import FOLDER, recorded
from .quality import LEVELS


def charts(figures: list[dict[str, Any]]) -> dict[str, str]:
    """File names and SVG texts of what was measured."""
    lines = []
    for figure in figures:
        levels = figure.get("details", {}).get("levels")
        if not levels or not figure["figure"].startswith("relMSE against path tracing"):
            continue
        points = [(float(levels[name]["seconds"]), float(levels[name]["relmse"])) for name in LEVELS if name in levels]
        lines.append(chart.Line(str(figure["scene"]).replace("_", " "), [(s, e) for s, e in points if s > 0 and e > 0]))
    if not lines:
        return {}
    return {"instant_cache_error.svg": chart.lines("relMSE against path tracing by time: default, finer, finest", lines,
                                                   "seconds, scene and cache included", "relMSE")}


def main(arguments: list[str]) -> None:
    folder = Path(arguments[0]) if arguments else FOLDER
    made = charts(recorded("instant_cache", arguments[1:]))
    if not made:
        sys.exit("no figure of errors: make bench NAME=instant_cache FIGURE=error")
    for name, text in made.items():
        (folder / name).write_text(text)
        print(folder / name)


if __name__ == "__main__":
    main(sys.argv[1:])
