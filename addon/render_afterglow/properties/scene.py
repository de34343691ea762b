# SPDX-License-Identifier: GPL-3.0-or-later
"""`scene.afterglow`: what all methods share, and the dictionary of settings that the native session takes.

Cycles' names, meanings and defaults wherever Cycles has the same setting, except that nothing is clamped by default:
light is left out only when a user asks for it.
"""

from typing import Any

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, PointerProperty

from .. import backend
from . import methods

DENOISERS = [
    ("AUTO", "Automatic", "OpenImageDenoise where this Blender brings it, else the layered filter", 0),
    ("OPENIMAGEDENOISE", "OpenImageDenoise", "A neural network: less error, a little slower", 1),
    ("LAYERED", "Layered Filter", "Averages along surfaces, as far as the samples are believed to be off. Always there", 2),
]
PIXEL_FILTERS = [
    ("BOX", "Box", "Every sample counts for the pixel it fell into", 0),
    ("GAUSSIAN", "Gaussian", "Soft edges", 1),
    ("BLACKMAN_HARRIS", "Blackman-Harris", "Sharp edges without ringing; the default", 2),
]


class AfterglowSceneSettings(bpy.types.PropertyGroup):
    accuracy: FloatProperty(
        name="Accuracy",
        description="Relative error of the image that is accepted: rendering ends when the engine believes it is "
        "below. 0: render exactly the given number of samples",
        default=0.05,
        min=0.0,
        max=1.0,
        soft_max=0.5,
        precision=4,
        step=0.1,
    )
    samples: IntProperty(
        name="Max Samples",
        description="Samples of every pixel at most; exactly so many when the accuracy is 0",
        default=1024,
        min=1,
        soft_max=16384,
        max=1 << 24,
    )
    time_limit: FloatProperty(
        name="Time Limit",
        description="Stop after this time and keep what is there; 0: no limit",
        default=0.0,
        min=0.0,
        soft_max=3600.0,
        subtype="TIME",
        unit="TIME",
        precision=2,
        step=100,
    )
    seed: IntProperty(name="Seed", description="Another seed gives another pattern of noise", default=0, min=0)
    use_animated_seed: BoolProperty(
        name="Animate Seed", description="A new pattern of noise in every frame of an animation", default=False
    )
    max_bounces: IntProperty(name="Total", description="Bounces of light at most", default=12, min=0, max=1024)
    diffuse_bounces: IntProperty(name="Diffuse", description="Diffuse bounces at most", default=4, min=0, max=1024)
    glossy_bounces: IntProperty(name="Glossy", description="Glossy bounces at most", default=4, min=0, max=1024)
    transmission_bounces: IntProperty(
        name="Transmission", description="Passages through refracting surfaces at most", default=12, min=0, max=1024
    )
    transparent_max_bounces: IntProperty(
        name="Transparent", description="Passages through transparent surfaces at most", default=8, min=0, max=1024
    )
    sample_clamp_direct: FloatProperty(
        name="Direct Light",
        description="No sample of direct light counts for more than this; 0: no limit, nothing is lost",
        default=0.0,
        min=0.0,
        soft_max=100.0,
    )
    sample_clamp_indirect: FloatProperty(
        name="Indirect Light",
        description="No sample of indirect light counts for more than this; 0: no limit, nothing is lost",
        default=0.0,
        min=0.0,
        soft_max=100.0,
    )
    caustics_reflective: BoolProperty(
        name="Reflective", description="Light that a mirror or glossy surface throws on a diffuse one", default=True
    )
    caustics_refractive: BoolProperty(
        name="Refractive", description="Light that goes through glass on to a diffuse surface", default=True
    )
    threads: IntProperty(
        name="Threads",
        description="Processor threads; 0: as Blender's own setting of threads says",
        default=0,
        min=0,
        max=1024,
    )
    denoise: BoolProperty(
        name="Denoise",
        description="Remove the noise that is left. It costs a little time and may blur fine detail in light",
        default=False,
    )
    denoiser: EnumProperty(
        name="Denoiser",
        description="What removes the noise, in renders and in viewports",
        items=DENOISERS,
        default="AUTO",
    )
    film_exposure: FloatProperty(
        name="Exposure", description="Factor on the brightness of the image", default=1.0, min=0.0, soft_max=10.0
    )
    pixel_filter_type: EnumProperty(
        name="Filter",
        description="How samples count for the pixels around them",
        items=PIXEL_FILTERS,
        default="BLACKMAN_HARRIS",
    )
    filter_width: FloatProperty(
        name="Width", description="Width of the pixel filter", default=1.5, min=0.01, max=10.0, subtype="PIXEL"
    )
    carry_over: BoolProperty(
        name="Keep Samples",
        description="By the instant cache: where an edit or the next frame of an animation changes nothing and the view stands "
        "still, the samples of before stay, and direct light is smoothed as far as its own noise goes",
        default=True,
    )
    preview_samples: IntProperty(
        name="Max Samples",
        description="Samples of every pixel in the viewport at most; 0: go on for ever",
        default=1024,
        min=0,
        soft_max=16384,
        max=1 << 24,
    )
    preview_accuracy: FloatProperty(
        name="Accuracy",
        description="Relative error at which the viewport rests; 0: go on to the given number of samples",
        default=0.02,
        min=0.0,
        max=1.0,
        soft_max=0.5,
        precision=4,
        step=0.1,
    )
    preview_short_rays: IntProperty(
        name="Short Rays",
        description="Rays of each record of the instant cache that gather light of near surfaces, once a first picture stands: "
        "corners are not too dark and walls are even. The bounding distance is then 4 at least, and there are a quarter more "
        "virtual lights; 0: none",
        default=16,
        min=0,
        max=1024,
        soft_max=64,
    )
    use_preview_denoising: BoolProperty(
        name="Denoise", description="Denoise the viewport while it refines", default=False
    )
    preview_pause: BoolProperty(name="Pause Viewport", description="Hold all viewports as they are", default=False)
    file_version: IntProperty(description="Version of the settings that the file holds", default=0, options={"HIDDEN"})

    @classmethod
    def poll_denoise(cls) -> str:
        """Why denoising is not possible here; empty when it is."""
        from .. import backend

        return backend.denoise_problem()


