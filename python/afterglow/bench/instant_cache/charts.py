# SPDX-License-Identifier: GPL-3.0-or-later
"""Error against time at the default and two finer settings, every scene a line, from what the bench's figure `error` measured:
python -m afterglow.bench.instant_cache.charts [build/bench/instant_cache_error_details.json [folder]]."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

from ... import chart
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
    path = Path(arguments[0] if arguments else "build/bench/instant_cache_error_details.json")
    folder = Path(arguments[1]) if len(arguments) > 1 else path.parent
    made = charts(json.loads(path.read_text())["figures"])
    if not made:
        sys.exit(f"{path} has no figure of errors: make bench NAME=instant_cache FIGURE=error")
    for name, text in made.items():
        (folder / name).write_text(text)
        print(folder / name)


if __name__ == "__main__":
    main(sys.argv[1:])
