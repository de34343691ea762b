# SPDX-License-Identifier: GPL-3.0-or-later
"""The viewport in a real window: its picture against final renders, edits seen in the next picture, what each view
hides, and that switching modes leaves nothing behind."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

Run = Callable[..., dict[str, Any]]

# A part of the camera's frame in the window, against a final render of the same size, part and display transform.
AGAINST_FINAL = """
s = scene(800, 600, samples=64)
s.afterglow.preview_accuracy, s.afterglow.preview_samples = 0.0, 64
s.render.dither_intensity = 0
s.render.use_border = True
s.render.border_min_x, s.render.border_max_x, s.render.border_min_y, s.render.border_max_y = 0.55, 0.85, 0.1, 0.35

def frame(picture):
    '''The camera's frame of the view's picture.'''
    from importlib import import_module
    camera = addon('sync.camera')
    region, space = view_region(), view_area().spaces.active
    depsgraph = bpy.context.evaluated_depsgraph_get()
    left, right, bottom, top = camera.camera_frame(depsgraph, s.camera.evaluated_get(depsgraph), space.region_3d)
    h, w = picture.shape[:2]
    return picture[round(bottom * h):round(top * h), round(left * w):round(right * w)]

def final(shape):
    s.render.resolution_y, s.render.resolution_x = shape[:2]
    image_format(s, 'PNG')
    s.render.image_settings.color_mode = 'RGB'
    s.render.filepath = os.path.join(os.path.dirname(os.environ['AFTERGLOW_RESULT']), 'final.png')
    bpy.ops.render.render(write_still=True)
    return load(s.render.filepath)[..., :3]
"""


@pytest.fixture
def box(blend_files: Path) -> Path:
    return blend_files / "cornell_box.blend"


@pytest.mark.parametrize("transform", ["Standard", pytest.param("Filmic", marks=pytest.mark.slow)])
def test_viewport_equals_the_final_render(in_window: Run, box: Path, transform: str) -> None:
    found = in_window(
        "import os\n"
        + AGAINST_FINAL
        + f"""
s.view_settings.view_transform = {transform!r}
s.view_settings.exposure = 0.5

def steps():
    full_view()
    yield 1.0
    yield from settled()
    shown = frame(view_picture())
    view_area().spaces.active.shading.type = 'SOLID'
    yield 0.3
    rendered = final(shown.shape)
    h, w = shown.shape[:2]
    inner = (slice(int(0.12 * h), int(0.33 * h)), slice(int(0.57 * w), int(0.83 * w)))
    difference = np.abs(shown - rendered)[inner]
    result(shape=shown.shape, mean=difference.mean(), bias=(shown - rendered)[inner].mean((0, 1)),
           level=shown[inner].mean())
