# SPDX-License-Identifier: GPL-3.0-or-later
"""What a report of a slow or wrong render needs: machine, versions, the scene's settings, what the last render did."""

import json
import os
import platform
from typing import Any

import bpy

from .. import backend, store
from ..properties.scene import session_settings


def processor() -> str:
    """The processor's name where the system tells it."""
    try:
        with open("/proc/cpuinfo", encoding="utf-8", errors="replace") as lines:
            return next(
                (line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")), platform.machine()
            )
    except OSError:
        return platform.processor() or platform.machine()


def information(scene: bpy.types.Scene) -> dict[str, Any]:
    """Machine, versions, settings and the last render's statistics of a scene, as plain data."""
    afterglow = backend.afterglow
    return {
        "afterglow": getattr(afterglow, "__version__", None) or backend.problem,
        "blender": bpy.app.version_string,
        "machine": {"system": platform.platform(), "processor": processor(), "threads": os.cpu_count()},
        "versions": dict(afterglow.versions()) if hasattr(afterglow, "versions") else {},
        "denoisers": backend.denoisers(),
        "settings": session_settings(scene, viewport=False),
        "last_render": store.statistics(scene),
    }


class AFTERGLOW_OT_copy_information(bpy.types.Operator):
    bl_idname = "afterglow.copy_information"
    bl_label = "Copy Information"
    bl_description = (
        "Copy machine, versions, settings and the last render's statistics to the clipboard, for a report "
        "or to compare machines"
    )

    def execute(self, context: bpy.types.Context) -> set[str]:
        context.window_manager.clipboard = json.dumps(information(context.scene), indent=1, default=str)
        self.report({"INFO"}, "Copied to the clipboard")
        return {"FINISHED"}


classes = (AFTERGLOW_OT_copy_information,)
