# SPDX-License-Identifier: GPL-3.0-or-later
"""The add-on in Blender: what it registers, under which names, and that nothing stays when it is disabled."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

Run = Callable[..., dict[str, Any]]


def test_registers_and_leaves_nothing(in_blender: Run) -> None:
    found = in_blender(
        """
        import addon_utils
        name = addon().__name__
        def traces():
            panels = [p.__name__ for p in bpy.types.Panel.__subclasses__()
                      if 'AFTERGLOW' in getattr(p, 'COMPAT_ENGINES', ())]
            handlers = [f.__module__ for f in [*bpy.app.handlers.load_pre, *bpy.app.handlers.load_post]]
            return dict(panels=panels, scene=hasattr(bpy.types.Scene, 'afterglow'),
                        engines=[getattr(e, 'bl_idname', '') for e in bpy.types.RenderEngine.__subclasses__()],
                        handlers=[m for m in handlers if 'afterglow' in m])
        with_it = traces()
        addon_utils.disable(name)
        without = traces()
        addon_utils.enable(name)
        again = traces()
        result(with_it=with_it, without=without, again=again)
        """
    )
    assert found["with_it"]["scene"] and "AFTERGLOW" in found["with_it"]["engines"]
    panels = found["with_it"]["panels"]
    assert {"DATA_PT_lens", "RENDER_PT_color_management", "AFTERGLOW_RENDER_PT_sampling"} <= set(panels)
    # Blender shows panels as they were registered, and its own Simplify would stand above Sampling
    assert "RENDER_PT_simplify" not in panels
    assert panels.index("AFTERGLOW_RENDER_PT_simplify") > panels.index("AFTERGLOW_RENDER_PT_sampling")
    assert not found["without"]["scene"] and not found["without"]["handlers"]
    assert [name for name in found["without"]["panels"] if not name.startswith("AFTERGLOW")] == []
    assert found["again"]["scene"] and sorted(found["again"]["panels"]) == sorted(found["with_it"]["panels"])


def test_settings_have_cycles_names_and_meanings(in_blender: Run) -> None:
    found = in_blender(
        """
        ours, theirs = bpy.context.scene.afterglow, bpy.context.scene.cycles
        shared = ['max_bounces', 'diffuse_bounces', 'glossy_bounces', 'transmission_bounces', 'transparent_max_bounces',
                  'caustics_reflective', 'caustics_refractive', 'filter_width', 'film_exposure', 'pixel_filter_type',
                  'sample_clamp_direct']
        result(shared={n: [getattr(ours, n), getattr(theirs, n)] for n in shared},
               clamp=ours.sample_clamp_indirect,
               described=[p.identifier for p in ours.bl_rna.properties if not p.description],
               methods={i.identifier: i.value for i in ours.bl_rna.properties['method'].enum_items},
               known=[m['id'] for m in __import__('afterglow').method_descriptions()])
        """
    )
    assert all(ours == theirs for ours, theirs in found["shared"].values()), found["shared"]
    assert found["clamp"] == 0
    assert set(found["described"]) <= {"rna_type", "name", "file_version"}, "a setting without a tooltip"
    assert found["methods"]["AUTO"] == 0 and found["methods"]["PATH_TRACING"] == 1
    assert set(found["known"]) - {"AUTO"} <= set(found["methods"])


def test_settings_survive_saving(in_blender: Run) -> None:
    found = in_blender(
        """
        import os
        s = scene(samples=77, time_limit=12.5, diffuse_bounces=3)
        path = os.path.join(os.path.dirname(os.environ['AFTERGLOW_RESULT']), 'saved.blend')
        bpy.ops.wm.save_as_mainfile(filepath=path)
        bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
        bpy.ops.wm.open_mainfile(filepath=path)
        own = bpy.context.scene.afterglow
        result(engine=bpy.context.scene.render.engine,
               values=[own.method, own.samples, own.time_limit, own.diffuse_bounces],
               version=own.file_version, current=addon('version_update').CURRENT)
        """
    )
    assert found["engine"] == "AFTERGLOW"
    assert found["values"] == ["PATH_TRACING", 77, 12.5, 3]
    assert found["version"] == found["current"]


def test_cycles_settings_are_taken_over(in_blender: Run) -> None:
    found = in_blender(
        """
        s = bpy.context.scene
        s.render.engine = 'AFTERGLOW'
        s.cycles.samples, s.cycles.max_bounces, s.cycles.sample_clamp_indirect = 33, 7, 5.0
        s.cycles.use_adaptive_sampling = False
        bpy.ops.afterglow.copy_cycles_settings()
        own = s.afterglow
        result(values=[own.samples, own.max_bounces, own.sample_clamp_indirect, own.accuracy])
        bpy.ops.afterglow.quality(quality='DRAFT')
        result(draft=own.samples)
        """
    )
    assert found["values"] == [33, 7, 5.0, 0.0]
    assert found["draft"] == 64


def test_a_click_prepares_an_animation(in_blender: Run) -> None:
    """Method, its own settings, persistent data; a scene's other settings stay."""
    found = in_blender(
        """
        s = bpy.context.scene
        s.render.engine = 'AFTERGLOW'
        own = s.afterglow
        own.max_bounces = 7
        bpy.ops.afterglow.quality(quality='CAMERA')
        result(camera=[own.method, own.samples, own.hash_cache.hash_extra, s.render.use_persistent_data, own.max_bounces])
        bpy.ops.afterglow.quality(quality='OBJECTS')
        cache = own.instant_cache
        result(objects=[own.method, own.accuracy, cache.virtual_lights, cache.light_compensation, cache.cache_first])
        """
    )
    assert found["camera"] == ["HASH_CACHE", 1, 3.0, True, 7]
    assert found["objects"] == ["INSTANT_CACHE", 0.0, 512, 24, 12]


