# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders one .blend file in Blender through Afterglow and says what it cost: `make demo` calls it.

Blender runs in the background with the add-on enabled by build/blender; this file is both the caller and, inside Blender,
the script that renders. The picture lands in build/demo/<name>.png."""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def render(output: Path, samples: int, seconds: float) -> None:
    """Inside Blender: renders the opened file, for `seconds` at most (0: any time), and prints the figures of the render."""
    import bpy

    scene = bpy.context.scene
    scene.render.engine = "AFTERGLOW"
    scene.render.image_settings.file_format = "PNG"
    scene.render.image_settings.color_mode = "RGB"
    scene.render.filepath = str(output)
    if samples:
        scene.afterglow.samples = samples
    if seconds and not scene.afterglow.time_limit:
        scene.afterglow.time_limit = seconds
    start = time.perf_counter()
    bpy.ops.render.render(write_still=True)
    took = time.perf_counter() - start

    from render_afterglow.library import afterglow

    figures = afterglow.statistics(scene)
    error, noise = figures.get("believed_error"), figures.get("noise")
    if isinstance(error, float):
        believed = f"{error:.2%} (estimated, relative)"
    else:
        believed = f"not known; noise {noise:.2%}, the method's bias aside" if isinstance(noise, float) else "not estimated"
    print("\n".join(("", f"picture    {output}", f"method     {figures.get('method', 'unknown')}",
          f"samples    {figures.get('samples', 'unknown')} per pixel", f"wall time  {took:.2f} s",
          f"error      {believed}")))
    if seconds and took >= seconds:
        print(f"note       ended after {seconds:g} s; make demo SECONDS=0 goes on to the file's accuracy")
    for warning in figures.get("warnings", ()):
        print(f"warning    {warning}")


def run(command: list[str], log: Path) -> int:
    """Runs Blender, what it prints goes to the log; how far it is, to the terminal. Its exit code."""
    environment = os.environ | {"PYTHONUNBUFFERED": "1"}
    shown = 0.0
    pause, end = (0.2, "\r") if sys.stdout.isatty() else (10.0, "\n")
    with log.open("w") as sink, subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                                                 errors="replace", env=environment) as blender:
        assert blender.stdout is not None
        for line in blender.stdout:
            sink.write(line)
            if line.startswith("Fra:") and "remaining" in line and time.monotonic() > shown + pause:
                shown = time.monotonic()
                print(f"{' | '.join(part.strip() for part in line.split('|')[2:]):78}", end=end, flush=True)
        if shown and end == "\r":
            print(" " * 78, end=end)
        return blender.wait()


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("file", type=Path)
    parser.add_argument("--samples", type=int, default=0, help="upper limit of samples; 0: what the file says")
    parser.add_argument("--seconds", type=float, default=300.0, help="the render ends then with what it has; 0: any time")
    arguments = parser.parse_args()
    if not arguments.file.is_file():
        print(f"make demo: no file '{arguments.file}'", file=sys.stderr)
        return 2
    output = ROOT / "build" / "demo" / f"{arguments.file.stem}.png"
    output.parent.mkdir(parents=True, exist_ok=True)
    output.unlink(missing_ok=True)
    log = output.with_suffix(".log")
    command = [str(ROOT / "build" / "blender"), "-b", str(arguments.file.resolve()), "--python-exit-code", "1",
               "--python", __file__, "--", str(output), str(arguments.samples), str(arguments.seconds)]
    code = run(command, log)
    text = log.read_text(errors="replace")
    if code or not output.is_file():
        print(text[-4000:], file=sys.stderr)
        print(f"make demo: Blender ended with {code} and {'a' if output.is_file() else 'no'} picture; "
              f"its whole output is in {log}", file=sys.stderr)
        return 1
    at = text.rfind("\npicture ")
    lines = [line for line in text[at:].splitlines() if line[:11].strip() in
             ("picture", "method", "samples", "wall time", "error", "note", "warning")]
    print("\n".join(lines))
    return 0


if __name__ == "__main__":
    if "--" in sys.argv and "bpy" in sys.modules:
        path, count, limit = sys.argv[sys.argv.index("--") + 1:][:3]
        render(Path(path), int(count), float(limit))
    else:
        sys.exit(main())
