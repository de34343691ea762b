# SPDX-License-Identifier: GPL-3.0-or-later
"""Panels: the engine's own, and Blender's standard ones made to appear for it."""

import bpy

from . import camera, light, material, object, render, standard, view3d, view_layer, world

_modules = (render, view_layer, camera, object, light, material, world, view3d)


def register() -> None:
    for module in _modules:
        for panel in module.classes:
            bpy.utils.register_class(panel)
    bpy.types.VIEW3D_HT_header.append(view3d.draw_pause)
    standard.register()


def unregister() -> None:
    standard.unregister()
    bpy.types.VIEW3D_HT_header.remove(view3d.draw_pause)
    for module in reversed(_modules):
        for panel in reversed(module.classes):
            bpy.utils.unregister_class(panel)
