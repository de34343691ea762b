# SPDX-License-Identifier: GPL-3.0-or-later
"""From Blender's evaluated data to the native scene: reads, compares, edits by handle; decides nothing about light.

    sync = SceneSync(scene)                                # keeps what it has synced; one for each native scene
    with session.edit():
        report = sync.sync(depsgraph)                      # edits the tables; the caller commits
        view = sync_camera_final(engine, depsgraph)        # or sync_camera_view(depsgraph, region, rv3d, space)
        scene.set_camera(**view.camera)
        scene.commit()

All of it may be called only where Blender allows to read the depsgraph: in `update`, `render`, `view_update`, `view_draw`.
"""
from .camera import CameraView, sync_camera_final, sync_camera_view
from .scene import SceneSync, SyncReport

__all__ = ["CameraView", "SceneSync", "SyncReport", "sync_camera_final", "sync_camera_view"]
