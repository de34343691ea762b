# SPDX-License-Identifier: GPL-3.0-or-later
"""What the panels' buttons do."""

import bpy

from . import accuracy, cache, information, presets

_modules = (accuracy, cache, information, presets)


def register() -> None:
    for module in _modules:
        for operator in module.classes:
            bpy.utils.register_class(operator)


def unregister() -> None:
    accuracy.stop_all()
    for module in reversed(_modules):
        for operator in reversed(module.classes):
            bpy.utils.unregister_class(operator)
