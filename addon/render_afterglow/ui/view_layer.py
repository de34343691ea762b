# SPDX-License-Identifier: GPL-3.0-or-later
"""Panels of the view layer tab: passes that the engine writes, and the material override."""

import bpy

from .. import passes
from .panel import PropertiesPanel


class ViewLayerPanel(PropertiesPanel):
    bl_context = "view_layer"


class AFTERGLOW_RENDER_PT_passes(ViewLayerPanel, bpy.types.Panel):
    bl_label = "Passes"

    def draw(self, context: bpy.types.Context) -> None:
        pass


class AFTERGLOW_RENDER_PT_passes_data(ViewLayerPanel, bpy.types.Panel):
    bl_label = "Data"
    bl_parent_id = "AFTERGLOW_RENDER_PT_passes"

    def draw(self, context: bpy.types.Context) -> None:
        layout, layer = self.prepare(), context.view_layer
        column = layout.column(heading="Include", align=True)
        column.prop(layer, "use_pass_combined")
        for item in passes.DATA_PASSES:
            if item.native == "object_index":
                column = layout.column(heading="Indexes", align=True)
            column.prop(layer, item.switch)


class AFTERGLOW_RENDER_PT_passes_light(ViewLayerPanel, bpy.types.Panel):
    bl_label = "Light"
    bl_parent_id = "AFTERGLOW_RENDER_PT_passes"

    def draw(self, context: bpy.types.Context) -> None:
        layout, layer = self.prepare(), context.view_layer
        for lobe in ("diffuse", "glossy", "transmission"):
            column = layout.column(heading=lobe.title(), align=True)
            for part in ("direct", "indirect", "color"):
                column.prop(layer, f"use_pass_{lobe}_{part}", text=part.title())
        column = layout.column(heading="Other", align=True)
        column.prop(layer, "use_pass_emit", text="Emission")
        column.prop(layer, "use_pass_environment")


class AFTERGLOW_RENDER_PT_override(ViewLayerPanel, bpy.types.Panel):
    bl_label = "Override"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        layout, layer = self.prepare(), context.view_layer
        layout.prop(layer, "material_override")
        if hasattr(layer, "world_override"):
            layout.prop(layer, "world_override")


classes = (
    AFTERGLOW_RENDER_PT_passes,
    AFTERGLOW_RENDER_PT_passes_data,
    AFTERGLOW_RENDER_PT_passes_light,
    AFTERGLOW_RENDER_PT_override,
)
