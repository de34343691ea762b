# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes Blender's standard panels appear for the engine.

Blender's own panels name the engines that they belong to (COMPAT_ENGINES). Those for any renderer name BLENDER_RENDER;
the ones listed below belong to settings that Afterglow shows in panels of its own, or does not have.
"""

import importlib
from collections.abc import Callable
from types import ModuleType
from typing import Any

import bpy

# Panels whose settings stand in Afterglow's own panels, or which only other engines heed.
REPLACED = {
    "DATA_PT_light",
    "DATA_PT_preview",
    "DATA_PT_spot",
    "DATA_PT_area",
    "DATA_PT_falloff_curve",
    "DATA_PT_EEVEE_light",
    "EEVEE_MATERIAL_PT_context_material",
    "MATERIAL_PT_preview",
    "MATERIAL_PT_context_material",
    "NODE_DATA_PT_light",
    "NODE_DATA_PT_spot",
    "OBJECT_PT_visibility",
    "RENDER_PT_simplify",
    "RENDER_PT_simplify_greasepencil",
    "RENDER_PT_simplify_render",
    "RENDER_PT_simplify_viewport",
    "VIEWLAYER_PT_filter",
    "VIEWLAYER_PT_layer_passes",
    "WORLD_PT_preview",
    "WORLD_PT_context_surface",
}
# Panels that do not name BLENDER_RENDER although what they show counts for any renderer.
ALSO = {
    "RENDER_PT_color_management",
    "RENDER_PT_color_management_curves",
    "RENDER_PT_color_management_display_settings",
    "RENDER_PT_color_management_working_space",
    "RENDER_PT_color_management_white_balance",
}
# Modules of Blender that offer shader nodes for Cycles alone: what they offer is offered here, too. What the engine
# does not know has a stated fallback.
NODE_MENUS = ("nodeitems_builtins", "bl_ui.node_add_menu_shader")

_added: set[str] = set()
_polls: dict[ModuleType, Callable[[Any], bool]] = {}


def standard_panels() -> list[type]:
    """Every panel of Blender's own that the engine should have."""
    found = []
    for panel in bpy.types.Panel.__subclasses__():
        engines = getattr(panel, "COMPAT_ENGINES", None)
        if engines is None or panel.__name__ in REPLACED or not isinstance(engines, set):
            continue
        if "freestyle" in panel.__name__.lower():
            continue
        if "BLENDER_RENDER" in engines or panel.__name__ in ALSO:
            found.append(panel)
    return found


def offer_shader_nodes() -> None:
    """Lets the node editor's Add menu offer shader nodes: it asks whether the engine is Cycles."""
    for name in NODE_MENUS:
        try:
            module = importlib.import_module(name)
        except ImportError:
            continue
        original = getattr(module, "cycles_shader_nodes_poll", None)
        if original is not None and module not in _polls:
            _polls[module] = original
            module.cycles_shader_nodes_poll = also_for_afterglow(original)


def also_for_afterglow(original: Callable[[Any], bool]) -> Callable[[Any], bool]:
    def poll(context: bpy.types.Context) -> bool:
        return context.engine == "AFTERGLOW" or original(context)

    return poll


def register() -> None:
    for panel in standard_panels():
        if "AFTERGLOW" not in panel.COMPAT_ENGINES:
            panel.COMPAT_ENGINES.add("AFTERGLOW")
            _added.add(panel.__name__)
    offer_shader_nodes()


def unregister() -> None:
    for panel in bpy.types.Panel.__subclasses__():
        if panel.__name__ in _added and isinstance(getattr(panel, "COMPAT_ENGINES", None), set):
            panel.COMPAT_ENGINES.discard("AFTERGLOW")
    _added.clear()
    for module, original in _polls.items():
        module.cycles_shader_nodes_poll = original
    _polls.clear()
