# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs inside Blender: renders the open file again and again with settings that come in as lines of JSON.

blender -b FILE --python blender_server.py -- FOLDER PERCENT. Answers are lines that begin with AFTERGLOW_ANSWER. Started by
`afterglow.accuracy`; needs the add-on enabled. A key that scene.afterglow has not is ignored but "error" names it.
"""

import json
import os
import sys
import time

import bpy


def answer(values: dict) -> None:
    print("AFTERGLOW_ANSWER " + json.dumps(values), flush=True)


def settings_of(scene: "bpy.types.Scene") -> dict:
    own = scene.afterglow
    names = ("method", "samples", "accuracy", "time_limit", "denoise")
    return {name: getattr(own, name) for name in names if hasattr(own, name)}


def render(scene: "bpy.types.Scene", folder: str, number: int, settings: dict) -> dict:
    own = scene.afterglow
    for name, value in settings.items():
        if not hasattr(own, name):
            raise AttributeError(f"the add-on has no setting {name!r}")
        setattr(own, name, value)
    path = os.path.join(folder, f"image_{number}.exr")
    scene.render.filepath = path
    start = time.perf_counter()
    bpy.ops.render.render(write_still=True)
    seconds = time.perf_counter() - start
    statistics = {}
    try:
        import afterglow

        statistics = afterglow.statistics(scene) or {}
    except ImportError:
        pass
    return {"image": path, "seconds": seconds, "statistics": statistics}


def main() -> None:
    folder, percent = sys.argv[sys.argv.index("--") + 1 :][:2]
    scene = bpy.context.scene
    if not hasattr(scene, "afterglow"):
        answer({"error": "the add-on is not enabled in this Blender: start it through build/blender"})
        return
    in_use = settings_of(scene)
    scene.render.engine = "AFTERGLOW"
    scene.render.resolution_percentage = int(percent) * scene.render.resolution_percentage // 100
    scene.render.use_border = scene.render.use_compositing = scene.render.use_sequencer = False
    image = scene.render.image_settings
    if hasattr(image, "media_type"):
        image.media_type = "IMAGE"
    image.file_format, image.color_depth, image.color_mode = "OPEN_EXR", "32", "RGB"
    share = scene.render.resolution_percentage / 100
    size = [int(scene.render.resolution_x * share), int(scene.render.resolution_y * share)]
    if hasattr(scene.afterglow, "time_limit"):
        scene.afterglow.time_limit = 0
    if hasattr(scene.afterglow, "denoise"):
        scene.afterglow.denoise = False
    answer({"resolution": size, "frame": scene.frame_current, "settings": in_use})
    denoise = False
    for number, line in enumerate(sys.stdin):
        try:
            settings = {"denoise": denoise, **json.loads(line)}
            answer(render(scene, folder, number, settings))
        except Exception as error:
            answer({"error": f"{type(error).__name__}: {error}"})


main()
