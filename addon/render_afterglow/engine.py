# SPDX-License-Identifier: GPL-3.0-or-later
"""The render engine as Blender sees it: it hands final renders to `final.py` and viewports to `viewport.py`.

Blender makes a new object of this class for every mode switch and every frame; nothing that must outlive one lives
here.
"""

from __future__ import annotations

from typing import Any

import bpy

from . import passes, store


class AfterglowRenderEngine(bpy.types.RenderEngine):
    bl_idname = "AFTERGLOW"
    bl_label = "Afterglow"
    bl_use_preview = True
    bl_use_postprocess = True
    bl_use_eevee_viewport = True  # Material Preview mode is drawn by EEVEE
    bl_use_shading_nodes_custom = False
    bl_use_gpu_context = False
    bl_use_spherical_stereo = False
    bl_use_stereo_viewport = False

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.viewport = None

    def __del__(self) -> None:
        viewport = getattr(self, "viewport", None)
        if viewport is not None:
            viewport.free()

    # Final renders and previews -------------------------------------------------------------------------------------

    def update(self, data: bpy.types.BlendData, depsgraph: bpy.types.Depsgraph) -> None:
        self.update_stats("", "Preparing")

    def render(self, depsgraph: bpy.types.Depsgraph) -> None:
        from . import final

        final.render(self, depsgraph)

    def update_render_passes(self, scene: bpy.types.Scene, renderlayer: bpy.types.ViewLayer) -> None:
        passes.register_passes(self, scene, renderlayer)

    # Viewport -------------------------------------------------------------------------------------------------------

    def view_update(self, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        from . import viewport

        if self.viewport is None:
            self.viewport = viewport.Viewport(self)
        self.viewport.update(self, context, depsgraph)

    def view_draw(self, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        if self.viewport is not None:
            self.viewport.draw(self, context, depsgraph)


def register() -> None:
    bpy.utils.register_class(AfterglowRenderEngine)
    store.register()


def unregister() -> None:
    store.unregister()
    bpy.utils.unregister_class(AfterglowRenderEngine)
