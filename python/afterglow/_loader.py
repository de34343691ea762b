# SPDX-License-Identifier: GPL-3.0-or-later
"""Loads the native module, or says in one sentence why it cannot be loaded and what to do.

A module built for instructions that the processor lacks would end the process without a word, so the processor is asked
first: the build writes the instruction set it used into `_build.py`.
"""

from __future__ import annotations

import importlib
import os
from types import ModuleType

# The flags of /proc/cpuinfo that the levels of the x86-64 psABI ask for beyond the one before.
_LEVELS = {
    "x86-64-v2": {"cx16", "lahf_lm", "popcnt", "sse4_1", "sse4_2", "ssse3"},
    "x86-64-v3": {"avx", "avx2", "bmi1", "bmi2", "f16c", "fma", "movbe", "xsave"},
    "x86-64-v4": {"avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl"},
}


def missing_instructions(isa: str, flags: set[str]) -> list[str]:
    """What a processor with these flags lacks for a level "x86-64-v…"; nothing for other names."""
    if isa not in _LEVELS:
        return []
    wanted: set[str] = set()
    for level, names in _LEVELS.items():
        wanted |= names
        if level == isa:
            break
    return sorted(wanted - flags)


def processor_flags() -> set[str] | None:
    """The processor's flags as Linux names them; None where it does not say."""
    try:
        with open("/proc/cpuinfo") as file:
            for line in file:
                if line.startswith("flags"):
                    return set(line.split(":", 1)[1].split())
    except OSError:
        pass
    return None


def load() -> tuple[ModuleType | None, str]:
    """The module and "", or None and the reason where AFTERGLOW_WITHOUT_MODULE allows it, else an ImportError."""
    problem = ""
    try:
        isa = importlib.import_module("afterglow._build").ISA
    except ImportError:
        isa = ""
    flags = processor_flags()
    lacking = missing_instructions(isa, flags) if flags is not None else []
    if lacking:
        problem = (f"This build of Afterglow needs a processor of the level {isa} (2013 or later); yours lacks "
                   f"{', '.join(lacking)}. Build it from source on this machine: make build")
    else:
        try:
            return importlib.import_module("afterglow._native"), ""
        except ModuleNotFoundError as error:
            if error.name != "afterglow._native":
                raise
            problem = ("Afterglow's native module _native is not beside its Python package: build it (make build) and use "
                       "build/release/python, or install the package made for this Python")
        except ImportError as error:
            problem = f"Afterglow's native module cannot be loaded here: {error}"
    if os.environ.get("AFTERGLOW_WITHOUT_MODULE") == "1":
        return None, problem
    raise ImportError(problem)