def test_presets_of_animations_are_what_the_bench_measures(in_blender: Run, library: Path) -> None:
    """Both have a figure `frames`: its settings are those that a click gives."""
    from afterglow.bench.hash_cache.frames import WALK
    from afterglow.bench.instant_cache.frames import COOKER

    found = in_blender(
        """
        s = bpy.context.scene
        s.render.engine = 'AFTERGLOW'
        for quality in 'CAMERA', 'OBJECTS':
            bpy.ops.afterglow.quality(quality=quality)
            result(**{quality: addon('properties.scene').session_settings(s, False)})
        """
    )
    for quality, animation in (("CAMERA", WALK), ("OBJECTS", COOKER)):
        measured = {name: value for name, value in animation.ours.items() if name != "denoise"}  # no denoiser, no such setting
        assert {name: found[quality][name] for name in measured} == pytest.approx(measured)


def test_viewports_better_the_lights_of_a_cache(in_blender: Run) -> None:
    """Renders take settings as they are, and so do viewports without short rays."""
    found = in_blender(
        """
        s = bpy.context.scene
        s.render.engine = 'AFTERGLOW'
        own = s.afterglow
        asked = addon('properties.scene').session_settings
        names = 'virtual_lights', 'light_compensation', 'light_bound'
        told = lambda viewport: [asked(s, viewport)[name] for name in names]
        own.instant_cache.virtual_lights = 512
        result(automatic=told(True), without_cache='virtual_lights' in asked(s, False))
        own.instant_cache.virtual_lights = 256
        own.method = 'INSTANT_CACHE'
        result(render=told(False), viewport=told(True))
        own.instant_cache.virtual_lights = 65536
        result(most=told(True))
        own.preview_short_rays = 0
        own.instant_cache.virtual_lights = 256
        result(without=told(True))
        """
    )
    assert found["automatic"] == [640, 16, 4.0] and not found["without_cache"]
    assert found["render"] == found["without"] == [256, 0, 2.0]
    assert found["viewport"] == [320, 16, 4.0]
    assert found["most"] == [65536, 16, 4.0]


def test_an_active_virtual_environment_is_no_obstacle(in_blender: Run, tmp_path: Path) -> None:
    """Debian's Blender takes the first python3 on PATH for its own, and one of a virtual environment has no numpy."""
    subprocess.run(["/usr/bin/python3", "-m", "venv", "--without-pip", str(tmp_path / "venv")], check=True)
    path = os.pathsep.join([str(tmp_path / "venv" / "bin"), os.environ["PATH"]])
    found = in_blender("result(scene=hasattr(bpy.context.scene, 'afterglow'))", env={"PATH": path})
    assert found["scene"]
