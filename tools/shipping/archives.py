# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes the wheel, the extension and the legacy add-on. Times and orders inside are fixed: same sources, same bytes."""

from __future__ import annotations

import base64
import hashlib
import re
import zipfile
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path

from . import downloads

ROOT = downloads.ROOT
ADDON = ROOT / "addon" / "render_afterglow"
TAG = "cp311-cp311-manylinux_2_28_x86_64"


def version() -> str:
    return re.search(r"project\(afterglow VERSION ([\d.]+)", (ROOT / "CMakeLists.txt").read_text()).group(1)


def _zip(files: Mapping[str, bytes]) -> bytes:
    sink = BytesIO()
    with zipfile.ZipFile(sink, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for name in sorted(files):
            entry = zipfile.ZipInfo(name, (2026, 1, 1, 0, 0, 0))
            entry.compress_type = zipfile.ZIP_STORED if name.endswith(".whl") else zipfile.ZIP_DEFLATED
            entry.external_attr = (0o755 if name.endswith(".so") else 0o644) << 16
            archive.writestr(entry, files[name])
    return sink.getvalue()


def _tree(folder: Path, prefix: str = "") -> dict[str, bytes]:
    return {prefix + str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*"))
            if path.is_file() and "__pycache__" not in path.parts and not path.name.endswith(".pyc")}


def wheel(package: Path, texts: Mapping[str, bytes]) -> tuple[str, bytes]:
    """Name and bytes of the wheel (PEP 427) of the package in this folder, notices included."""
    info = f"afterglow-{version()}.dist-info"
    files = _tree(package, "afterglow/")
    files |= {f"{info}/licenses/{name}": text for name, text in texts.items()}
    files[f"{info}/METADATA"] = (
        f"Metadata-Version: 2.1\nName: afterglow\nVersion: {version()}\nSummary: Render engine that remembers light\n"
        "License: GPL-3.0-or-later\nRequires-Python: ==3.11.*\nRequires-Dist: numpy\n").encode()
    files[f"{info}/WHEEL"] = f"Wheel-Version: 1.0\nGenerator: afterglow\nRoot-Is-Purelib: false\nTag: {TAG}\n".encode()
    rows = []
    for name in sorted(files):
        digest = base64.urlsafe_b64encode(hashlib.sha256(files[name]).digest()).rstrip(b"=").decode()
        rows.append(f"{name},sha256={digest},{len(files[name])}")
    files[f"{info}/RECORD"] = ("\n".join([*rows, f"{info}/RECORD,,"]) + "\n").encode()
    return f"afterglow-{version()}-{TAG}.whl", _zip(files)


def _manifest(wheel_name: str) -> bytes:
    text = (ADDON / "blender_manifest.toml").read_text()
    found = re.search(r'^version = "(.+)"$', text, re.MULTILINE).group(1)
    if found != version():
        raise RuntimeError(f"blender_manifest.toml says version {found}, CMakeLists.txt {version()}")
    return text.replace("\n[permissions]", f'\nwheels = ["./wheels/{wheel_name}"]\n\n[permissions]').encode()


def write_extension(path: Path, package: Path, texts: Mapping[str, bytes]) -> None:
    name, data = wheel(package, texts)
    path.write_bytes(_zip(_tree(ADDON) | {"blender_manifest.toml": _manifest(name), f"wheels/{name}": data} | dict(texts)))


def write_legacy(path: Path, package: Path, texts: Mapping[str, bytes]) -> None:
    files = _tree(ADDON, "render_afterglow/") | _tree(package, "render_afterglow/lib/afterglow/")
    files.pop("render_afterglow/blender_manifest.toml")
    path.write_bytes(_zip(files | {f"render_afterglow/{name}": text for name, text in texts.items()}))
