# SPDX-License-Identifier: GPL-3.0-or-later
"""Final renders in Blender: what part of the image, which passes, which layers; what the file says about the render."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

Run = Callable[..., dict[str, Any]]


@pytest.fixture
def box(blend_files: Path) -> Path:
    return blend_files / "cornell_box.blend"


@pytest.mark.parametrize("method", ["PATH_TRACING", "INSTANT_RADIOSITY", "INSTANT_CACHE", "HASH_CACHE"])
def test_picture_and_statistics(in_blender: Run, box: Path, method: str) -> None:
    found = in_blender(
        f"""
        import afterglow
        s = scene(samples=16, method={method!r})
        picture = render()
        stats = afterglow.statistics(s)
        result(finite=bool(np.isfinite(picture).all()), least=picture.min(), mean=picture[..., :3].mean(),
               spread=picture[..., :3].std(), stats={{k: stats[k] for k in ('method', 'samples', 'threads', 'dropped')}},
               seconds=stats['seconds'], rays=stats['rays'], wall=stats['wall_time'])
        """,
        box,
    )
    assert found["finite"] and found["least"] >= 0
    assert found["mean"] > 0.02 and found["spread"] > 0.02
    assert found["stats"]["method"] == method and found["stats"]["samples"] == 16
    assert {"sync", "commit"} <= set(found["seconds"]) and found["wall"] >= found["seconds"]["sync"]
    assert sum(found["rays"].values()) > 96 * 64 * 16


def test_same_pixels_on_any_number_of_threads(in_blender: Run, box: Path) -> None:
    found = in_blender(
        """
        scene(threads=1); one = render()
        scene(threads=2); two = render()
        result(difference=np.abs(one - two).max())
        """,
        box,
    )
    assert found["difference"] == 0


def test_border_is_the_same_part_of_the_whole(in_blender: Run, box: Path) -> None:
    found = in_blender(
        """
        s = scene(64, 48)
        whole = render()
        r = s.render
        r.use_border = True
        r.border_min_x, r.border_max_x, r.border_min_y, r.border_max_y = 0.25, 0.75, 0.5, 1.0
        r.use_crop_to_border = True
        cropped = render()
        r.use_crop_to_border = False
        uncropped = render()
        part = whole[24:48, 16:48]
        result(shapes=[whole.shape, cropped.shape, uncropped.shape], cropped=np.abs(cropped - part).max(),
               inside=np.abs(uncropped[24:48, 16:48] - part).max(), outside=np.abs(uncropped[:24]).max())
        """,
        box,
    )
    assert found["shapes"] == [[48, 64, 4], [24, 32, 4], [48, 64, 4]]
    # the pixel filter spreads samples over the border's edge alone
    assert found["cropped"] == 0 and found["inside"] == 0 and found["outside"] == 0


def test_resolution_scale_and_odd_sizes(in_blender: Run, box: Path) -> None:
    found = in_blender(
        """
        s = scene(97, 61, samples=1)
        sizes = [render().shape[:2]]
        s.render.resolution_percentage = 50
        sizes.append(render().shape[:2])
        s.render.resolution_percentage = 200
        sizes.append(render().shape[:2])
        result(sizes=sizes)
        """,
        box,
    )
    assert found["sizes"] == [[61, 97], [30, 48], [122, 194]]


def test_transparent_film(in_blender: Run) -> None:
    found = in_blender(
        """
        s = scene(48, 32)
        opaque = render()
        s.render.film_transparent = True
        clear = render()
        result(opaque=opaque[..., 3].min(), corner=clear[0, 0].tolist(), middle=clear[16, 24, 3])
        """
    )
    assert found["opaque"] == 1.0
    assert found["corner"] == [0, 0, 0, 0]
    assert found["middle"] == pytest.approx(1.0)


def test_passes_by_the_names_of_the_running_cycles(in_blender: Run, box: Path) -> None:
    found = in_blender(
        """
        import os
        passes = addon('passes')
        s, layer = scene(64, 48, samples=16), bpy.context.view_layer
        for item in passes.PASSES:
            setattr(layer, item.switch, True)
        folder = os.path.dirname(os.environ['AFTERGLOW_RESULT'])
        def write(name):
            image_format(s, 'OPEN_EXR_MULTILAYER')
            s.render.filepath = os.path.join(folder, name)
            bpy.ops.render.render(write_still=True)
        write('ours.exr')
        s.render.engine = 'CYCLES'
        s.cycles.samples, s.cycles.use_denoising = 1, False
        write('theirs.exr')
        result(folder=folder, names={item.native: item.name for item in (*passes.PASSES, passes.COMBINED)})
        """,
        box,
    )
    oiio = pytest.importorskip("OpenImageIO")
    folder = Path(found["folder"])
    ours, theirs = (channels(oiio, folder / name) for name in ("ours.exr", "theirs.exr"))
    assert set(ours) == set(theirs)
    layer = next(iter(ours)).split(".")[0]

    def light(native: str) -> Any:
        return np.stack([ours[f"{layer}.{found['names'][native]}.{c}"] for c in "RGB"])

    total = light("emission") + light("environment")
    for lobe in ("diffuse", "glossy", "transmission"):
        total = total + (light(f"{lobe}_direct") + light(f"{lobe}_indirect")) * light(f"{lobe}_color")
    difference = abs(total - light("combined"))
    assert difference.max() <= 1e-3 * max(1.0, light("combined").max())


def channels(oiio: Any, path: Path) -> dict[str, Any]:
    """Every channel of a multi-layer file by its name, in files of one part and of many."""
    found: dict[str, Any] = {}
    image, part = oiio.ImageInput.open(str(path)), 0
    while image.seek_subimage(part, 0):
        names = image.spec().channelnames
        pixels = image.read_image(part, 0, 0, len(names), oiio.FLOAT)
        found.update({name: pixels[..., number] for number, name in enumerate(names)})
        part += 1
    return found


def test_view_layers_render_apart(in_blender: Run) -> None:
    found = in_blender(
        """
        import afterglow, os
        s = scene(48, 32, samples=4)
        cube = bpy.data.objects['Cube']
        extra = bpy.data.collections.new('Extra')
        s.collection.children.link(extra)
        cube.users_collection[0].objects.unlink(cube); extra.objects.link(cube)
        s.render.film_transparent = True
        second = s.view_layers.new('Empty')
        second.layer_collection.children['Extra'].exclude = True
        seen = {}
        image_format(s, 'OPEN_EXR_MULTILAYER')
        s.render.filepath = os.path.join(os.path.dirname(os.environ['AFTERGLOW_RESULT']), 'layers.exr')
        bpy.ops.render.render(write_still=True)
        result(layers=[l.name for l in s.view_layers], path=s.render.filepath,
               statistics=[bool(afterglow.statistics(s, l.name)) for l in s.view_layers])
        """
    )
    oiio = pytest.importorskip("OpenImageIO")
    found_channels = channels(oiio, Path(found["path"]))
    assert found["statistics"] == [True, True]
    assert found_channels["ViewLayer.Combined.A"].max() > 0.9
    assert found_channels["Empty.Combined.A"].max() == 0


def test_metadata_says_what_the_render_did(in_blender: Run, box: Path) -> None:
    found = in_blender(
        """
        import os
        scene(samples=4); render('stamped.exr')
        result(path=os.path.join(os.path.dirname(os.environ['AFTERGLOW_RESULT']), 'stamped.exr'))
        """,
        box,
    )
    oiio = pytest.importorskip("OpenImageIO")
    spec = oiio.ImageInput.open(found["path"]).spec()
    fields = {item.name: item.value for item in spec.extra_attribs if item.name.startswith("afterglow.")}
    layer = next(iter(fields)).split(".")[1]
    assert fields[f"afterglow.{layer}.method"] == "PATH_TRACING" and fields[f"afterglow.{layer}.samples"] == "4"


def test_stereo_is_refused_clearly(in_blender: Run, box: Path) -> None:
    found = in_blender(
        """
        s = scene(); s.render.use_multiview = True
        text = ''
        try:
            bpy.ops.render.render()
        except RuntimeError as error:
            text = str(error)
        result(text=text)
        """,
        box,
        check=False,
    )
    assert "stereoscopic" in found["text"] + found["output"]


def test_a_failure_is_told_and_the_next_render_works(in_blender: Run, box: Path) -> None:
    found = in_blender(
        """
        final, backend = addon('final'), addon('backend')
        scene(); good = render()
        real = final.run
        def broken(*a, **k): raise backend.afterglow.Error("mesh 'Tall Box' holds a thing that cannot be")
        final.run = broken
        text = ''
        try:
            bpy.ops.render.render()
        except RuntimeError as error:
            text = str(error)
        final.run = real
        result(text=text, again=np.abs(render() - good).max())
        """,
        box,
        check=False,
    )
    assert "Tall Box" in found["text"] + found["output"]
    assert found["again"] == 0


def test_a_file_without_a_camera_ends_cleanly(in_blender: Run) -> None:
    found = in_blender(
        """
        s = scene(); s.camera = None
        try:
            bpy.ops.render.render()
        except RuntimeError as error:
            result(text=str(error))
        result(alive=True)
        """,
        check=False,
    )
    assert found["alive"]
    assert "camera" in (found.get("text", "") + found["output"]).lower()


def test_empty_scene_renders(in_blender: Run) -> None:
    found = in_blender(
        """
        for thing in list(bpy.data.objects):
            if thing.type != 'CAMERA':
                bpy.data.objects.remove(thing)
        scene(16, 16, samples=2)
        world = render()
        bpy.context.scene.world = None
        result(world=world[..., :3].mean(), nothing=render()[..., :3].max())
        """
    )
    assert found["world"] > 0
    assert found["nothing"] == 0


@pytest.mark.slow
def test_cancel_is_obeyed_within_50_ms(in_blender: Run, box: Path) -> None:
    found = in_blender(
        """
        import time
        passes, final = addon('passes'), addon('final')
        s = scene(640, 480, samples=1 << 20)
        delays = []
        for trial in range(8):
            wish = time.perf_counter() + 0.35 + 0.04 * trial
            native = addon('native_scene').NativeScene()
            class Engine:
                '''The render engine's face towards `final.run`, with a user who cancels.'''
                is_preview = False
                def __getattr__(self, name): return lambda *a, **k: None
                def test_break(self): return time.perf_counter() > wish
                def begin_result(self, *a, **k):
                    class Layer: passes = []
                    class Result: layers = [Layer]
                    return Result()
            depsgraph = bpy.context.evaluated_depsgraph_get()
            engine = Engine(); engine.resolution_x, engine.resolution_y = 640, 480
            engine.camera_override = None
            native.sync.sync(depsgraph)
            view = final.sync_camera_final(engine, depsgraph)
            native.scene.set_camera(**view.camera); native.scene.commit()
            settings = final.session_settings(s, viewport=False)
            settings.update(width=640, height=480, region=(0, 0, 640, 480), passes=['combined'])
            session = final.backend.afterglow.Session(native.scene, settings)
            cancelled, _ = final.run(engine, session, [passes.COMBINED], (0, 0, 640, 480), 'x', '')
            delays.append(time.perf_counter() - wish)
            assert cancelled
        result(delays=delays)
        """,
        box,
    )
    delays = sorted(found["delays"])
    assert delays[len(delays) // 2] < 0.05, delays
    assert delays[-1] < 0.25, delays  # a busy machine may be late once


def test_nothing_of_a_render_stays_in_memory(in_blender: Run, box: Path) -> None:
    """The native scene goes with the render, not with Python's next search for cycles."""
    found = in_blender(
        """
        import gc, weakref
        made, native_scene = [], addon('native_scene')
        first = native_scene.NativeScene.__init__
        def init(self):
            first(self)
            made.extend(weakref.ref(part) for part in (self, self.sync, self.sync.objects, self.sync.materials))
        native_scene.NativeScene.__init__ = init
        gc.disable()
        s = scene(samples=1)
        one, two = render(), render()
        alive = [str(ref()) for ref in made if ref() is not None]
        s.render.use_persistent_data = True
        render()
        kept = sum(ref() is not None for ref in made)
        result(made=len(made), alive=alive, kept=kept, difference=np.abs(one - two).max())
        """,
        box,
    )
    assert found["alive"] == [] and found["made"] == 12
    assert found["kept"] == 4 and found["difference"] == 0


