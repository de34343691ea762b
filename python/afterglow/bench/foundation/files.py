# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that strangers made: how many of their pictures agree with Cycles'. Uses ../shared/tools/strangers.py and agree.py."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

from ... import blenders
from ..figure import Context, Figure

SAMPLES, VERSION, WANTED = 256, "5.0", 57


def strangers(context: Context) -> list[Figure]:
    folder, tools = blenders.shared() / "scenes" / "strangers", blenders.shared() / "tools"
    files = sorted(folder.glob("*.blend"))
    if not files or not (tools / "strangers.py").is_file():
        raise blenders.Unavailable(f"{folder} or {tools}/strangers.py is absent")
    python = blenders.official(VERSION)
    environment = dict(os.environ, BLENDER_USER_RESOURCES=str(blenders.resources(VERSION)))
    failed: dict[str, str] = {}
    with tempfile.TemporaryDirectory(prefix="afterglow_strangers_") as output:
        for file in files:
            picture = Path(output) / f"{file.stem}.exr"
            try:
                ended = subprocess.run([str(python), str(tools / "strangers.py"), "AFTERGLOW", str(SAMPLES), str(picture), str(file)],
                                       capture_output=True, text=True, errors="replace", env=environment, timeout=600)
                if ended.returncode or not picture.is_file():
                    failed[file.stem] = (ended.stdout + ended.stderr)[-400:]
            except subprocess.TimeoutExpired:
                failed[file.stem] = "took longer than 600 s"
        report = subprocess.run([sys.executable, str(tools / "agree.py"), str(folder), output], capture_output=True, text=True,
                                check=True).stdout.splitlines()
    agreed = int(report[-1].split()[1])
    for line in report[:-1]:
        if not line.rstrip().endswith(tuple("0123456789")):
            context.say("  " + line)
    figure = Figure("strangers' files that agree", f"{len(files)} files", agreed, "files", "Cycles 5.0.1, 512 samples", len(files),
                    None, f"≥ {WANTED}", details={"report": report, "failed": failed}).judged()
    if failed:
        figure.holds, figure.note = False, f"failed: {', '.join(failed)}"
    return [figure]
