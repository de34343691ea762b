# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes Blender's standard panels appear for the engine.

Blender's own panels name the engines that they belong to (COMPAT_ENGINES). Those for any renderer name BLENDER_RENDER;
the ones listed below belong to settings that Afterglow shows in panels of its own, or does not have.
"""

import bpy

# Panels whose settings stand in Afterglow's own panels, or which only other engines heed.
REPLACED = {
    "DATA_PT_camera_dof", "DATA_PT_camera_dof_aperture", "DATA_PT_light", "DATA_PT_preview", "DATA_PT_spot", "DATA_PT_area",
    "DATA_PT_falloff_curve", "MATERIAL_PT_preview", "MATERIAL_PT_context_material", "NODE_DATA_PT_light", "NODE_DATA_PT_spot",
    "OBJECT_PT_visibility", "VIEWLAYER_PT_filter", "VIEWLAYER_PT_layer_passes", "RENDER_PT_simplify", "WORLD_PT_preview",
}
# Panels that do not name BLENDER_RENDER although what they show counts for any renderer.
ALSO = {"RENDER_PT_color_management", "RENDER_PT_color_management_curves", "RENDER_PT_color_management_working_space"}

_added: set[str] = set()


def standard_panels() -> list[type]:
    """Every panel of Blender's own that the engine should have."""
    found = []
    for panel in bpy.types.Panel.__subclasses__():
        engines = getattr(panel, "COMPAT_ENGINES", None)
        if engines is None or panel.__name__ in REPLACED or not isinstance(engines, set):
            continue
        if "BLENDER_RENDER" in engines or panel.__name__ in ALSO:
            found.append(panel)
    return found


def register() -> None:
    for panel in standard_panels():
        if "AFTERGLOW" not in panel.COMPAT_ENGINES:
            panel.COMPAT_ENGINES.add("AFTERGLOW")
            _added.add(panel.__name__)


def unregister() -> None:
    for panel in bpy.types.Panel.__subclasses__():
        if panel.__name__ in _added and isinstance(getattr(panel, "COMPAT_ENGINES", None), set):
            panel.COMPAT_ENGINES.discard("AFTERGLOW")
    _added.clear()
