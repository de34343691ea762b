# SPDX-License-Identifier: GPL-3.0-or-later
"""What reads Blender's data, by itself: against a stand-in of the native scene that checks and remembers what it is given."""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

HERE = Path(__file__).parent
BLENDERS = ["debian", *os.environ.get("AFTERGLOW_OFFICIAL", "4.5 5.0").split()]


@pytest.fixture(scope="session")
def run_script(bpy_venv: Callable[[str], Path]) -> Callable[..., dict]:
    """run_script(blender, script, *arguments): what the script printed after RESULT."""
    def run(version: str, script: str, *arguments: str | Path, timeout: float = 120.0) -> dict:
        host = ["blender", "-b", "--factory-startup", "--python-exit-code", "1", "--python"] if version == "debian" else \
            [str(bpy_venv(version))]
        ended = subprocess.run([*host, str(HERE / script), "--", *map(str, arguments)], stdout=subprocess.PIPE,
                               stderr=subprocess.STDOUT, text=True, errors="replace", timeout=timeout,
                               env={**os.environ, "PYTHONDONTWRITEBYTECODE": "1"})
        lines = [line for line in ended.stdout.splitlines() if line.startswith("RESULT ")]
        assert lines, ended.stdout[-5000:]
        return json.loads(lines[-1][7:])
    return run


@pytest.mark.parametrize("version", BLENDERS)
def test_edits_step_by_step_equal_a_fresh_sync(run_script: Callable[..., dict], version: str) -> None:
    result = run_script(version, "sync_edits.py", 1, 60)
    assert result["syncs"] > 40  # the others changed nothing that Blender would report
    assert result["calls"]["set_transforms"] > 0


@pytest.mark.slow
@pytest.mark.parametrize("version", BLENDERS)
@pytest.mark.parametrize("seed", [2, 3])
def test_many_edits_equal_a_fresh_sync(run_script: Callable[..., dict], version: str, seed: int) -> None:
    run_script(version, "sync_edits.py", seed, 300)


@pytest.mark.slow
@pytest.mark.parametrize("version", BLENDERS)
def test_strange_files_are_read(run_script: Callable[..., dict], scenes: Path, version: str) -> None:
    """Every file is read without an exception, and reading all of it again changes nothing. 3.4 cannot open most of them."""
    old = version == "debian" and "Blender 3." in subprocess.run(["blender", "--version"], capture_output=True, text=True).stdout
    strangers = [] if old else sorted((scenes / "strangers").glob("*.blend"))
    result = run_script(version, "sync_files.py", *strangers, scenes / "country_kitchen.blend", timeout=300)
    for name, found in result.items():
        if "skipped" in found:
            continue
        assert found["again"] == [0, 0, 0, False, 0], name
        assert not [text for text in found["warnings"] if "cannot be" in text], (name, found["warnings"])
    assert result["country_kitchen.blend"]["meshes"] == 299
