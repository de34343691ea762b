# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds the two zips that users install, under build/package: `make package` calls it.

afterglow-<version>-linux-x64.zip is an extension for Blender's own builds of 4.2 LTS to 5.0; it works offline, its module
inside as a self-contained wheel. afterglow-legacy-<version>.zip is an add-on of the old kind for Debian's Blender 3.4.1,
with the same module in its folder `lib`. tools/shipping tells how the module is made."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

from shipping import archives, dependencies, downloads, module, notices

ROOT = downloads.ROOT
OUTPUT = ROOT / "build" / "package"
Unavailable = downloads.Unavailable


def ensure() -> dict[str, Path]:
    """{"extension": zip, "legacy": zip, "library": folder with the packaged module}, built when a source changed since.

    Raises Unavailable where something cannot be had: no network, or not the Python that Blender has."""
    if sys.version_info[:2] != (3, 11):
        raise Unavailable(f"official Blender has Python 3.11, this is {sys.version.split()[0]}: package on Debian 12")
    version = archives.version()
    made = {"extension": OUTPUT / f"afterglow-{version}-linux-x64.zip", "legacy": OUTPUT / f"afterglow-legacy-{version}.zip",
            "library": module.LIBRARY}
    stamp = OUTPUT / ".sources"
    key = _sources()
    if stamp.is_file() and stamp.read_text() == key and all(path.exists() for path in made.values()):
        return made
    OUTPUT.mkdir(parents=True, exist_ok=True)
    stamp.unlink(missing_ok=True)
    dependencies.prepare()
    package = module.build()
    texts = notices.write(package, module.WORK / "notices")
    archives.write_extension(made["extension"], package, texts)
    archives.write_legacy(made["legacy"], package, texts)
    stamp.write_text(key)
    return made


def _sources() -> str:
    """One hash over every file that goes into the zips."""
    folders = ("native", "python", "addon", "cmake", "tools/shipping")
    files = [ROOT / "CMakeLists.txt", ROOT / "LICENSE", Path(__file__)]
    for folder in folders:
        files += [Path(top) / name for top, _, names in os.walk(ROOT / folder) for name in names
                  if not name.endswith(".pyc") and "__pycache__" not in top]
    digest = hashlib.sha256()
    for path in sorted(files):
        digest.update(str(path.relative_to(ROOT)).encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()


def main() -> int:
    try:
        made = ensure()
    except (Unavailable, subprocess.CalledProcessError, RuntimeError) as error:
        print(f"make package: {error}", file=sys.stderr)
        return 1
    for name in ("extension", "legacy"):
        print(f"{made[name]}  {made[name].stat().st_size / 1e6:.1f} MB")
    return 0


if __name__ == "__main__":
    sys.exit(main())
