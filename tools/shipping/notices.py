# SPDX-License-Identifier: GPL-3.0-or-later
"""The notices that go into the zips: every library that a bundled binary holds, found by scanning the binary, with its
copyright, licence and exact source; what was changed in Embree (Apache-2.0, section 4b); where the source of every binary
is (GPL-3.0, section 6)."""

from __future__ import annotations

import functools
import re
import subprocess
import tarfile
import zipfile
from pathlib import Path

from . import contents, dependencies, downloads

LICENSES = Path(__file__).parent / "licenses"
RULE = "-" * 100


def write(package: Path, folder: Path) -> dict[str, bytes]:
    """{file name: text} to lay into wheel and zips; written to the folder, too."""
    texts = {"LICENSE": (downloads.ROOT / "LICENSE").read_bytes(), "NOTICE.txt": _notice().encode(),
             "THIRD_PARTY_NOTICES.txt": _third_party(package).encode()}
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in texts.items():
        (folder / name).write_bytes(text)
    return texts


def listed(library: Path) -> dict[str, str]:
    """What OpenImageIO's binary says it was built with and holds: {name: version}."""
    found = re.search(rb"[\w+-]+ [\w.]+;[\w+;. -]*?OpenColorIO [\w.]+;[\w+;. -]*", library.read_bytes())
    if not found:
        raise RuntimeError(f"{library.name} does not say what it holds")
    pairs = (entry.split(" ") for entry in found.group().decode().split(";") if entry)
    return {name: (rest[0] if rest else "") for name, *rest in pairs if rest != ["NONE"]}


def contained(library: Path) -> list[tuple[contents.Notice, str]]:
    """Every library inside OpenImageIO's, with its version. RuntimeError for one that the table does not know."""
    versions = {name: version for name, version in listed(library).items() if name not in contents.OUTSIDE}
    unknown = sorted(set(versions) - set(contents.CONTAINED))
    if unknown:
        raise RuntimeError(f"{library.name} holds {', '.join(unknown)}: tools/shipping/contents.py has no notice of it")
    data = library.read_bytes()
    for notice in contents.NESTED:
        if notice.marker and not re.search(notice.marker.encode(), data):
            raise RuntimeError(f"{library.name} no longer holds {notice.title}: mend tools/shipping/contents.py")
    return [(contents.CONTAINED[name], version) for name, version in sorted(versions.items(), key=lambda it: it[0].lower())]


def compilers(binary: Path) -> list[str]:
    """What the binary's section .comment says of the compilers and linkers that made it."""
    text = subprocess.run(["readelf", "-p", ".comment", str(binary)], check=True, capture_output=True, text=True).stdout
    return sorted(set(re.findall(r"\]\s+(.*\S)", text)))


def runtimes(package: Path) -> tuple[list[contents.Notice], list[str]]:
    """The notices of what compilers put into the binaries by themselves, and a line for each binary: who made it.
    RuntimeError for a compiler that the table does not know."""
    used, lines = set(), []
    for binary in [*sorted(package.glob("_native*.so")), *sorted((package / "libs").glob("*.so"))]:
        makers = compilers(binary)
        for maker in makers:
            known = [pattern for pattern in contents.RUNTIMES if re.match(pattern, maker)]
            if not known:
                raise RuntimeError(f"{binary.name} was made by '{maker}': "
                                   "tools/shipping/contents.py knows nothing of its runtime")
            used |= set(known)
        lines.append(f"  {binary.name.split('.')[0]}: {'; '.join(makers)}")
    return [notice for pattern, group in contents.RUNTIMES.items() if pattern in used for notice in group], lines


@functools.cache
def _recipes() -> dict[str, str]:
    """{name of a library: the commit that OpenImageIO's own recipe builds it from}."""
    inside, commits = re.compile(r"[^/]+/src/cmake/build_(.+)\.cmake"), {}
    with tarfile.open(downloads.fetch(downloads.OIIO_SOURCE)) as archive:
        for member in archive.getmembers():
            if named := inside.fullmatch(member.name):
                text = archive.extractfile(member).read().decode()
                if found := re.search(r"GIT_COMMIT\s+\"([0-9a-f]{40})\"", text):
                    commits[named.group(1)] = found.group(1)
    return commits


