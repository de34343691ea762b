# SPDX-License-Identifier: GPL-3.0-or-later
"""What the panels' buttons do."""

import bpy

from . import information, presets

_modules = (information, presets)


def register() -> None:
    for module in _modules:
        for operator in module.classes:
            bpy.utils.register_class(operator)


def unregister() -> None:
    for module in reversed(_modules):
        for operator in reversed(module.classes):
            bpy.utils.unregister_class(operator)