drive(steps)
""",
        box,
    )
    assert found["level"] > 0.1
    # 64 independent samples a pixel leave noise in `mean`; it cancels in `bias`, which would show another curve
    assert max(map(abs, found["bias"])) < 0.006, found
    assert found["mean"] < 0.06, found


def test_edits_are_seen_in_the_next_picture(in_window: Run, box: Path) -> None:
    found = in_window(
        """
        s = scene()
        s.afterglow.preview_accuracy, s.afterglow.preview_samples = 0.0, 8
        s.render.preview_pixel_size = '4'
        def picture(): return view_picture()[::2, ::2].copy()
        mesh = max((o for o in s.objects if o.type == 'MESH' and o.name.lower().find('box') >= 0), default=None,
                   key=lambda o: o.dimensions.z) or next(o for o in s.objects if o.type == 'MESH')
        light = next((o for o in s.objects if o.type == 'LIGHT'), None)

        def steps():
            full_view(); yield 1.0
            yield from settled()
            base = picture(); seen = {}
            def changed(name):
                seen[name] = float(np.abs(picture() - base).mean())
            mesh.location.x += 0.3 * max(mesh.dimensions); yield 0.1
            yield from settled(); changed('moved')
            mesh.location.x -= 0.3 * max(mesh.dimensions); yield 0.1
            yield from settled(); changed('moved back')
            mesh.hide_viewport = True; yield 0.1
            yield from settled(); changed('hidden')
            mesh.hide_viewport = False; yield 0.1
            yield from settled(); changed('shown again')
            mesh.data.vertices[0].co.z += 0.5 * max(mesh.dimensions); mesh.data.update(); yield 0.1
            yield from settled(); changed('deformed')
            mesh.data.vertices[0].co.z -= 0.5 * max(mesh.dimensions); mesh.data.update(); yield 0.1
            yield from settled(); changed('formed back')
            s.afterglow.film_exposure = 3.0; yield 0.1
            yield from settled(); changed('exposure')
            s.afterglow.film_exposure = 1.0; yield 0.1
            yield from settled(); changed('exposure back')
            s.camera.location.x += 0.2; yield 0.1
            yield from settled(); changed('camera')
            s.camera.location.x -= 0.2; yield 0.1
            yield from settled(); changed('camera back')
            if light is not None:
                light.data.energy *= 4; yield 0.1
                yield from settled(); changed('light')
            else:
                s.world = bpy.data.worlds.new('Bright'); s.world.use_nodes = True
                s.world.node_tree.nodes['Background'].inputs['Strength'].default_value = 5; yield 0.1
                yield from settled(); changed('light')
            result(seen=seen)
        drive(steps)
        """,
        box,
    )
    seen = found["seen"]
    for name in ("moved", "hidden", "deformed", "exposure", "camera", "light"):
        assert seen[name] > 0.005, seen
    # the same seed and the same scene: the same picture, to the bit of the screen
    for name in ("moved back", "shown again", "formed back", "exposure back", "camera back"):
        assert seen[name] < 1e-6, seen


@pytest.mark.slow
def test_animated_and_driven_properties_are_seen(in_window: Run) -> None:
    """A material that asks for properties of objects, meshes and worlds; a driver on one, whose object nobody tells of."""
    found = in_window(
        """
        s = scene()
        s.afterglow.preview_accuracy, s.afterglow.preview_samples = 0.0, 4
        s.render.preview_pixel_size = '8'
        cube, light = bpy.data.objects['Cube'], bpy.data.objects['Light']
        material = bpy.data.materials.new('Shining')
        material.use_nodes = True
        tree = material.node_tree
        tree.nodes.clear()
        output, emission, asked = (tree.nodes.new('ShaderNode' + kind) for kind in ('OutputMaterial', 'Emission', 'Attribute'))
        tree.links.new(asked.outputs['Fac'], emission.inputs['Strength'])
        tree.links.new(emission.outputs[0], output.inputs[0])
        asked.attribute_name = 'glow'
        cube.data.materials.clear(); cube.data.materials.append(material)
        seen = {}
        def level():
            picture = view_picture()
            h, w = picture.shape[:2]
            return float(picture[h // 2 - 30:h // 2 + 30, w // 2 - 30:w // 2 + 30].mean())
        def look(name):
            yield 0.2
            yield from settled()
            seen.setdefault(name, []).append(level())
        def steps():
            full_view(); yield 1.0
            owners = ('object', cube, 'OBJECT'), ('mesh', cube.data, 'OBJECT'), ('world', s.world, 'VIEW_LAYER')
            for name, owner, kind in owners:
                asked.attribute_type = kind
                for frame in (1, 11):
                    owner['glow'] = frame / 10 - 0.1
                    owner.keyframe_insert('["glow"]', frame=frame)
                for frame in (1, 11):
                    s.frame_set(frame)
                    yield from look(name)
                owner.animation_data_clear()
                del owner['glow']
            asked.attribute_type = 'OBJECT'
            cube['glow'] = 0.0
            driver = cube.driver_add('["glow"]').driver
            variable = driver.variables.new()
            variable.targets[0].id, variable.targets[0].data_path = light, 'location.x'
            driver.expression = variable.name + ' / 4'
            for x in (0.0, 4.0):
                light.location.x = x
                yield from look('driver')
            result(seen=seen)
        drive(steps)
        """
    )
    assert all(dark < 0.1 and bright > 0.5 for dark, bright in found["seen"].values()), found["seen"]


@pytest.mark.slow
def test_local_view_border_and_pixel_size(in_window: Run) -> None:
    found = in_window(
        """
        s = scene()
        s.afterglow.preview_accuracy, s.afterglow.preview_samples = 0.0, 4
        s.render.preview_pixel_size = '2'
        bpy.ops.mesh.primitive_uv_sphere_add(location=(3, 0, 0))
        sphere, cube = bpy.context.object, bpy.data.objects['Cube']

        def steps():
            space = full_view(camera=False); yield 1.0
            yield from settled()
            whole = view_picture().copy()
            for o in bpy.context.view_layer.objects: o.select_set(o == cube)
            with in_view(): bpy.ops.view3d.localview(frame_selected=False)
            yield 0.2
            yield from settled()
            local = view_picture().copy()
            with in_view(): bpy.ops.view3d.localview(frame_selected=False)
            yield 0.2
            yield from settled()
            again = view_picture().copy()
            result(local=np.abs(local - whole).mean(), back=np.abs(again - whole).mean())

            space.use_render_border = True
            space.render_border_min_x, space.render_border_max_x = 0.25, 0.75
            space.render_border_min_y, space.render_border_max_y = 0.25, 0.75
            view_area().tag_redraw(); yield 0.3
            yield from settled()
            h, w = whole.shape[:2]
            bordered = view_picture().copy()
            inside = (slice(int(h * .3), int(h * .7)), slice(int(w * .3), int(w * .7)))
            result(inside=np.abs(bordered - whole)[inside].mean(),
                   corner=np.abs(bordered - whole)[:h // 5, :w // 5].mean(),
                   region=viewport().view.region)
            space.use_render_border = False
            s.render.preview_pixel_size = '8'; view_area().tag_redraw(); yield 0.3
            yield from settled()
            result(size=[viewport().view.width, viewport().view.height])
            result(coarse=np.abs(view_picture() - whole).mean(),
                   window=[view_region().width, view_region().height])
        drive(steps)
        """
    )
    assert found["local"] > 5e-4 and found["back"] < 1e-6, found
    assert found["inside"] < 1e-6 and found["corner"] > 0.005, found
    assert found["size"] == [found["window"][0] // 8, found["window"][1] // 8]
    assert 0 < found["coarse"] < 0.1


@pytest.mark.slow
def test_first_picture_after_a_move_comes_soon(in_window: Run, box: Path) -> None:
    found = in_window(
        """
        import time
        s = scene(); s.afterglow.preview_accuracy, s.afterglow.preview_samples = 0.0, 4096
        s.render.preview_pixel_size = '2'
        mesh = max((o for o in s.objects if o.type == 'MESH'), key=lambda o: -o.dimensions.x)
        delays = []
        def steps():
            full_view(); yield 3.0
            for trial in range(7):
                before, start = view_picture().copy(), time.perf_counter()
                mesh.location.x += 0.15 if trial % 2 else -0.15
                while np.abs(view_picture() - before).mean() < 2e-3 and time.perf_counter() < start + 6:
                    yield 0.005
                delays.append(time.perf_counter() - start)
                yield 0.6
            result(delays=delays)
        drive(steps)
        """,
        box,
    )
    delays = sorted(found["delays"])
    # the median; generous, for a machine that does other things: the real figure is a benchmark
    assert delays[3] < 3.0, delays


@pytest.mark.slow
def test_switching_modes_leaves_nothing(in_window: Run, box: Path) -> None:
    found = in_window(
        """
        import gc, threading, time
        s = scene(); s.render.preview_pixel_size = '4'
        s.afterglow.preview_accuracy, s.afterglow.preview_samples = 0.0, 4096
        def steps():
            space = full_view(); yield 1.5
            kind = addon('viewport').Viewport
            for trial in range(12):
                space.shading.type = 'SOLID'; yield 0.15
                space.shading.type = 'RENDERED'; yield 0.25
            result(one=[sum(type(t) is kind for t in gc.get_objects()), watchers()])
            space.shading.type = 'SOLID'; yield 0.5
            gc.collect()
            result(none=[sum(type(t) is kind for t in gc.get_objects()), watchers()])
        def watchers():
            return sum(t.name == 'Afterglow viewport' for t in threading.enumerate())
        drive(steps)
        """,
        box,
    )
    assert found["one"] == [1, 1]
    assert found["none"] == [0, 0]
    assert "Traceback" not in found["output"], found["output"][-3000:]


@pytest.mark.slow
def test_interface_stays_alive_while_rendering(in_window: Run, blend_files: Path) -> None:
    found = in_window(
        """
        import time
        s = scene(); s.afterglow.preview_accuracy, s.afterglow.preview_samples = 0.0, 1 << 16
        gaps = []
        def steps():
            full_view(); yield 3.0
            last = time.perf_counter()
            for tick in range(200):
                yield 0.01
                now = time.perf_counter(); gaps.append(now - last); last = now
            result(gaps=sorted(gaps))
        drive(steps)
        """,
        blend_files / "materials.blend",
    )
    gaps = found["gaps"]
    assert gaps[len(gaps) * 9 // 10] < 0.2, gaps[-20:]


@pytest.mark.slow
def test_material_preview_renders(in_window: Run) -> None:
    found = in_window(
        """
        import time
        s = scene()
        material = bpy.data.objects['Cube'].active_material or bpy.data.materials[0]
        def steps():
            yield 0.5
            with in_view():
                material.preview_ensure()
                bpy.ops.wm.previews_ensure() if hasattr(bpy.ops.wm, 'previews_ensure') else None
            end = time.time() + 15
            pixels = np.zeros(1)
            while time.time() < end:
                yield 0.2
                preview = material.preview
                pixels = np.zeros(len(preview.image_pixels_float), np.float32)
                if len(pixels):
                    preview.image_pixels_float.foreach_get(pixels)
                    if pixels.any(): break
            pixels = pixels.reshape(-1, 4)
            result(spread=pixels[:, :3].std(), level=pixels[:, :3].mean())
        drive(steps)
        """
    )
    assert found["spread"] > 0.02 and found["level"] > 0.02
    assert "Traceback" not in found["output"], found["output"][-3000:]


@pytest.mark.slow
def test_clipping_of_the_view_and_of_the_camera(in_window: Run) -> None:
    found = in_window(
        """
        s = scene(); s.afterglow.preview_accuracy, s.afterglow.preview_samples = 0.0, 4
        def steps():
            space = full_view(camera=False); yield 1.0
            yield from settled()
            whole = view_picture().copy()
            space.clip_end = 7; yield 0.6
            yield from settled()
            result(view=np.abs(view_picture() - whole).mean(), clip=viewport().view.camera['clip'][1])
            space.clip_end, s.camera.data.clip_end = 1000, 6
            space.region_3d.view_perspective = 'CAMERA'; yield 0.6
            yield from settled()
            whole = view_picture().copy()
            s.camera.data.clip_end = 100; yield 0.6
            yield from settled()
            result(camera=np.abs(view_picture() - whole).mean())
        drive(steps)
        """
    )
    assert found["clip"] == 7.0 and found["view"] > 1e-3 and found["camera"] > 1e-3, found


@pytest.mark.slow
def test_escape_cancels_a_final_render(in_window: Run) -> None:
    if shutil.which("xdotool") is None:
        pytest.skip("xdotool is not installed")
    found = in_window(
        """
        import afterglow, os, subprocess, time
        s = scene(640, 480, samples=1 << 20)
        def steps():
            yield 0.5
            with in_view(): bpy.ops.render.render('INVOKE_DEFAULT')
            yield 2.0
            result(began=bpy.app.is_job_running('RENDER'))
            subprocess.run(['xdotool', 'key', 'Escape'], check=True)
            end = time.time() + 20
            while bpy.app.is_job_running('RENDER') and time.time() < end: yield 0.05
            while afterglow.statistics(s) is None and time.time() < end: yield 0.05
            statistics = afterglow.statistics(s)
            result(goes_on=bpy.app.is_job_running('RENDER'), cancelled=statistics['cancelled'],
                   samples=statistics['samples'])
            os._exit(0)  # after a cancelled render Blender's own code is 1
        drive(steps)
        """
    )
    assert found["began"] and not found["goes_on"] and found["cancelled"] and found["samples"] > 0, found
