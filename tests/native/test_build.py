# SPDX-License-Identifier: GPL-3.0-or-later
"""The build's own promises: the tasks that the README names exist, and set-up has nothing to do twice."""

import subprocess
from pathlib import Path


def test_make_help_names_the_tasks(root: Path) -> None:
    text = subprocess.run(["make", "-s", "help"], cwd=root, capture_output=True, text=True, check=True).stdout
    for task in ("build", "demo", "test", "bench", "package", "test-blenders", "asan", "tsan", "format", "clean"):
        assert f"make {task}" in text


def test_set_up_has_nothing_to_do_twice(root: Path) -> None:
    ended = subprocess.run(["tools/setup.sh", "build", "demo"], cwd=root, capture_output=True, text=True, check=True)
    assert ended.stdout == ""
