# SPDX-License-Identifier: GPL-3.0-or-later
"""Buttons for what the viewport's method remembers: save it beside the file, load it again, begin from nothing."""

import os

import bpy
from bpy.props import StringProperty

from .. import backend, store

SUFFIX = ".afterglow_cache"


class CacheOperator:
    """An operator on the viewports of the scene that render now."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.engine == "AFTERGLOW" and bool(store.live_views(context.scene))

    def each(self, context: bpy.types.Context, action: str, *arguments: str) -> set[str]:
        """Calls the method of every viewport; what cannot be done is reported and nothing is lost."""
        try:
            for view in store.live_views(context.scene):
                getattr(view, action)(*arguments)
        except backend.afterglow.Error as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        return {"FINISHED"}


class CacheFileOperator(CacheOperator):
    filepath: StringProperty(subtype="FILE_PATH")
    filter_glob: StringProperty(default="*" + SUFFIX, options={"HIDDEN"})

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if not self.filepath:
            self.filepath = (os.path.splitext(bpy.data.filepath)[0] or "untitled") + SUFFIX
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}


class AFTERGLOW_OT_cache_save(CacheFileOperator, bpy.types.Operator):
    bl_idname = "afterglow.cache_save"
    bl_label = "Save Cache"
    bl_description = "Write what the viewport remembers of the scene's light into a file"

    def execute(self, context: bpy.types.Context) -> set[str]:
        return self.each(context, "save_cache", bpy.path.abspath(self.filepath))


class AFTERGLOW_OT_cache_load(CacheFileOperator, bpy.types.Operator):
    bl_idname = "afterglow.cache_load"
    bl_label = "Load Cache"
    bl_description = "Read the scene's light from a file that was saved from it: the viewport starts with what it knew then"

    def execute(self, context: bpy.types.Context) -> set[str]:
        return self.each(context, "load_cache", bpy.path.abspath(self.filepath))


class AFTERGLOW_OT_cache_forget(CacheOperator, bpy.types.Operator):
    bl_idname = "afterglow.cache_forget"
    bl_label = "Forget"
    bl_description = "Drop what the viewport remembers of the scene's light and begin from nothing"

    def execute(self, context: bpy.types.Context) -> set[str]:
        return self.each(context, "forget_cache")


classes = (AFTERGLOW_OT_cache_save, AFTERGLOW_OT_cache_load, AFTERGLOW_OT_cache_forget)
