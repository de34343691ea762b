# SPDX-License-Identifier: GPL-3.0-or-later
"""The two zips of `make package`, installed as a user installs them: the extension in official Blenders (as the module
bpy), the legacy add-on in Debian's Blender. Cycles renders before and after in the same process, and its pixels must not
change: our Embree, TBB and OpenImageIO keep apart from Blender's."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

VERSIONS = os.environ.get("AFTERGLOW_OFFICIAL", "4.5 5.0").split()
INSIDE = Path(__file__).with_name("package_inside.py")


def expect(found: dict[str, Any]) -> None:
    assert found["cycles_unchanged"], "Cycles' picture changed after our module was loaded"
    assert found["finite"]
    assert found["distance"] == pytest.approx(5.0)
    assert found["samples"] == 64
    ours, cycles = found["mean"]
    assert ours == pytest.approx(cycles, rel=0.05), "far from Cycles' picture: noise at 64 samples is below 2 %"


def offline() -> list[str]:
    """What to put before a command so that it has no network at all; nothing where the system does not allow it."""
    alone = ["unshare", "--map-root-user", "--net"]
    possible = shutil.which(alone[0]) and subprocess.run([*alone, "true"], capture_output=True).returncode == 0
    return alone if possible else []


def ask(command: list[str], archive: Path, folder: Path, scene: Path, env: dict[str, str]) -> dict[str, Any]:
    answer = folder / "answer.json"
    arguments = [*command, "--", str(archive), str(scene), str(answer), str(folder)]
    environment = {name: value for name, value in os.environ.items()
                   if name not in ("AFTERGLOW_LIBRARY", "BLENDER_USER_SCRIPTS", "PYTHONPATH")} | env
    ended = subprocess.run(arguments, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace",
                           env=environment, timeout=600)
    assert answer.is_file(), f"ended with {ended.returncode}:\n{ended.stdout[-5000:]}"
    return json.loads(answer.read_text())


@pytest.mark.slow
@pytest.mark.parametrize("version", VERSIONS)
def test_extension_in_official_blender(version: str, package: dict[str, Path], bpy_venv: Callable[[str], Path],
                                       blend_files: Path, tmp_path: Path) -> None:
    found = ask([*offline(), str(bpy_venv(version)), str(INSIDE)], package["extension"], tmp_path,
                blend_files / "cornell_box.blend",
                {"BLENDER_USER_RESOURCES": str(tmp_path / "user")})
    expect(found)
    assert ".".join(map(str, found["blender"])).startswith(version)
    assert str(tmp_path) in found["module"], "the module is the wheel's, not one from elsewhere"


@pytest.mark.slow
def test_legacy_addon_in_debian_blender(package: dict[str, Path], blend_files: Path, tmp_path: Path) -> None:
    blender = os.environ.get("BLENDER", "blender")
    if shutil.which(blender) is None:
        pytest.skip("Debian's Blender is not installed")
    text = subprocess.run([blender, "--version"], capture_output=True, text=True).stdout
    if not re.match(r"Blender 3\.", text):
        pytest.skip(f"the legacy zip is for Blender 3.4, this is {text.splitlines()[0]}")
    found = ask([blender, "-b", "--factory-startup", "--python-exit-code", "1", "--python", str(INSIDE)], package["legacy"],
                tmp_path, blend_files / "cornell_box.blend",
                {"BLENDER_USER_CONFIG": str(tmp_path / "config"), "BLENDER_USER_SCRIPTS": str(tmp_path / "scripts")})
    expect(found)


@pytest.mark.slow
def test_extension_is_valid_and_says_what_it_holds(package: dict[str, Path], bpy_venv: Callable[[str], Path]) -> None:
    python = bpy_venv("5.0")
    tool = next(python.parent.parent.glob("lib/python*/site-packages/bpy/*/scripts/addons_core/bl_pkg/cli/blender_ext.py"))
    ended = subprocess.run([python, tool, "validate", package["extension"]], capture_output=True, text=True)
    assert ended.returncode == 0, ended.stdout + ended.stderr
    with zipfile.ZipFile(package["extension"]) as archive:
        names = archive.namelist()
        notices = archive.read("THIRD_PARTY_NOTICES.txt").decode()
        notice = archive.read("NOTICE.txt").decode()
        assert "GNU GENERAL PUBLIC LICENSE" in archive.read("LICENSE").decode()
    assert sum(name.endswith(".whl") for name in names) == 1
    assert not [name for name in names if "__pycache__" in name]
    for library in ("Embree", "oneTBB", "OpenImageIO", "OpenEXR", "libtiff", "libpng", "zlib", "libjxl", "Brotli", "FreeType",
                    "SampleICC", "pybind11", "GCC RUNTIME LIBRARY EXCEPTION", "GNU C Library", "Zig"):
        assert library in notices
    assert "symbols renamed" in notice and "section 6" in notice and "SHA-256" in notice
