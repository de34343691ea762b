# SPDX-License-Identifier: GPL-3.0-or-later
"""What all tests share: where the module, the scenes and the Blenders are. A test whose scene, Blender or network is
absent is skipped and says which; it never passes silently."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
PRESET = os.environ.get("AFTERGLOW_PRESET", "release")
LIBRARY = Path(os.environ.get("AFTERGLOW_LIBRARY") or ROOT / "build" / PRESET / "python")

# The distribution's Blender takes the first python3 on PATH for its own: not that of an active virtual environment.
os.environ["PATH"] = os.pathsep.join(["/usr/bin", os.environ.get("PATH", "")])

sys.path.insert(0, str(LIBRARY))
sys.path.insert(0, str(ROOT / "tools"))


def find_scenes() -> Path | None:
    folder = Path(os.environ.get("AFTERGLOW_SCENES") or ROOT.parent / "shared" / "scenes")
    return folder if folder.is_dir() else None


def pytest_report_header() -> list[str]:
    return [f"afterglow: module from {LIBRARY}; scenes from {find_scenes() or 'nowhere (tests that need them are skipped)'}"]


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    sanitizer = os.environ.get("AFTERGLOW_SANITIZER")
    for item in items:
        if sanitizer and item.get_closest_marker("timing"):
            item.add_marker(pytest.mark.skip(reason=f"{sanitizer} multiplies the times that this test holds"))


@pytest.fixture(scope="session")
def root() -> Path:
    """The project's folder."""
    return ROOT


@pytest.fixture(scope="session")
def library() -> Path:
    """The folder that holds the package `afterglow` with the module under test."""
    if not list((LIBRARY / "afterglow").glob("_native*.so")):
        pytest.fail(f"no module in {LIBRARY}: run `make build`")
    return LIBRARY


@pytest.fixture(scope="session")
def scenes() -> Path:
    """The folder of scenes made elsewhere (../shared/scenes, or what AFTERGLOW_SCENES names)."""
    folder = find_scenes()
    if folder is None:
        pytest.skip("no folder of scenes: set AFTERGLOW_SCENES")
    return folder


@pytest.fixture(scope="session")
def kitchen(scenes: Path) -> Path:
    path = scenes / "country_kitchen.blend"
    if not path.is_file():
        pytest.skip(f"{path} is absent")
    return path


@pytest.fixture(scope="session")
def blend_files() -> Path:
    """The small scenes that the repository brings along."""
    return ROOT / "blend_files"


Runner = Callable[..., "subprocess.CompletedProcess[str]"]


@pytest.fixture(scope="session")
def blender(library: Path) -> Runner:
    """blender(*arguments, check=True, timeout=300, env={}): runs build/blender (the add-on enabled) in the background and
    returns what it printed. `check` fails the test with the output's end when Blender ends badly."""
    wrapper = ROOT / "build" / "blender"
    if not wrapper.is_file():
        pytest.fail("build/blender is absent: run `make build`")

    def run(*arguments: str | Path, check: bool = True, timeout: float = 300.0,
            env: dict[str, str] | None = None) -> subprocess.CompletedProcess[str]:
        command = [str(wrapper), "-b", *map(str, arguments)]
        ended = run_captured(command, timeout, {"AFTERGLOW_LIBRARY": str(library)} | (env or {}))
        if check and ended.returncode:
            pytest.fail(f"Blender ended with {ended.returncode}:\n{ended.stdout[-6000:]}")
        return ended

    return run


@pytest.fixture(scope="session")
def blender_script(blender: Runner) -> Runner:
    """blender_script(script, *arguments, file=None): runs a Python file inside Blender; an exception there fails the test."""

    def run(script: str | Path, *arguments: str | Path, file: Path | None = None, **more: object
            ) -> subprocess.CompletedProcess[str]:
        return blender(*([file] if file else []), "--python-exit-code", "1", "--python", script, "--", *arguments, **more)

    return run


@pytest.fixture(scope="session")
def bpy_venv() -> Callable[[str], Path]:
    """bpy_venv("4.5"): the Python of a venv with the official Blender of that version as the module `bpy`, made under
    build/venvs when it is not there. Without network: skipped."""
    import venvs

    def python(version: str) -> Path:
        try:
            return venvs.ensure(version)
        except venvs.Unavailable as reason:
            pytest.skip(str(reason))

    return python


@pytest.fixture(scope="session")
def package() -> dict[str, Path]:
    """{"extension": zip, "legacy": zip}: what `make package` wrote, built here when older than the sources."""
    import package as packaging

    try:
        return packaging.ensure()
    except packaging.Unavailable as reason:
        pytest.skip(str(reason))


def run_captured(command: Sequence[str], timeout: float, env: dict[str, str]) -> subprocess.CompletedProcess[str]:
    return subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace",
                          timeout=timeout, env=os.environ | env)
