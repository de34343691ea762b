# SPDX-License-Identifier: GPL-3.0-or-later
"""Panels of the render tab: method and accuracy, light paths, film, performance, denoising, what the last render
did."""

import bpy
from bl_ui.utils import PresetPanel

from .. import backend, store
from ..operators import accuracy
from ..operators.presets import QUALITY_ITEMS
from ..properties import methods
from .panel import PropertiesPanel, wrap


class AFTERGLOW_PT_sampling_presets(PresetPanel, bpy.types.Panel):
    bl_label = "Sampling Presets"
    preset_subdir = "afterglow/sampling"
    preset_operator = "script.execute_preset"
    preset_add_operator = "afterglow.sampling_preset_add"
    COMPAT_ENGINES = PropertiesPanel.COMPAT_ENGINES


class AFTERGLOW_RENDER_PT_sampling(PropertiesPanel, bpy.types.Panel):
    bl_label = "Sampling"

    def draw_header_preset(self, context: bpy.types.Context) -> None:
        AFTERGLOW_PT_sampling_presets.draw_panel_header(self.layout)

    def draw(self, context: bpy.types.Context) -> None:
        layout, settings = self.prepare(), context.scene.afterglow
        if backend.problem:
            wrap(layout, backend.problem, "ERROR")
        layout.prop(settings, "method")
        grid = layout.grid_flow(columns=2, align=True, row_major=True)
        for identifier, label, _description, _number in QUALITY_ITEMS:
            grid.operator("afterglow.quality", text=label).quality = identifier
        layout.operator("afterglow.copy_cycles_settings")


class AFTERGLOW_RENDER_PT_sampling_method(PropertiesPanel, bpy.types.Panel):
    bl_label = "Method"
    bl_parent_id = "AFTERGLOW_RENDER_PT_sampling"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.engine in cls.COMPAT_ENGINES and chosen_group(context.scene) is not None

    def draw_header(self, context: bpy.types.Context) -> None:
        description = chosen_description(context.scene)
        automatic = " (Viewport)" if context.scene.afterglow.method == "AUTO" else ""
        self.layout.label(text=description["label"] + automatic if description else "")

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.prepare()
        group = chosen_group(context.scene)
        for name in group.__annotations__:
            if not methods.is_debug(name):
                layout.prop(group, name)


class AFTERGLOW_RENDER_PT_sampling_cache(PropertiesPanel, bpy.types.Panel):
    bl_label = "Cache"
    bl_parent_id = "AFTERGLOW_RENDER_PT_sampling"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.engine in cls.COMPAT_ENGINES and view_setting(context.scene) is not None

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.prepare()
        layout.prop(*view_setting(context.scene), text="Viewport Shows")
        row = layout.row(align=True)
        row.operator("afterglow.cache_save", text="Save")
        row.operator("afterglow.cache_load", text="Load")
        row.operator("afterglow.cache_forget")


def chosen_method(scene: bpy.types.Scene) -> str:
    """The method whose settings matter; of the engine's own choice, the viewport's."""
    return backend.chosen_method(scene.afterglow.method, True)


def chosen_group(scene: bpy.types.Scene) -> bpy.types.PropertyGroup | None:
    """The chosen method's own settings, where it has some."""
    return getattr(scene.afterglow, methods.group_name(chosen_method(scene)), None)


def view_setting(scene: bpy.types.Scene) -> tuple[bpy.types.PropertyGroup, str] | None:
    """The setting of the chosen method that shows what its cache holds."""
    group = chosen_group(scene)
    names = [name for name in group.__annotations__ if name.endswith("_view")] if group is not None else []
    return (group, names[0]) if names else None


def chosen_description(scene: bpy.types.Scene) -> dict | None:
    return next((m for m in backend.method_descriptions() if m["id"] == chosen_method(scene)), None)


class AFTERGLOW_RENDER_PT_sampling_render(PropertiesPanel, bpy.types.Panel):
    bl_label = "Render"
    bl_parent_id = "AFTERGLOW_RENDER_PT_sampling"

    def draw(self, context: bpy.types.Context) -> None:
        layout, settings = self.prepare(), context.scene.afterglow
        layout.prop(settings, "accuracy")
        layout.prop(settings, "samples", text="Max Samples" if settings.accuracy > 0 else "Samples")
        layout.prop(settings, "time_limit")
        layout.prop(settings, "seed")
        layout.prop(settings, "use_animated_seed")


