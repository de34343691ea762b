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


def render(output: Path, samples: int) -> None:
    """Inside Blender: renders the opened file and prints the figures of the render."""
    import bpy

    scene = bpy.context.scene
    scene.render.engine = "AFTERGLOW"
    scene.render.image_settings.file_format = "PNG"
    scene.render.image_settings.color_mode = "RGB"
    scene.render.filepath = str(output)
    if samples:
        scene.afterglow.samples = samples
    start = time.perf_counter()
    bpy.ops.render.render(write_still=True)
    seconds = time.perf_counter() - start

    from render_afterglow.library import afterglow

    figures = afterglow.statistics(scene)
    error, noise = figures.get("believed_error"), figures.get("noise")
    if isinstance(error, float):
        believed = f"{error:.2%} (estimated, relative)"
    else:
        believed = f"not known; noise {noise:.2%}, the method's bias aside" if isinstance(noise, float) else "not estimated"
    print("\n".join(("", f"picture    {output}", f"method     {figures.get('method', 'unknown')}",
          f"samples    {figures.get('samples', 'unknown')} per pixel", f"wall time  {seconds:.2f} s",
          f"error      {believed}")))
    for warning in figures.get("warnings", ()):
        print(f"warning    {warning}")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("file", type=Path)
    parser.add_argument("--samples", type=int, default=0, help="upper limit of samples; 0: what the file says")
    arguments = parser.parse_args()
    if not arguments.file.is_file():
        print(f"make demo: no file '{arguments.file}'", file=sys.stderr)
        return 2
    output = ROOT / "build" / "demo" / f"{arguments.file.stem}.png"
    output.parent.mkdir(parents=True, exist_ok=True)
    output.unlink(missing_ok=True)
    log = output.with_suffix(".log")
    command = [str(ROOT / "build" / "blender"), "-b", str(arguments.file.resolve()), "--python-exit-code", "1",
               "--python", __file__, "--", str(output), str(arguments.samples)]
    with log.open("w") as sink:
        ended = subprocess.run(command, stdout=sink, stderr=subprocess.STDOUT, env=os.environ | {"PYTHONUNBUFFERED": "1"})
    text = log.read_text(errors="replace")
    if ended.returncode or not output.is_file():
        print(text[-4000:], file=sys.stderr)
        print(f"make demo: Blender ended with {ended.returncode} and {'a' if output.is_file() else 'no'} picture; "
              f"its whole output is in {log}", file=sys.stderr)
        return 1
    at = text.rfind("\npicture ")
    lines = [line for line in text[at:].splitlines() if line[:11].strip() in
             ("picture", "method", "samples", "wall time", "error", "warning")]
    print("\n".join(lines))
    return 0


if __name__ == "__main__":
    if "--" in sys.argv and "bpy" in sys.modules:
        path, count = sys.argv[sys.argv.index("--") + 1:][:2]
        render(Path(path), int(count))
    else:
        sys.exit(main())
