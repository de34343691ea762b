# SPDX-License-Identifier: GPL-3.0-or-later
"""Inside Blender: every file named after -- is opened and synced; a second sync of the same must change nothing."""
import os
import sys
import time

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import bpy
from recording_scene import RecordingScene
from sync_tools import finish, load_sync

sync = load_sync()
files = sys.argv[sys.argv.index("--") + 1:]


def run():
    results = {}
    for path in files:
        try:
            bpy.ops.wm.open_mainfile(filepath=path, load_ui=False)
        except RuntimeError as error:  # a file of a later Blender
            results[os.path.basename(path)] = {"skipped": str(error)}
            continue
        depsgraph = bpy.context.evaluated_depsgraph_get()
        depsgraph.update()
        scene = RecordingScene()
        keeper = sync.SceneSync(scene)
        start = time.perf_counter()
        report = keeper.sync(depsgraph)
        seconds = time.perf_counter() - start
        view = sync.sync_camera_final(None, depsgraph)
        if view is not None:
            scene.set_camera(**view.camera)
        before = scene.content()
        again = keeper.sync(depsgraph, full=True)
        assert scene.content() == before, path
        results[os.path.basename(path)] = {
            "seconds": seconds, "warnings": report.warnings, "meshes": len(scene.meshes), "instances": len(scene.instances),
            "lights": len(scene.lights), "materials": len(scene.materials), "images": len(scene.images),
            "camera": view is not None, "again": [again.materials, again.images, again.lights, again.world, again.moved]}
    return results


finish(run)
