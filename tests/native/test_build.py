# SPDX-License-Identifier: GPL-3.0-or-later
"""The build's own promises: the tasks that the README names exist, and set-up has nothing to do twice."""

import os
import re
import subprocess
from pathlib import Path


def test_make_help_names_the_tasks(root: Path) -> None:
    text = subprocess.run(["make", "-s", "help"], cwd=root, capture_output=True, text=True, check=True).stdout
    makefile = (root / "Makefile").read_text()
    tasks = re.search(r"^\.PHONY: (build .*)$", makefile, re.MULTILINE).group(1).split()
    assert {"build", "demo", "test", "bench", "package", "test-blenders", "help"} <= set(tasks)
    for task in tasks:
        assert re.search(rf"^(?:[\w-]+ )*{task}(?: [\w-]+)*:", makefile, re.MULTILINE), f"no rule for make {task}"
        assert re.search(rf"make {task}\b", text), f"make help does not name {task}"


def test_set_up_has_nothing_to_do_twice(root: Path) -> None:
    ended = subprocess.run(["tools/setup.sh", "build", "demo"], cwd=root, capture_output=True, text=True, check=True)
    assert ended.stdout == ""


def fake_blender(folder: Path) -> Path:
    """A program that says which module it was given and what follows its own arguments."""
    folder.mkdir(parents=True)
    program = folder / "blender"
    program.write_text('#!/bin/sh\necho "$AFTERGLOW_LIBRARY"\nshift 2\necho "$@"\n')
    program.chmod(0o755)
    return program


def start(root: Path, tmp_path: Path, blender: str) -> "subprocess.CompletedProcess[str]":
    """tools/blender.in, filled in for an empty build folder, with BLENDER and two arguments."""
    wrapper = tmp_path / "wrapper"
    text = (root / "tools" / "blender.in").read_text().replace("@ROOT@", str(tmp_path)).replace("@PRESET@", "release")
    wrapper.write_text(text)
    environment = {name: value for name, value in os.environ.items() if name != "AFTERGLOW_LIBRARY"}
    return subprocess.run(["bash", wrapper, "-b", "a file.blend"], capture_output=True, text=True,
                          env=environment | {"BLENDER": blender})


def test_the_wrapper_gives_each_blender_its_module(root: Path, tmp_path: Path) -> None:
    ended = start(root, tmp_path, str(fake_blender(tmp_path / "debian")))
    assert ended.stdout == f"{tmp_path}/build/release/python\n-b a file.blend\n"

    official = fake_blender(tmp_path / "official")
    (official.parent / "4.5" / "python").mkdir(parents=True)
    ended = start(root, tmp_path, str(official))
    assert ended.returncode == 1 and "make package" in ended.stderr
    (tmp_path / "build" / "official" / "python").mkdir(parents=True)
    assert start(root, tmp_path, str(official)).stdout == f"{tmp_path}/build/official/python\n-b a file.blend\n"


def test_the_wrapper_names_a_missing_blender(root: Path, tmp_path: Path) -> None:
    ended = start(root, tmp_path, str(tmp_path / "nowhere"))
    assert ended.returncode == 127 and "nowhere" in ended.stderr and "BLENDER=path" in ended.stderr