class AFTERGLOW_RENDER_PT_sampling_viewport(PropertiesPanel, bpy.types.Panel):
    bl_label = "Viewport"
    bl_parent_id = "AFTERGLOW_RENDER_PT_sampling"

    def draw(self, context: bpy.types.Context) -> None:
        layout, settings = self.prepare(), context.scene.afterglow
        layout.prop(settings, "preview_accuracy")
        layout.prop(settings, "preview_samples", text="Max Samples" if settings.preview_accuracy > 0 else "Samples")
        layout.prop(context.scene.render, "preview_pixel_size", text="Pixel Size")
        layout.prop(settings, "carry_over")
        if settings.method in {"AUTO", "INSTANT_CACHE"}:
            row = layout.row()
            row.active = settings.carry_over
            row.prop(settings, "preview_short_rays")


class AFTERGLOW_RENDER_PT_denoise(PropertiesPanel, bpy.types.Panel):
    bl_label = "Denoise"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        layout, settings = self.prepare(), context.scene.afterglow
        problem = backend.denoise_problem()
        column = layout.column(heading="Denoise")
        column.enabled = not problem
        column.prop(settings, "denoise", text="Render")
        column.prop(settings, "use_preview_denoising", text="Viewport")
        layout.prop(settings, "denoiser")
        if not problem and settings.denoiser != "AUTO":
            problem = backend.denoise_problem(settings.denoiser)
        if problem:
            wrap(layout, "Not available here. " + problem, "INFO")


class AFTERGLOW_RENDER_PT_light_paths(PropertiesPanel, bpy.types.Panel):
    bl_label = "Light Paths"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        pass


class AFTERGLOW_RENDER_PT_bounces(PropertiesPanel, bpy.types.Panel):
    bl_label = "Max Bounces"
    bl_parent_id = "AFTERGLOW_RENDER_PT_light_paths"

    def draw(self, context: bpy.types.Context) -> None:
        layout, settings = self.prepare(), context.scene.afterglow
        column = layout.column(align=True)
        column.prop(settings, "max_bounces")
        column = layout.column(align=True)
        for name in ("diffuse_bounces", "glossy_bounces", "transmission_bounces"):
            column.prop(settings, name)
        layout.column().prop(settings, "transparent_max_bounces")


class AFTERGLOW_RENDER_PT_clamping(PropertiesPanel, bpy.types.Panel):
    bl_label = "Clamping"
    bl_parent_id = "AFTERGLOW_RENDER_PT_light_paths"

    def draw(self, context: bpy.types.Context) -> None:
        layout, settings = self.prepare(), context.scene.afterglow
        column = layout.column(align=True)
        column.prop(settings, "sample_clamp_direct")
        column.prop(settings, "sample_clamp_indirect")


class AFTERGLOW_RENDER_PT_caustics(PropertiesPanel, bpy.types.Panel):
    bl_label = "Caustics"
    bl_parent_id = "AFTERGLOW_RENDER_PT_light_paths"

    def draw(self, context: bpy.types.Context) -> None:
        layout, settings = self.prepare(), context.scene.afterglow
        column = layout.column(heading="Caustics", align=True)
        column.prop(settings, "caustics_reflective")
        column.prop(settings, "caustics_refractive")


class AFTERGLOW_RENDER_PT_film(PropertiesPanel, bpy.types.Panel):
    bl_label = "Film"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        layout, settings = self.prepare(), context.scene.afterglow
        layout.prop(settings, "film_exposure")
        layout.prop(context.scene.render, "film_transparent", text="Transparent")
        layout.separator()
        layout.prop(settings, "pixel_filter_type")
        if settings.pixel_filter_type != "BOX":
            layout.prop(settings, "filter_width", text="Width")


class AFTERGLOW_RENDER_PT_performance(PropertiesPanel, bpy.types.Panel):
    bl_label = "Performance"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        layout, settings, render = self.prepare(), context.scene.afterglow, context.scene.render
        column = layout.column()
        column.prop(settings, "threads")
        if settings.threads == 0:
            column.prop(render, "threads_mode", text="Blender's Threads")
            if render.threads_mode == "FIXED":
                column.prop(render, "threads", text="Count")
        layout.column(heading="Final Render").prop(render, "use_persistent_data", text="Persistent Data")


