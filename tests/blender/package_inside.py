# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs inside a Blender: installs a zip as a user does, renders with Cycles, with Afterglow and with Cycles again, and writes
what it found as JSON. Arguments after `--`: the zip, the .blend file, the JSON file, a folder for pictures."""

import json
import sys
from pathlib import Path

import bpy
import numpy as np

archive, scene_file, answer, pictures = map(Path, sys.argv[sys.argv.index("--") + 1:][:4])


def install() -> str:
    if bpy.app.version >= (4, 2, 0):
        bpy.ops.extensions.package_install_files(filepath=str(archive), repo="user_default", enable_on_install=True)
        import addon_utils

        name = "bl_ext.user_default.afterglow"
        addon_utils.enable(name)
        return name
    bpy.ops.preferences.addon_install(filepath=str(archive))
    bpy.ops.preferences.addon_enable(module="render_afterglow")
    return "render_afterglow"


def pixels(engine: str, name: str, samples: int) -> np.ndarray:
    """Renders the open scene and returns its picture (height, width, 4), scene-linear, row 0 at the bottom."""
    scene = bpy.context.scene
    scene.render.engine = engine
    scene.render.resolution_x = scene.render.resolution_y = 96
    scene.render.resolution_percentage = 100
    scene.render.use_compositing = scene.render.use_sequencer = False
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    scene.render.filepath = str(pictures / f"{name}.exr")
    if engine == "CYCLES":
        scene.cycles.samples = samples
        scene.cycles.use_denoising = False
        scene.cycles.use_adaptive_sampling = False
    else:
        scene.afterglow.samples = samples
        scene.afterglow.accuracy = 0.0
        scene.afterglow.denoise = False
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath)
    image.colorspace_settings.name = "Non-Color"
    values = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(values)
    size = tuple(image.size)
    bpy.data.images.remove(image)
    return values.reshape(size[1], size[0], 4)


if hasattr(bpy.context.preferences.view, "show_splash"):
    bpy.context.preferences.view.show_splash = False
bpy.ops.wm.open_mainfile(filepath=str(scene_file))
before = pixels("CYCLES", "cycles_before", 4)
addon = install()
import afterglow  # noqa: E402

bpy.ops.wm.open_mainfile(filepath=str(scene_file))
ours = pixels("AFTERGLOW", "afterglow", 64)
statistics = afterglow.statistics(bpy.context.scene)
reference = pixels("CYCLES", "cycles_reference", 64)
after = pixels("CYCLES", "cycles_after", 4)

scene = afterglow.Scene()
mesh = scene.add_mesh(name="triangle", positions=np.array([[0, 0, 5], [1, 0, 5], [0, 1, 5]], np.float32),
                      triangles=np.array([[0, 1, 2]], np.int32))
scene.add_instances(mesh, np.eye(4)[None], name="triangle")
scene.commit()
hit = scene.intersect(np.array([[0.2, 0.2, 0.0]]), np.array([[0.0, 0.0, 1.0]]))

answer.write_text(json.dumps({
    "blender": list(bpy.app.version), "addon": addon, "module": afterglow.__file__, "versions": dict(afterglow.versions()),
    "cycles_unchanged": bool(np.array_equal(before, after)), "finite": bool(np.isfinite(ours).all()),
    "mean": [float(ours[..., :3].mean()), float(reference[..., :3].mean())],
    "distance": float(np.asarray(hit["distance"])[0]), "samples": statistics.get("samples"),
    "method": statistics.get("method"), "warnings": list(statistics.get("warnings", ()))}))
