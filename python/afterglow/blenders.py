# SPDX-License-Identifier: GPL-3.0-or-later
"""Blenders as workers: a process that stays open, renders on command, and can be asked what it took.

Debian's Blender runs through build/blender, official ones as the Python module `bpy` of a venv (tools/venvs.py) with the
packaged extension installed in a folder of its own, so that no user's settings are touched.
"""

from __future__ import annotations

import hashlib
import json
import os
import select
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

SCRIPT = Path(__file__).with_name("blender_server.py")


class Unavailable(Exception):
    """A Blender, a venv or a package that cannot be had here: the text says why."""


class WorkerError(RuntimeError):
    """A job failed, or the Blender ended."""


def project() -> Path:
    """The source tree: AFTERGLOW_ROOT, or the folder above this file or the working one that holds blend_files."""
    named = os.environ.get("AFTERGLOW_ROOT")
    places = [Path(named)] if named else [*Path(__file__).resolve().parents, Path.cwd(), *Path.cwd().parents]
    for place in places:
        if (place / "blend_files").is_dir() and (place / "CMakeLists.txt").is_file():
            return place
    raise Unavailable("the source tree is not found: run this inside it, or name it in AFTERGLOW_ROOT")


def shared() -> Path:
    """Scenes and tools made elsewhere: AFTERGLOW_SHARED, or ../shared from the source tree."""
    named = os.environ.get("AFTERGLOW_SHARED")
    folder = Path(named) if named else project().parent / "shared"
    if not folder.is_dir():
        raise Unavailable(f"{folder} is absent: name the folder of shared scenes and tools in AFTERGLOW_SHARED")
    return folder


def shared_scenes() -> Path:
    """AFTERGLOW_SCENES, as for the tests, or the scenes in shared()."""
    named = os.environ.get("AFTERGLOW_SCENES")
    return Path(named) if named else shared() / "scenes"


def shared_tool(name: str) -> Path:
    tool = shared() / "tools" / name
    if not tool.is_file():
        raise Unavailable(f"{tool} is absent")
    return tool


def debian() -> list[str]:
    """The command of the distribution's Blender with the add-on: AFTERGLOW_BLENDER or build/blender."""
    named = os.environ.get("AFTERGLOW_BLENDER")
    wrapper = Path(named) if named else project() / "build" / "blender"
    if not wrapper.is_file():
        raise Unavailable(f"{wrapper} is absent: run `make build`")
    return [str(wrapper)]


def _tools(name: str) -> Any:
    import importlib

    folder = str(project() / "tools")
    if folder not in sys.path:
        sys.path.insert(0, folder)
    return importlib.import_module(name)


def official(version: str) -> Path:
    """The Python of a venv with the official Blender of that version; made when it is not there."""
    venvs = _tools("venvs")
    try:
        return Path(venvs.ensure(version))
    except venvs.Unavailable as reason:
        raise Unavailable(str(reason)) from reason


def resources(version: str) -> Path:
    """A BLENDER_USER_RESOURCES folder in which the packaged extension is installed for that version."""
    packaging = _tools("package")
    try:
        extension = Path(packaging.ensure()["extension"])
    except packaging.Unavailable as reason:
        raise Unavailable(str(reason)) from reason
    digest = hashlib.sha256(extension.read_bytes()).hexdigest()[:16]
    folder = project() / "build" / "bench" / f"resources_{version}_{digest}"
    if (folder / ".complete").is_file():
        return folder
    folder.mkdir(parents=True, exist_ok=True)
    code = (f"import bpy; bpy.ops.extensions.package_install_files(filepath={str(extension)!r}, repo='user_default', "
            "enable_on_install=True)")
    ended = subprocess.run([str(official(version)), "-c", code], capture_output=True, text=True,
                           env=dict(os.environ, BLENDER_USER_RESOURCES=str(folder)))
    if ended.returncode:
        raise Unavailable(f"the extension could not be installed in Blender {version}: {(ended.stdout + ended.stderr)[-600:]}")
    (folder / ".complete").touch()
    return folder


