# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings that Blender saves: `scene.afterglow`. Names are Cycles' own where Cycles has the same setting."""

import bpy

from . import methods, scene


def register() -> None:
    methods.register()
    scene.register()
    bpy.types.Scene.afterglow = bpy.props.PointerProperty(
        type=scene.AfterglowSceneSettings, name="Afterglow", description="Settings of the Afterglow render engine"
    )


def unregister() -> None:
    del bpy.types.Scene.afterglow
    scene.unregister()
    methods.unregister()