def _entry(notice: contents.Notice, version: str = "") -> str:
    lines = [f"{notice.title} {version}".strip(), *(f"  Copyright (c) {line}" for line in notice.copyrights)]
    commit = _recipes().get(notice.recipe, "")
    lines += [f"  Licence: {notice.licence} (text below)",
              f"  Source: {notice.source}" + (f", commit {commit}" if commit else "")]
    return "\n".join(lines)


def _third_party(package: Path) -> str:
    inside = contained(package / "libs" / dependencies.LIBRARIES["oiio"])
    brought, makers = runtimes(package)
    parts = ["Libraries inside Afterglow's package, their copyrights, licences and sources", RULE,
             "In the module, in libafterglow_embree4.so and in libafterglow_embree4_tbb.so", ""]
    parts += [_entry(notice) + "\n" for notice in contents.OURS]
    parts += [RULE, "In libafterglow_oiio.so and libafterglow_oiio_util.so", "",
              "OpenImageIO 3.2.2.0\n  Copyright (c) Contributors to the OpenImageIO project\n  Licence: apache_2_0 (text below), "
              "its own notices below\n  Source: " + downloads.OIIO.source.split(": ", 1)[1] + "\n"]
    parts += [_entry(notice, version) + "\n" for notice, version in inside]
    parts += [_entry(notice) + "\n" for notice in contents.NESTED]
    parts += [RULE, "In all of them, put there by the compilers and linkers that made them", "", *makers, ""]
    parts += [_entry(notice) + "\n" for notice in brought]
    notices = [*contents.OURS, *brought, *(notice for notice, _ in inside), *contents.NESTED]
    for licence in sorted({notice.licence for notice in notices} | {"apache_2_0"}):
        parts += [RULE, f"Licence {licence}", "", (LICENSES / f"{licence}.txt").read_text()]
    with zipfile.ZipFile(downloads.fetch(downloads.OIIO)) as wheel:
        for name in sorted(wheel.namelist()):
            if "/licenses/" in name:
                parts += [RULE, f"OpenImageIO's own {Path(name).name}", "", wheel.read(name).decode()]
    with zipfile.ZipFile(downloads.fetch(downloads.EMBREE)) as wheel:
        name = next(name for name in wheel.namelist() if name.endswith("/licenses/LICENSE"))
        parts += [RULE, "embreex's own licence", "", wheel.read(name).decode()]
    return "\n".join(parts)


def _notice() -> str:
    renamed = (dependencies.DEPS / "renamed.txt").read_text().split()
    rtc = [name for name in renamed if name.startswith("rtc")]
    return f"""Afterglow, a render engine for Blender
Copyright (c) 2026 The Afterglow authors
Licensed under the GNU General Public License, version 3 or later (file LICENSE).

Changes to bundled libraries (Apache License 2.0, section 4b)
  libafterglow_embree4.so is the library of Embree 4.4.0 with symbols renamed and nothing else changed: the {len(rtc)}
  functions rtc… that it offers and the {len(renamed) - len(rtc)} symbols of oneTBB that it uses have the prefix
  "{dependencies.PREFIX}", its name, search path and the name of the oneTBB that it asks for were set, and its debug symbols
  were removed. Blender carries its own Embree and TBB under the old names in the same process.
  libafterglow_embree4_tbb.so is oneTBB 2022.1.0, built from the source named below, with all its symbols renamed likewise.
  libafterglow_oiio.so and libafterglow_oiio_util.so are the libraries of OpenImageIO 3.2.2.0 with their names and search
  paths set and their debug symbols removed; nothing else was changed.

Sources of the bundled binaries (GNU GPL, version 3, section 6)
  afterglow/_native*.so: this project at the version in the zip's name; `make package` builds it.
  libafterglow_embree4.so: {downloads.EMBREE.source}
    The binary before the changes: {downloads.EMBREE.url}
    SHA-256 {downloads.EMBREE.sha256}
  libafterglow_embree4_tbb.so, and oneTBB inside _native*.so: {downloads.TBB_SOURCE.source}
    SHA-256 {downloads.TBB_SOURCE.sha256}; on Debian: apt-get source onetbb=2022.1.0-1
  libafterglow_oiio.so, libafterglow_oiio_util.so: {downloads.OIIO.source}
    SHA-256 {downloads.OIIO_SOURCE.sha256}
    The binary before the changes: {downloads.OIIO.url}
    SHA-256 {downloads.OIIO.sha256}
    The libraries inside it, with their exact commits: THIRD_PARTY_NOTICES.txt.
  The recipe of all changes: tools/shipping of this project.
"""
