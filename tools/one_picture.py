# SPDX-License-Identifier: GPL-3.0-or-later
"""Inside any Blender, program or module bpy: renders the open (or named) file through the add-on of this source tree
into an EXR, and beside it, named …_cycles, what that Blender's Cycles makes of it by the same settings. Arguments after
`--`: the picture, and for bpy the .blend file; AFTERGLOW_LIBRARY says where the package is."""

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

scene.render.engine = "CYCLES"
scene.render.filepath = str(Path(arguments[0]).with_suffix("")) + "_cycles.exr"
theirs = scene.cycles
for name in ("samples", "seed", "max_bounces", "diffuse_bounces", "glossy_bounces", "transmission_bounces",
             "transparent_max_bounces", "sample_clamp_direct", "sample_clamp_indirect", "caustics_reflective",
             "caustics_refractive"):
    setattr(theirs, name, getattr(settings, name))
theirs.use_adaptive_sampling, theirs.use_denoising, theirs.blur_glossy = False, False, 0.0
bpy.ops.render.render(write_still=True)
