# SPDX-License-Identifier: GPL-3.0-or-later
"""Instructions of a diffuse Cornell box by the kernel that its Effects choose, over a kernel that holds nothing else, counted
by callgrind (tests/cpp/kernel_cost.cpp, bare_kernel.h). Both give the same picture to the last bit. Built for x86-64-v3,
since valgrind knows no AVX-512."""

from __future__ import annotations

import re
import shutil
import subprocess
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from ... import blenders
from ..figure import Context, Figure


def program() -> Path:
    root = blenders.project()
    build = root / "build" / "callgrind"
    python = [f"-DPython_EXECUTABLE={path}" for path in (Path("/usr/bin/python3"),) if path.exists()]
    for command in (["cmake", "-S", str(root), "-B", str(build), "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release",
                     "-DAFTERGLOW_ISA=x86-64-v3", *python], ["cmake", "--build", str(build), "--target", "kernel_cost"]):
        ended = subprocess.run(command, capture_output=True, text=True)
        if ended.returncode:
            raise RuntimeError(f"kernel_cost could not be built: {(ended.stdout + ended.stderr)[-800:]}")
    return build / "kernel_cost"


def instructions(binary: Path, kernel: str) -> tuple[int, str]:
    """Instructions inside of measured(), and what the program printed: the picture's sum and its rays."""
    with tempfile.TemporaryDirectory(prefix="afterglow_callgrind_") as folder:
        ended = subprocess.run(["valgrind", "--tool=callgrind", "--collect-atstart=no", "--toggle-collect=measured",
                                f"--callgrind-out-file={folder}/out", str(binary), kernel], capture_output=True, text=True)
    found = re.search(r"Collected : (\d+)", ended.stderr)
    if ended.returncode or found is None:
        raise RuntimeError(f"{binary} {kernel}: {(ended.stdout + ended.stderr)[-800:]}")
    return int(found[1]), ended.stdout.strip()


def measure(context: Context) -> list[Figure]:
    if shutil.which("valgrind") is None:
        raise blenders.Unavailable("valgrind is absent")
    binary = program()
    with ThreadPoolExecutor(2) as pool:  # counts, not times: they may run at once
        (chosen, one), (bare, two), (full, three) = pool.map(lambda kernel: instructions(binary, kernel),
                                                             ("chosen", "bare", "full"))
    figure = Figure("instructions of the chosen kernel", "diffuse Cornell box", chosen, "instructions",
                    "kernel of nothing else", bare, chosen / bare, "≤ 1.01",
                    details={"chosen": one, "bare": two, "full": three, "all_features": full}).judged()
    if one != two:
        figure.holds, figure.note = False, f"the pictures differ: {one}; {two}"
    return [figure]
