# SPDX-License-Identifier: GPL-3.0-or-later
"""The camera's panel that Blender before 4.0 shows for Cycles alone: the kind of panorama. All else is Blender's
own."""

import bpy

from .panel import PropertiesPanel


class AFTERGLOW_CAMERA_PT_panorama(PropertiesPanel, bpy.types.Panel):
    bl_label = "Panorama"
    bl_context = "data"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        camera = context.camera
        return context.engine in cls.COMPAT_ENGINES and camera is not None and camera.type == "PANO"

    def draw(self, context: bpy.types.Context) -> None:
        layout, camera = self.prepare(), context.camera
        owner = camera if hasattr(camera, "panorama_type") else getattr(camera, "cycles", None)
        if owner is None:
            layout.label(text="Equirectangular, all around")
            return
        layout.prop(owner, "panorama_type")
        if owner.panorama_type != "EQUIRECTANGULAR":
            layout.label(text="Rendered as equirectangular", icon="INFO")
        column = layout.column(align=True)
        for name in ("latitude_min", "latitude_max", "longitude_min", "longitude_max"):
            column.prop(owner, name)


classes = (AFTERGLOW_CAMERA_PT_panorama,)
