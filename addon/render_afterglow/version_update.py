# SPDX-License-Identifier: GPL-3.0-or-later
"""Mends settings of .blend files that older versions of the add-on wrote, when Blender opens them.

`scene.afterglow.file_version` says which version of the settings a file holds; each step below raises it by one.
"""

import bpy
from bpy.app.handlers import persistent

CURRENT = 1


def mend(scene: bpy.types.Scene) -> None:
    """Brings one scene's settings to the current version; does nothing where they are current."""
    settings = scene.afterglow
    if settings.file_version >= CURRENT or scene.library is not None:
        return
    # 0 → 1: the first version that was published; nothing to mend.
    settings.file_version = CURRENT


@persistent
def mend_file(_path: object = None, *_rest: object) -> None:
    for scene in bpy.data.scenes:
        try:
            mend(scene)
        except AttributeError:  # A linked or override scene that may not be written.
            continue


def register() -> None:
    if mend_file not in bpy.app.handlers.load_post:
        bpy.app.handlers.load_post.append(mend_file)


def unregister() -> None:
    if mend_file in bpy.app.handlers.load_post:
        bpy.app.handlers.load_post.remove(mend_file)
