# SPDX-License-Identifier: GPL-3.0-or-later
"""Inside any Blender, program or module bpy: renders the open (or named) file through the add-on of this source tree into an
EXR. Arguments after `--`: the picture, and for bpy the .blend file; AFTERGLOW_LIBRARY says where the package is."""

import sys
from pathlib import Path

import bpy

arguments = sys.argv[sys.argv.index("--") + 1:]
if len(arguments) > 1:  # the module bpy: nobody enabled the add-on yet
    sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "build" / "scripts" / "addons"))
    import addon_utils

    addon_utils.enable("render_afterglow", default_set=False, persistent=True)
    bpy.ops.wm.open_mainfile(filepath=arguments[1])
scene = bpy.context.scene
scene.render.engine = "AFTERGLOW"
scene.render.resolution_x = scene.render.resolution_y = 128
scene.render.resolution_percentage = 100
scene.render.use_compositing = scene.render.use_sequencer = False
scene.render.image_settings.file_format = "OPEN_EXR"
scene.render.image_settings.color_depth = "32"
scene.render.filepath = arguments[0]
settings = scene.afterglow
settings.samples, settings.accuracy, settings.seed, settings.denoise = 256, 0.0, 1, False
bpy.ops.render.render(write_still=True)
