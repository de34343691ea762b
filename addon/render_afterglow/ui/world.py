# SPDX-License-Identifier: GPL-3.0-or-later
"""The world's tab: its surface, the mist pass, and which rays see it."""

import bpy

from .panel import PropertiesPanel, draw_node_input


class WorldPanel(PropertiesPanel):
    bl_context = "world"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.engine in cls.COMPAT_ENGINES and context.world is not None


class AFTERGLOW_WORLD_PT_preview(WorldPanel, bpy.types.Panel):
    bl_label = "Preview"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        self.layout.template_preview(context.world)


class AFTERGLOW_WORLD_PT_surface(WorldPanel, bpy.types.Panel):
    bl_label = "Surface"

    def draw(self, context: bpy.types.Context) -> None:
        layout, world = self.prepare(), context.world
        if not world.use_nodes:
            layout.prop(world, "use_nodes", icon="NODETREE")
            layout.prop(world, "color")
        elif not draw_node_input(layout, world.node_tree, ("ShaderNodeOutputWorld",), "Surface"):
            layout.label(text="No output node", icon="INFO")


class AFTERGLOW_WORLD_PT_mist(WorldPanel, bpy.types.Panel):
    bl_label = "Mist Pass"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        layout, mist = self.prepare(), context.world.mist_settings
        layout.active = context.view_layer.use_pass_mist
        column = layout.column(align=True)
        column.prop(mist, "start")
        column.prop(mist, "depth")
        layout.prop(mist, "falloff")


class AFTERGLOW_WORLD_PT_ray_visibility(WorldPanel, bpy.types.Panel):
    bl_label = "Ray Visibility"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return super().poll(context) and getattr(context.world, "cycles_visibility", None) is not None

    def draw(self, context: bpy.types.Context) -> None:
        layout, visibility = self.prepare(), context.world.cycles_visibility
        column = layout.column()
        for name in ("camera", "diffuse", "glossy", "transmission"):
            column.prop(visibility, name)


classes = (
    AFTERGLOW_WORLD_PT_preview,
    AFTERGLOW_WORLD_PT_surface,
    AFTERGLOW_WORLD_PT_mist,
    AFTERGLOW_WORLD_PT_ray_visibility,
)
