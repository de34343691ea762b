# SPDX-License-Identifier: GPL-3.0-or-later
"""Every kind of image that Blender knows, as a texture, against what Cycles shows of the same file: files of all formats, tiles,
packed, generated, painted and missing ones."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

# Needs nothing but bpy, so that it runs in official Blenders, too.
SCRIPT = """
import os, tempfile
folder = tempfile.mkdtemp()
for thing in list(bpy.data.objects):
    bpy.data.objects.remove(thing)
s = bpy.context.scene

def pixels(color):
    return np.tile(np.array([*color, 1], np.float32), 64)

def load(name, color, kind='PNG'):
    image = bpy.data.images.new(name, 8, 8)
    image.pixels.foreach_set(pixels(color))
    image.filepath_raw, image.file_format = os.path.join(folder, name), kind
    image.save()
    bpy.data.images.remove(image)
    return bpy.data.images.load(os.path.join(folder, name))

images = {'png': load('f.png', (1, 0, 0)), 'jpg': load('f.jpg', (0, 1, 0), 'JPEG'), 'exr': load('f.exr', (0, 0, 1), 'OPEN_EXR'),
          'tif': load('f.tif', (0, 0.5, 0), 'TIFF'), 'hdr': load('f.hdr', (0.5, 0, 0), 'HDR')}
packed = images['packed'] = load('p.png', (1, 0, 1))
packed.pack()
os.remove(os.path.join(folder, 'p.png'))
generated = images['generated'] = bpy.data.images.new('generated', 8, 8)
generated.generated_color = (0, 1, 0, 1)
painted = images['painted'] = bpy.data.images.new('painted', 8, 8)
painted.pixels.foreach_set(pixels((0, 0, 1)))
painted.update()
bright = images['float'] = bpy.data.images.new('float', 8, 8, float_buffer=True)
bright.generated_color = (2, 1, 0, 1)
load('u.1002.png', (0, 1, 1))
tiles = images['tiles'] = load('u.1001.png', (1, 1, 0))
tiles.source, tiles.filepath = 'TILED', os.path.join(folder, 'u.<UDIM>.png')
if len(tiles.tiles) < 2:
    tiles.tiles.new(1002)
missing = images['missing'] = load('m.png', (1, 1, 1))
missing.filepath = os.path.join(folder, 'nowhere.png')

world = s.world = bpy.data.worlds.new('w')
world.use_nodes = True
world.node_tree.nodes['Background'].inputs[1].default_value = 0
for i, (name, image) in enumerate(images.items()):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([(i, 0, 0), (i + 1, 0, 0), (i + 1, 1, 0), (i, 1, 0)], [], [(0, 1, 2, 3)])
    wide = 2 if name == 'tiles' else 1
    mesh.uv_layers.new().data.foreach_set('uv', np.array([0, 0, wide, 0, wide, 1, 0, 1], np.float32))
    s.collection.objects.link(bpy.data.objects.new(name, mesh))
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    texture, shader, output = (tree.nodes.new('ShaderNode' + kind) for kind in ('TexImage', 'Emission', 'OutputMaterial'))
    texture.image = image
    tree.links.new(texture.outputs[0], shader.inputs[0])
    tree.links.new(shader.outputs[0], output.inputs[0])
    mesh.materials.append(material)
camera = bpy.data.cameras.new('c')
camera.type, camera.ortho_scale = 'ORTHO', len(images)
s.camera = bpy.data.objects.new('c', camera)
s.camera.location = (len(images) / 2, 0.5, 5)
s.collection.objects.link(s.camera)
r = s.render
r.resolution_x, r.resolution_y, r.resolution_percentage = 16 * len(images), 16, 100
r.use_compositing = r.use_sequencer = False
r.image_settings.file_format, r.image_settings.color_depth = 'OPEN_EXR', '32'

def shot(engine):
    r.engine = engine
    if engine == 'AFTERGLOW':
        s.afterglow.samples, s.afterglow.accuracy, s.afterglow.denoise = 16, 0, False
    else:
        s.cycles.samples, s.cycles.use_denoising = 16, False
    r.filepath = os.path.join(folder, engine + '.exr')
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(r.filepath)
    image.colorspace_settings.name = 'Non-Color'
    values = np.empty(16 * r.resolution_x * 4, np.float32)
    image.pixels.foreach_get(values)
    values = values.reshape(16, -1, 4)[5:11, :, :3].mean(0)
    parts = {name: [(16 * i + 3, 16 * i + 13)] for i, name in enumerate(images)}
    parts['tiles'] = [(a + b * 8 + 2, a + b * 8 + 6) for b in (0, 1) for a in [16 * list(images).index('tiles')]]
    return {name: [values[a:b].mean(0).tolist() for a, b in ranges] for name, ranges in parts.items()}

result(ours=shot('AFTERGLOW'), cycles=shot('CYCLES'))
"""


def check(found: dict[str, Any]) -> None:
    assert len(found["ours"]) == 11
    for name, colors in found["cycles"].items():
        assert np.allclose(found["ours"][name], colors, rtol=0.01, atol=0.002), name
    assert np.allclose(found["ours"]["png"], [[1, 0, 0]], atol=1e-3)  # and Cycles' are what was asked for
    assert np.allclose(found["ours"]["tiles"], [[1, 1, 0], [0, 1, 1]], atol=1e-3)
    assert np.allclose(found["ours"]["missing"], [[1, 0, 1]], atol=1e-3)
    assert "nowhere.png" in found["output"]


def test_every_kind_of_image_is_what_cycles_shows(in_blender: Callable[..., dict[str, Any]]) -> None:
    check(in_blender(SCRIPT))
