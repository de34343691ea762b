# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings at one click: a quality, a user's own presets, or what the file has for Cycles."""

import bpy
from bl_operators.presets import AddPresetBase

from ..properties.scene import LIGHT_PATHS

# Quality → settings of the final render and of the viewport. Those of a method stand in a dict of its own.
QUALITIES = {
    "DRAFT": dict(accuracy=0.2, samples=64, preview_accuracy=0.1),
    "MEDIUM": dict(accuracy=0.05, samples=1024, preview_accuracy=0.02),
    "HIGH": dict(accuracy=0.02, samples=8192, preview_accuracy=0.02),
    "REFERENCE": dict(
        accuracy=0.005, samples=1 << 20, preview_accuracy=0.01, sample_clamp_direct=0.0, sample_clamp_indirect=0.0
    ),
    # Animations whose caches live from frame to frame: as the bench's figures `frames` have them.
    "CAMERA": dict(
        method="HASH_CACHE", accuracy=0.0, samples=1, denoise=True, use_animated_seed=True,
        hash_cache=dict(hash_extra=3.0, hash_resolution=0.35, hash_first=4),
    ),
    "OBJECTS": dict(
        method="INSTANT_CACHE", accuracy=0.0, samples=4, denoise=True, use_animated_seed=True,
        instant_cache=dict(virtual_lights=512, light_compensation=24, light_bound=4.0, cache_first=12),
    ),
}
ANIMATIONS = {"CAMERA", "OBJECTS"}  # they want persistent data
QUALITY_ITEMS = [
    ("DRAFT", "Draft", "Relative error of 20 %, 64 samples at most", 0),
    ("MEDIUM", "Medium", "Relative error of 5 %, 1024 samples at most", 1),
    ("HIGH", "High", "Relative error of 2 %, 8192 samples at most", 2),
    ("REFERENCE", "Reference", "Relative error of 0.5 %, nothing clamped: slow", 3),
    ("CAMERA", "Camera Moves", "HashCache, denoised, with persistent data: what one frame found serves all that follow", 4),
    ("OBJECTS", "Objects Move", "Instant cache, denoised, with persistent data: each frame repairs what the last one knew", 5),
]
# Settings that Cycles has by the same name and in the same meaning.
FROM_CYCLES = (
    "samples",
    "seed",
    "use_animated_seed",
    *LIGHT_PATHS,
    "film_exposure",
    "pixel_filter_type",
    "filter_width",
    "preview_samples",
    "use_preview_denoising",
    "time_limit",
)


class AFTERGLOW_OT_quality(bpy.types.Operator):
    bl_idname = "afterglow.quality"
    bl_label = "Quality"
    bl_description = "Set method, accuracy and samples for a quality or an animation"
    bl_options = {"REGISTER", "UNDO"}

    quality: bpy.props.EnumProperty(name="Quality", items=QUALITY_ITEMS, default="MEDIUM")

    @classmethod
    def description(cls, context: bpy.types.Context, properties: bpy.types.OperatorProperties) -> str:
        return next(item[2] for item in QUALITY_ITEMS if item[0] == properties.quality)

    def execute(self, context: bpy.types.Context) -> set[str]:
        own = context.scene.afterglow
        for name, value in QUALITIES[self.quality].items():
            if isinstance(value, dict):
                for inner, setting in value.items():
                    setattr(getattr(own, name), inner, setting)
            elif name != "denoise" or not own.poll_denoise():
                setattr(own, name, value)
        if self.quality in ANIMATIONS:
            context.scene.render.use_persistent_data = True
        return {"FINISHED"}


class AFTERGLOW_OT_copy_cycles_settings(bpy.types.Operator):
    bl_idname = "afterglow.copy_cycles_settings"
    bl_label = "Copy Cycles' Settings"
    bl_description = "Take samples, bounces, clamping, caustics and film from this scene's settings for Cycles"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return hasattr(context.scene, "cycles")

    def execute(self, context: bpy.types.Context) -> set[str]:
        theirs, ours = context.scene.cycles, context.scene.afterglow
        for name in FROM_CYCLES:
            if hasattr(theirs, name):
                setattr(ours, name, getattr(theirs, name))
        if getattr(theirs, "use_adaptive_sampling", False) is False:
            ours.accuracy = 0.0
        if not ours.poll_denoise():
            ours.denoise = bool(getattr(theirs, "use_denoising", False))
        return {"FINISHED"}


class AFTERGLOW_OT_sampling_preset_add(AddPresetBase, bpy.types.Operator):
    bl_idname = "afterglow.sampling_preset_add"
    bl_label = "Add Sampling Preset"
    bl_description = "Keep these settings as a preset, or remove one"
    preset_menu = "AFTERGLOW_PT_sampling_presets"
    preset_subdir = "afterglow/sampling"
    preset_defines = ["settings = bpy.context.scene.afterglow"]
    preset_values = [
        "settings." + name
        for name in (
            "method",
            "accuracy",
            "samples",
            "time_limit",
            "seed",
            *LIGHT_PATHS,
            "denoise",
            "denoiser",
            "preview_accuracy",
            "preview_samples",
            "preview_short_rays",
            "use_preview_denoising",
        )
    ]


classes = (AFTERGLOW_OT_quality, AFTERGLOW_OT_copy_cycles_settings, AFTERGLOW_OT_sampling_preset_add)