class AFTERGLOW_RENDER_PT_statistics(PropertiesPanel, bpy.types.Panel):
    bl_label = "Last Render"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        statistics = store.statistics(context.scene)
        accuracy.draw_progress(layout, lambda place: place.operator("afterglow.accuracy_chart", icon="GRAPH"))
        layout.operator("afterglow.copy_information", icon="COPYDOWN")
        if statistics is None:
            layout.label(text="Nothing was rendered yet", icon="INFO")
            return
        for name, value in statistics_lines(statistics):
            row = layout.split(factor=0.4)
            row.alignment = "RIGHT"
            row.label(text=name)
            row.alignment = "LEFT"
            row.label(text=value)
        for text in statistics.get("warnings", ()):
            wrap(layout, text, "ERROR")


def simplify_panels() -> list[type]:
    """Blender's own Simplify panels once more: panels stand in the order in which they were registered, and Blender's would
    be above Sampling."""
    made = []
    for name in ("", "_viewport", "_render", "_greasepencil"):
        original = getattr(bpy.types, "RENDER_PT_simplify" + name, None)
        if original is None:
            continue
        content = {"bl_label": original.bl_label, "bl_options": {"DEFAULT_CLOSED"}, "draw": original.draw}
        if name:
            content["bl_parent_id"] = "AFTERGLOW_RENDER_PT_simplify"
        if hasattr(original, "draw_header"):
            content["draw_header"] = original.draw_header
        made.append(type("AFTERGLOW_RENDER_PT_simplify" + name, (PropertiesPanel, bpy.types.Panel), content))
    return made


def statistics_lines(statistics: dict) -> list[tuple[str, str]]:
    """What a render did, as rows of a name and a value."""
    lines = [
        ("Method", str(statistics.get("method", "")).replace("_", " ").title()),
        ("Samples", str(statistics.get("samples", ""))),
    ]
    error = statistics.get("believed_error")
    if error is not None:
        low, high = statistics.get("error_low"), statistics.get("error_high")
        lines.append(
            ("Error", f"{error:.2%}" + (f" ({low:.2%} to {high:.2%})" if low is not None and high is not None else ""))
        )
    elif statistics.get("noise") is not None:
        lines.append(("Noise", f"{statistics['noise']:.2%}, its bias aside"))
    lines.append(("Time", f"{statistics.get('wall_time', 0.0):.2f} s"))
    for stage, seconds in (statistics.get("seconds") or {}).items():
        lines.append(("  " + stage.replace("_", " ").title(), f"{seconds:.3f} s"))
    for kind, count in (statistics.get("rays") or {}).items():
        lines.append((f"Rays, {kind.replace('_', ' ')}", f"{count:,}"))
    memory = statistics.get("bytes")
    if isinstance(memory, dict):
        memory = sum(value for value in memory.values() if isinstance(value, (int, float)))
    if memory:
        lines.append(("Memory", f"{memory / 1048576:.1f} MiB"))
    if statistics.get("dropped"):
        lines.append(("Dropped values", f"{statistics['dropped']:,}"))
    if statistics.get("denoiser"):
        lines.append(("Denoiser", str(statistics["denoiser"])))
    return lines


classes = (
    AFTERGLOW_PT_sampling_presets,
    AFTERGLOW_RENDER_PT_sampling,
    AFTERGLOW_RENDER_PT_sampling_method,
    AFTERGLOW_RENDER_PT_sampling_cache,
    AFTERGLOW_RENDER_PT_sampling_render,
    AFTERGLOW_RENDER_PT_sampling_viewport,
    AFTERGLOW_RENDER_PT_denoise,
    AFTERGLOW_RENDER_PT_light_paths,
    AFTERGLOW_RENDER_PT_bounces,
    AFTERGLOW_RENDER_PT_clamping,
    AFTERGLOW_RENDER_PT_caustics,
    AFTERGLOW_RENDER_PT_film,
    *simplify_panels(),
    AFTERGLOW_RENDER_PT_performance,
    AFTERGLOW_RENDER_PT_statistics,
)
