# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that strangers made: how many of their pictures agree with Cycles'. ../shared/tools/strangers.py renders and agree.py
judges; two Blenders work side by side, because small files keep one busy with opening them."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from ... import blenders
from ..figure import Context, Figure

SAMPLES, VERSION, WANTED, PATIENCE = 128, "5.0", 57, 300.0


def render(files: list[Path], output: Path) -> dict[str, str]:
    """Renders the files in one Blender, or in another after a file that ended it; file → why it failed."""
    tool = str(blenders.shared_tool("strangers.py"))
    failed: dict[str, str] = {}
    worker: blenders.Worker | None = None
    for file in files:
        picture = output / f"{file.stem}.exr"
        try:
            worker = worker or blenders.Worker.of_official(VERSION)
            worker.job("script", file=tool, arguments=["AFTERGLOW", str(SAMPLES), str(picture), str(file)], timeout=PATIENCE)
            if not picture.is_file():
                failed[file.stem] = "no picture was written"
        except blenders.WorkerError as error:
            failed[file.stem] = str(error)[-400:]
            if worker is not None and worker.process.poll() is not None:
                worker.close()
                worker = None
    if worker is not None:
        worker.close()
    return failed


def strangers(context: Context) -> list[Figure]:
    folder = blenders.shared_scenes() / "strangers"
    files = sorted(folder.glob("*.blend"))
    if not files:
        raise blenders.Unavailable(f"{folder} is absent")
    blenders.resources(VERSION)  # before two threads want it
    with tempfile.TemporaryDirectory(prefix="afterglow_strangers_") as output, ThreadPoolExecutor(2) as pool:
        failed: dict[str, str] = {}
        for part in pool.map(lambda half: render(half, Path(output)), (files[::2], files[1::2])):
            failed |= part
        ended = subprocess.run([sys.executable, str(blenders.shared_tool("agree.py")), str(folder), output], capture_output=True,
                               text=True)
    if ended.returncode:
        raise RuntimeError(f"agree.py: {(ended.stdout + ended.stderr)[-400:]}")
    report = ended.stdout.splitlines()
    differing = [line.split()[0] for line in report[:-1] if not line.rstrip()[-1:].isdigit()]
    figure = Figure("strangers' files that agree", f"{len(files)} files", int(report[-1].split()[1]), "files",
                    "Cycles 5.0.1, 512 samples", len(files), None, f"≥ {WANTED}",
                    note=f"differ: {', '.join(differing)}" if differing else "",
                    details={"report": report, "failed": failed}).judged()
    if failed:
        figure.holds, figure.note = False, f"failed: {', '.join(failed)}; {figure.note}"
    return [figure]
