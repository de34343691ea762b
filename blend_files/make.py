# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes the .blend files that stand beside it, from the procedural scenes of `afterglow.scenes`.

blender -b --factory-startup --python-exit-code 1 --python blend_files/make.py [-- NAME …]

Written by Blender 3.4 so that every later version opens them; compressed and without user interface.
"""

import os
import pathlib
import sys
from collections.abc import Callable

import bpy

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "python"))
os.environ["AFTERGLOW_WITHOUT_MODULE"] = "1"

from afterglow import scenes  # noqa: E402
from afterglow.scenes import blender  # noqa: E402


def further(made: "dict[str, Callable[..., scenes.Description]]") -> None:
    """Each into a scene of its own; meshes of one name are one."""
    for name, make in made.items():
        description = make()
        description.name = name
        with bpy.context.temp_override(scene=bpy.data.scenes.new(name)):
            blender.write(description)
    for mesh in [mesh for mesh in bpy.data.meshes if mesh.name[:-4] in bpy.data.meshes]:
        mesh.user_remap(bpy.data.meshes[mesh.name[:-4]])
        bpy.data.meshes.remove(mesh)


def main(names: list[str]) -> None:
    for name in names or list(scenes.BLEND_FILES):
        bpy.ops.wm.read_factory_settings(use_empty=True)
        blender.write(scenes.BLEND_FILES[name]())
        further(scenes.FURTHER_SCENES.get(name, {}))
        path = HERE / f"{name}.blend"
        bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=True)
        path.with_suffix(".blend1").unlink(missing_ok=True)
        print(f"WROTE {path.name} {path.stat().st_size / 1024:.0f} KB")


main(sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else [])