def test_what_cannot_be_rendered_is_left_out_with_a_warning_that_names_it(in_blender: Run) -> None:
    found = in_blender(
        """
        import os
        from importlib import import_module
        store = addon('store')
        s = scene(32, 24, samples=2)
        cube, light = bpy.data.objects['Cube'], bpy.data.lights[0]
        pictures, warned = [], {}
        def look(name):
            pictures.append(render())
            warned[name] = store.statistics(s)['warnings']
        light.energy = float('nan'); look('light'); light.energy = 100
        kept = cube.data.vertices[0].co.copy()
        cube.data.vertices[0].co = (float('nan'),) * 3; look('mesh'); cube.data.vertices[0].co = kept
        cube.scale = (0, 0, 0); look('transform'); cube.scale = (1, 1, 1)
        cube.is_shadow_catcher = True
        camera = s.camera.data
        camera.type = 'PANO'
        (camera if hasattr(camera, 'panorama_type') else camera.cycles).panorama_type = 'FISHEYE_EQUIDISTANT'
        glass = cube.active_material.node_tree
        absorption = glass.nodes.new('ShaderNodeVolumeAbsorption')
        output = next(n for n in glass.nodes if n.type == 'OUTPUT_MATERIAL')
        hull = glass.links.new(absorption.outputs[0], output.inputs['Volume'])
        bpy.context.view_layer.use_pass_cryptomatte_object = True
        tree = s.world.node_tree
        volume = tree.nodes.new('ShaderNodeVolumeScatter')
        tree.links.new(volume.outputs[0], next(n for n in tree.nodes if n.type == 'OUTPUT_WORLD').inputs['Volume'])
        look('unsupported')
        camera.type = 'PERSP'
        glass.links.remove(hull)
        broken = os.path.join(os.path.dirname(os.environ['AFTERGLOW_RESULT']), 'broken.png')
        with open(broken, 'wb') as file: file.write(b'\\x89PNG\\r\\n\\x1a\\nno picture')
        for name, path in (('broken', broken), ('missing', broken + '.no')):
            image = bpy.data.images.new(name, 4, 4); image.source = 'FILE'; image.filepath = path
            nodes = cube.active_material.node_tree
            texture = nodes.nodes.new('ShaderNodeTexImage'); texture.image = image
            nodes.links.new(texture.outputs[0], nodes.nodes['Principled BSDF'].inputs['Base Color'])
            look(name)
        result(finite=all(bool(np.isfinite(p).all()) for p in pictures), warned=warned,
               magenta=[p[12, 16].tolist() for p in pictures[-2:]])
        """
    )
    assert found["finite"]
    said = {name: "\n".join(texts) for name, texts in found["warned"].items()}
    assert "Light" in said["light"] and "left out" in said["light"]
    assert "Cube" in said["mesh"] and "Cube" in said["transform"]
    for words in ("shadow catcher", "Cryptomatte", "World 'World'", "Camera 'Camera'", "(object 'Cube'): volumes"):
        assert words in said["unsupported"], said
    assert all("'" in text or '"' in text for texts in found["warned"].values() for text in texts), "a warning without a name"
    assert "broken" in said["broken"] and "missing" in said["missing"]
    for red, green, blue, _ in found["magenta"]:
        assert min(red, blue) > 3 * green, found
