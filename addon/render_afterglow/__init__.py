# SPDX-License-Identifier: GPL-3.0-or-later
"""Afterglow's add-on: registers the render engine, its settings, panels and operators in Blender 3.4 to 5.2.

It is a legacy add-on (`bl_info`) and an extension (`blender_manifest.toml`) at once, so every import in it is relative.
Import ranks: `sync`, `properties` < `operators` < `engine` < `ui`; nothing imports upwards.
"""

bl_info = {
    "name": "Afterglow",
    "author": "The Afterglow authors",
    "version": (0, 1, 0),
    "blender": (3, 4, 0),
    "location": "Render Properties > Render Engine > Afterglow",
    "description": "Render engine that remembers light",
    "doc_url": "",
    "category": "Render",
}

if (
    "bpy" in locals()
):  # Reloaded by "Reload Scripts": forget the modules of before, so that the next import reads them anew.
    import sys

    for _name in [name for name in sys.modules if name.startswith(__package__ + ".") and not name.endswith(".library")]:
        del sys.modules[_name]

import bpy  # noqa: E402,F401


def register() -> None:
    from . import engine, operators, properties, ui, version_update

    properties.register()
    operators.register()
    engine.register()
    ui.register()
    version_update.register()


def unregister() -> None:
    from . import engine, operators, properties, ui, version_update

    version_update.unregister()
    ui.unregister()
    engine.unregister()
    operators.unregister()
    properties.unregister()
