# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes the .blend files that stand beside it, from the procedural scenes of `afterglow.scenes`.

blender -b --factory-startup --python-exit-code 1 --python blend_files/make.py [-- NAME …]

Written by Blender 3.4 so that every later version opens them; compressed and without user interface.
"""

import os
import pathlib
import sys

import bpy

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "python"))
os.environ["AFTERGLOW_WITHOUT_MODULE"] = "1"

from afterglow import scenes  # noqa: E402
from afterglow.scenes import blender  # noqa: E402


def main(names: list[str]) -> None:
    for name in names or list(scenes.BLEND_FILES):
        bpy.ops.wm.read_factory_settings(use_empty=True)
        blender.write(scenes.BLEND_FILES[name]())
        path = HERE / f"{name}.blend"
        bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=True)
        path.with_suffix(".blend1").unlink(missing_ok=True)
        print(f"WROTE {path.name} {path.stat().st_size / 1024:.0f} KB")


main(sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else [])
