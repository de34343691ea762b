# SPDX-License-Identifier: GPL-3.0-or-later
"""What the 3D viewport's header offers in rendered mode: the scene's lights and world or a studio's, and a pause."""

import bpy

from .panel import ENGINES
from .render import view_setting


class AFTERGLOW_VIEW3D_PT_shading_cache(bpy.types.Panel):
    bl_space_type = "VIEW_3D"
    bl_region_type = "HEADER"
    bl_label = "Cache"
    bl_parent_id = "VIEW3D_PT_shading"
    COMPAT_ENGINES = ENGINES

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        rendered = context.engine in cls.COMPAT_ENGINES and context.space_data.shading.type == "RENDERED"
        return rendered and view_setting(context.scene) is not None

    def draw(self, context: bpy.types.Context) -> None:
        self.layout.prop(*view_setting(context.scene), text="Show")


class AFTERGLOW_VIEW3D_PT_shading_lighting(bpy.types.Panel):
    bl_space_type = "VIEW_3D"
    bl_region_type = "HEADER"
    bl_label = "Lighting"
    bl_parent_id = "VIEW3D_PT_shading"
    COMPAT_ENGINES = ENGINES

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.engine in cls.COMPAT_ENGINES and context.space_data.shading.type == "RENDERED"

    def draw(self, context: bpy.types.Context) -> None:
        layout, shading = self.layout, context.space_data.shading
        layout.prop(shading, "use_scene_lights_render")
        layout.prop(shading, "use_scene_world_render")
        if not shading.use_scene_world_render:
            layout.template_icon_view(shading, "studio_light", scale_popup=3)
            column = layout.column()
            column.prop(shading, "studiolight_rotate_z", text="Rotation")
            column.prop(shading, "studiolight_intensity")
            column.prop(shading, "studiolight_background_alpha")


def draw_pause(self: bpy.types.Header, context: bpy.types.Context) -> None:
    """A pause button in the header of viewports that render."""
    if context.engine in ENGINES and context.space_data.shading.type == "RENDERED":
        paused = context.scene.afterglow.preview_pause
        self.layout.prop(context.scene.afterglow, "preview_pause", icon="PLAY" if paused else "PAUSE", text="")


classes = (AFTERGLOW_VIEW3D_PT_shading_lighting, AFTERGLOW_VIEW3D_PT_shading_cache)
