# SPDX-License-Identifier: GPL-3.0-or-later
"""Fixtures that run a script inside Blender and give back what it found: in the background, and in a real window."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import textwrap
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
SCREEN = (800, 600)


def write_script(folder: Path, text: str) -> Path:
    script = folder / "script.py"
    head = f"import sys; sys.path.insert(0, {str(HERE)!r})\nimport bpy, numpy as np\nfrom inside import *\n"
    script.write_text(head + textwrap.dedent(text))
    return script


@pytest.fixture
def in_blender(blender: Callable[..., Any], tmp_path: Path) -> Callable[..., dict[str, Any]]:
    """in_blender(text, file=None, *arguments): runs the text in Blender in the background; what it gave to `result`,
    and under "output" what Blender printed."""

    def run(text: str, file: Path | None = None, *arguments: str, **more: Any) -> dict[str, Any]:
        values = tmp_path / "result.json"
        values.unlink(missing_ok=True)
        script = write_script(tmp_path, text)
        env = {"AFTERGLOW_RESULT": str(values), **more.pop("env", {})}
        start = ["--factory-startup", *([str(file)] if file else [])]
        ended = blender(*start, "--python-exit-code", "1", "--python", script, "--", *arguments, env=env, **more)
        found = json.loads(values.read_text()) if values.is_file() else {}
        return {**found, "output": ended.stdout, "code": ended.returncode}

    return run


@pytest.fixture(scope="session")
def display(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, str]]:
    """An X server without a screen, whose picture is a file; the environment for programs in it."""
    if shutil.which("Xvfb") is None:
        pytest.skip("Xvfb is not installed")
    folder = tmp_path_factory.mktemp("xvfb")
    read, write = os.pipe()
    size = "x".join(map(str, SCREEN))
    command = ["Xvfb", "-displayfd", str(write), "-screen", "0", size + "x24", "+extension", "GLX", "-nolisten", "tcp"]
    server = subprocess.Popen(
        [*command, "-fbdir", str(folder)], pass_fds=[write], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    os.close(write)
    with os.fdopen(read) as pipe:
        number = pipe.readline().strip()
    if not number:
        pytest.skip("Xvfb did not start")
    try:
        yield {
            "DISPLAY": ":" + number,
            "LIBGL_ALWAYS_SOFTWARE": "1",
            "AFTERGLOW_SCREEN": str(folder / "Xvfb_screen0"),
            "AFTERGLOW_SCREEN_SIZE": size,
        }
    finally:
        server.terminate()
        server.wait()


@pytest.fixture
def in_window(
    display: dict[str, str], library: Path, tmp_path: Path, request: pytest.FixtureRequest
) -> Iterator[Callable[..., dict[str, Any]]]:
    """in_window(text, file=None): runs the text in Blender with a real window of 800 by 600 pixels; the text ends with
    `drive(steps)`. Gives what it handed to `result`, and under "output" what Blender printed. The last screen of each test is
    kept in the folder that AFTERGLOW_PICTURES names."""
    shot = tmp_path / "screen.xwd"

    def run(text: str, file: Path | None = None, timeout: float = 120.0) -> dict[str, Any]:
        values = tmp_path / "result.json"
        values.unlink(missing_ok=True)
        script = write_script(tmp_path, text)
        env = os.environ | display | {"AFTERGLOW_RESULT": str(values), "AFTERGLOW_LIBRARY": str(library)}
        env |= {"AFTERGLOW_SCREENSHOT": str(shot)} if "AFTERGLOW_PICTURES" in env else {}
        command = [str(ROOT / "build" / "blender"), "--factory-startup", "--window-geometry", "0", "0"]
        command += [*map(str, SCREEN), *([str(file)] if file else []), "--python", str(script)]
        start = time.time()
        pipes = dict(stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace")
        ended = subprocess.run(command, env=env, timeout=timeout, **pipes)
        if ended.returncode:
            seconds = time.time() - start
            pytest.fail(f"Blender ended with {ended.returncode} after {seconds:.0f} s:\n{ended.stdout[-6000:]}")
        found = json.loads(values.read_text()) if values.is_file() else {}
        return {**found, "output": ended.stdout}

    yield run
    if shot.is_file():
        picture = Path(os.environ["AFTERGLOW_PICTURES"]) / (re.sub(r"\W+", "_", request.node.name).strip("_") + ".png")
        subprocess.run(["convert", f"xwd:{shot}", str(picture)], check=True)
