# SPDX-License-Identifier: GPL-3.0-or-later
"""Panels: the engine's own, and Blender's standard ones made to appear for it."""

import bpy

from . import camera, light, material, object, render, standard, view_layer, world

_modules = (render, view_layer, camera, object, light, material, world)


def register() -> None:
    for module in _modules:
        for panel in module.classes:
            bpy.utils.register_class(panel)
    standard.register()


def unregister() -> None:
    standard.unregister()
    for module in reversed(_modules):
        for panel in reversed(module.classes):
            bpy.utils.unregister_class(panel)
