# SPDX-License-Identifier: GPL-3.0-or-later
"""The light's tab. Names of a light's settings differ between Blenders: each row asks first whether it exists."""

import bpy

from .panel import PropertiesPanel, draw_node_input


def shadow_owner(light: bpy.types.Light) -> tuple[object, str] | None:
    """Who holds the switch of shadows: the light itself, in Blender before 4.0 Cycles' part of it."""
    cycles = getattr(light, "cycles", None)
    if cycles is not None and hasattr(cycles, "cast_shadow"):
        return cycles, "cast_shadow"
    return (light, "use_shadow") if hasattr(light, "use_shadow") else None


class LightPanel(PropertiesPanel):
    bl_context = "data"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.engine in cls.COMPAT_ENGINES and context.light is not None


class AFTERGLOW_LIGHT_PT_preview(LightPanel, bpy.types.Panel):
    bl_label = "Preview"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        self.layout.template_preview(context.light)


class AFTERGLOW_LIGHT_PT_light(LightPanel, bpy.types.Panel):
    bl_label = "Light"

    def draw(self, context: bpy.types.Context) -> None:
        light = context.light
        self.layout.row().prop(light, "type", expand=True)
        layout = self.prepare()
        column = layout.column()
        if hasattr(light, "use_temperature"):
            column.prop(light, "use_temperature")
            if light.use_temperature:
                column.prop(light, "temperature")
        column.prop(light, "color")
        column.prop(light, "energy", text="Strength" if light.type == "SUN" else "Power")
        for name in ("exposure", "normalize"):
            if hasattr(light, name):
                column.prop(light, name)
        column.separator()
        getattr(self, "draw_" + light.type.lower())(column, light)
        column.separator()
        shadow = shadow_owner(light)
        if shadow is not None:
            column.prop(*shadow, text="Cast Shadow")
        cycles = getattr(light, "cycles", None)
        if cycles is not None and hasattr(cycles, "use_multiple_importance_sampling"):
            column.prop(cycles, "use_multiple_importance_sampling", text="Multiple Importance")

    def draw_point(self, column: bpy.types.UILayout, light: bpy.types.Light) -> None:
        column.prop(light, "shadow_soft_size", text="Radius")
        if hasattr(light, "use_soft_falloff"):
            column.prop(light, "use_soft_falloff")

    def draw_spot(self, column: bpy.types.UILayout, light: bpy.types.Light) -> None:
        self.draw_point(column, light)
        column.separator()
        column.prop(light, "spot_size", text="Spot Size")
        column.prop(light, "spot_blend", text="Blend", slider=True)
        column.prop(light, "show_cone")

    def draw_sun(self, column: bpy.types.UILayout, light: bpy.types.Light) -> None:
        column.prop(light, "angle")

    def draw_area(self, column: bpy.types.UILayout, light: bpy.types.Light) -> None:
        column.prop(light, "shape")
        sub = column.column(align=True)
        if light.shape in {"SQUARE", "DISK"}:
            sub.prop(light, "size")
        else:
            sub.prop(light, "size", text="Size X")
            sub.prop(light, "size_y", text="Y")
        if hasattr(light, "spread"):
            column.prop(light, "spread")


class AFTERGLOW_LIGHT_PT_nodes(LightPanel, bpy.types.Panel):
    bl_label = "Nodes"

    def draw(self, context: bpy.types.Context) -> None:
        layout, light = self.prepare(), context.light
        if not light.use_nodes or light.node_tree is None:
            layout.prop(light, "use_nodes", icon="NODETREE")
        else:
            draw_node_input(layout, light.node_tree, ("ShaderNodeOutputLight",), "Surface")


classes = (AFTERGLOW_LIGHT_PT_preview, AFTERGLOW_LIGHT_PT_light, AFTERGLOW_LIGHT_PT_nodes)