class Worker:
    """One Blender process. Every job is a call; a failing one raises WorkerError with Blender's last words."""

    def __init__(self, command: Sequence[str], environment: Mapping[str, str] | None = None) -> None:
        self.folder = tempfile.TemporaryDirectory(prefix="afterglow_")
        self.log = Path(self.folder.name) / "log"
        reader, writer = os.pipe()
        # The caller's PYTHONPATH names the module built for its own Python: a Blender takes the one made for it.
        inherited = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
        with self.log.open("w") as sink:
            self.process = subprocess.Popen(
                [*command, "--", str(writer), self.folder.name], stdin=subprocess.PIPE, stdout=sink, stderr=subprocess.STDOUT,
                text=True, pass_fds=[writer], env={**inherited, "PYTHONUNBUFFERED": "1", **(environment or {})})
        os.close(writer)
        self.answers = os.fdopen(reader)
        hello = self._answer()
        self.version: str = hello["version"]
        self.problem: str = hello["problem"]
        self.module: str = hello["module"]  # file of the native module that the add-on loaded; "" without the add-on

    @classmethod
    def of_debian(cls, *arguments: str) -> Worker:
        return cls([*debian(), "-b", *arguments, "--python-exit-code", "1", "--python", str(SCRIPT)])

    @classmethod
    def of_official(cls, version: str = "5.0", addon: bool = True) -> Worker:
        """Of the packaged extension, whatever AFTERGLOW_LIBRARY names for the distribution's Blender."""
        environment = {"BLENDER_USER_RESOURCES": str(resources(version))} if addon else {}
        return cls([str(official(version)), str(SCRIPT)], {"AFTERGLOW_LIBRARY": "", **environment})

    def _answer(self, timeout: float | None = None) -> dict[str, Any]:
        if timeout is not None and not select.select([self.answers], [], [], timeout)[0]:
            self.process.kill()
            raise WorkerError(f"Blender was ended: no answer within {timeout:g} s")
        line = self.answers.readline()
        if not line:
            words = self.log.read_text(errors="replace")[-2500:] if self.log.is_file() else ""
            raise WorkerError(f"Blender ended without an answer; its last words:\n{words}")
        result = json.loads(line)
        if "error" in result:
            raise WorkerError(result["error"])
        return result

    def job(self, op: str, *, timeout: float | None = None, **values: Any) -> dict[str, Any]:
        assert self.process.stdin is not None
        try:
            self.process.stdin.write(json.dumps({"op": op, **values}) + "\n")
            self.process.stdin.flush()
        except BrokenPipeError:
            pass  # the answer that is missing says more
        return self._answer(timeout)

    def printed(self, since: int = 0) -> str:
        """What Blender printed, from a length on that an earlier call gave."""
        return self.log.read_bytes()[since:].decode(errors="replace")

    def open(self, file: str | Path, percent: float = 100) -> dict[str, Any]:
        """Resolution, frame and the settings that the file has."""
        return self.job("open", file=str(Path(file).resolve()), percent=percent)

    def render(self, engine: str = "AFTERGLOW", *, as_references: bool = True, multilayer: bool = False, out: str | None = None,
               persistent: bool = False, **settings: Any) -> dict[str, Any]:
        """{"image": path, "seconds": of the whole render from the opened file, "statistics", "stages": [(second, what the
        engine said of itself), …]}. persistent: what was read and what methods remember stays for the next render."""
        return self.job("render", engine=engine, as_references=as_references, multilayer=multilayer, out=out,
                        persistent=persistent, settings=settings)

    def frames(self, engine: str, numbers: Sequence[int], *, as_references: bool = True, **settings: Any) -> dict[str, Any]:
        """Frames in order with persistent data: {"images", "seconds" of each, "statistics" of the last}."""
        return self.job("frames", engine=engine, frames=list(numbers), as_references=as_references, persistent=True,
                        settings=settings)

    def close(self) -> None:
        if self.process.poll() is None and self.process.stdin is not None:
            self.process.stdin.close()
            try:
                self.process.wait(20)
            except subprocess.TimeoutExpired:
                self.process.kill()
                self.process.wait()
        self.answers.close()
        self.folder.cleanup()

    def __enter__(self) -> Worker:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