# What a method's description may name without getting a property of its own.
SHARED_SETTINGS = set(AfterglowSceneSettings.__annotations__) | {
    "method",
    "width",
    "height",
    "region",
    "frame",
    "passes",
}

# How far light is followed and what of it is cut, by Cycles' names.
LIGHT_PATHS = (
    "max_bounces",
    "diffuse_bounces",
    "glossy_bounces",
    "transmission_bounces",
    "transparent_max_bounces",
    "sample_clamp_direct",
    "sample_clamp_indirect",
    "caustics_reflective",
    "caustics_refractive",
)
PREVIEW_BOUND = 4.0  # with short rays, which bring what it takes
PREVIEW_LIGHTS = 1.25  # a settled picture has no noise: what is left of its error is mostly that lights are few
_SESSION_NAMES = (*LIGHT_PATHS, "film_exposure", "filter_width")


def session_settings(scene: bpy.types.Scene, viewport: bool) -> dict[str, Any]:
    """The native session's settings of a scene, without the image's size and passes."""
    own = scene.afterglow
    settings: dict[str, Any] = {name: getattr(own, name) for name in _SESSION_NAMES}
    threads = own.threads
    if threads == 0 and scene.render.threads_mode == "FIXED":
        threads = scene.render.threads
    seed = own.seed + (scene.frame_current * 0x9E3779B1 if own.use_animated_seed else 0)
    settings.update(
        method=own.method,
        samples=(own.preview_samples or 1 << 24) if viewport else own.samples,
        accuracy=own.preview_accuracy if viewport else own.accuracy,
        time_limit=0.0 if viewport else own.time_limit,
        seed=seed & 0xFFFFFFFF,
        frame=scene.frame_current,
        threads=threads,
        pixel_filter=own.pixel_filter_type,
        film_transparent=scene.render.film_transparent,
        denoise=(own.use_preview_denoising if viewport else own.denoise) and not own.poll_denoise(),
        denoiser=own.denoiser,
        viewport=viewport,
        carry_over=own.carry_over,
    )
    method = backend.chosen_method(own.method, viewport)
    group = getattr(own, methods.group_name(method), None)
    if group is not None:
        keys = [key for key in group.__annotations__ if viewport or not methods.is_debug(key)]
        settings.update({key: getattr(group, key) for key in keys})  # final renders show light, always
    if viewport and own.carry_over and own.preview_short_rays and method == "INSTANT_CACHE":
        settings["light_compensation"] = max(settings.get("light_compensation", 0), own.preview_short_rays)
        settings["light_bound"] = max(settings.get("light_bound", 0.0), PREVIEW_BOUND)
        settings["virtual_lights"] = min(round(PREVIEW_LIGHTS * settings.get("virtual_lights", 256)), 65536)
    return settings


MIST_FALLOFFS = ("QUADRATIC", "LINEAR", "INVERSE_QUADRATIC")


def mist_settings(scene: bpy.types.Scene) -> tuple[float, float, int]:
    """Start, depth and falloff of the mist pass; Blender's defaults where the scene has no world."""
    if scene.world is None:
        return 5.0, 25.0, 0
    mist = scene.world.mist_settings
    return mist.start, mist.depth, MIST_FALLOFFS.index(mist.falloff)


def register() -> None:
    AfterglowSceneSettings.__annotations__["method"] = EnumProperty(
        name="Method", description="How indirect light is computed", items=methods.method_items(), default="AUTO"
    )
    for name, group in methods._groups.items():
        AfterglowSceneSettings.__annotations__[name] = PointerProperty(
            type=group, name=name.replace("_", " ").title(), description="Settings of this method alone"
        )
    methods.tell_changes(AfterglowSceneSettings)
    bpy.utils.register_class(AfterglowSceneSettings)


def unregister() -> None:
    bpy.utils.unregister_class(AfterglowSceneSettings)
