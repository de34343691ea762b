# SPDX-License-Identifier: GPL-3.0-or-later
"""The object tab: where an object is seen, and by which rays. The settings are Blender's own."""

import bpy

from .panel import PropertiesPanel

RENDERABLE = {"MESH", "CURVE", "CURVES", "SURFACE", "FONT", "META", "POINTCLOUD", "VOLUME", "LIGHT", "EMPTY"}


class ObjectPanel(PropertiesPanel):
    bl_context = "object"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.engine in cls.COMPAT_ENGINES and context.object is not None and context.object.type in RENDERABLE


class AFTERGLOW_OBJECT_PT_visibility(ObjectPanel, bpy.types.Panel):
    bl_label = "Visibility"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        layout, thing = self.prepare(), context.object
        layout.prop(thing, "hide_select", text="Selectable", invert_checkbox=True, toggle=False)
        column = layout.column(heading="Show In")
        column.prop(thing, "hide_viewport", text="Viewports", invert_checkbox=True, toggle=False)
        column.prop(thing, "hide_render", text="Renders", invert_checkbox=True, toggle=False)
        if thing.type != "LIGHT":
            layout.column(heading="Mask").prop(thing, "is_holdout")


class AFTERGLOW_OBJECT_PT_ray_visibility(ObjectPanel, bpy.types.Panel):
    bl_label = "Ray Visibility"
    bl_parent_id = "AFTERGLOW_OBJECT_PT_visibility"

    def draw(self, context: bpy.types.Context) -> None:
        layout, thing = self.prepare(), context.object
        column = layout.column()
        for name in ("camera", "diffuse", "glossy", "transmission"):
            column.prop(thing, f"visible_{name}", text=name.title())
        if thing.type != "LIGHT":
            column.prop(thing, "visible_shadow", text="Shadow")


classes = (AFTERGLOW_OBJECT_PT_visibility, AFTERGLOW_OBJECT_PT_ray_visibility)
