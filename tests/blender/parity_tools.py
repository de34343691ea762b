# SPDX-License-Identifier: GPL-3.0-or-later
"""Inside Blender: small scenes rendered by Cycles and by Afterglow, compared as a whole and block by block with the errors
that several seeds show. Not a test by itself; test_parity.py says which scenes."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any

import bpy
import numpy as np
from inside import image_format, load
from mathutils import Vector

SIZE = (48, 36)
BLOCK = 6


def start(world: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Any:
    """An empty scene of SIZE pixels under an even sky, both engines at their plainest."""
    for ob in list(bpy.data.objects):
        bpy.data.objects.remove(ob)
    scene = bpy.context.scene
    render = scene.render
    render.resolution_x, render.resolution_y = SIZE
    render.resolution_percentage = 100
    render.use_border = render.use_crop_to_border = render.film_transparent = False
    render.pixel_aspect_x = 1.0
    sky = bpy.data.worlds.new("Sky")
    sky.use_nodes = True
    sky.node_tree.nodes["Background"].inputs[0].default_value = (*world, 1.0)
    scene.world = sky
    cycles = scene.cycles
    cycles.use_denoising = cycles.use_adaptive_sampling = False
    cycles.blur_glossy = cycles.light_sampling_threshold = 0.0
    scene.afterglow.accuracy, scene.afterglow.denoise, scene.afterglow.method = 0.0, False, "PATH_TRACING"
    return scene


def add(name: str, data: Any, **values: Any) -> Any:
    ob = bpy.data.objects.new(name, data)
    for key, value in values.items():
        setattr(ob, key, value)
    bpy.context.scene.collection.objects.link(ob)
    return ob


def camera(at: tuple[float, ...] = (0, -5, 1.2), to: tuple[float, ...] = (0, 0, 0.6), lens: float = 40.0) -> Any:
    ob = add("Camera", bpy.data.cameras.new("Camera"), location=at)
    ob.data.lens = lens
    ob.rotation_euler = (Vector(to) - Vector(at)).to_track_quat("-Z", "Y").to_euler()
    bpy.context.scene.camera = ob
    return ob


def material(build: Callable[[Any], Any] | None = None, emits: bool = False) -> Any:
    """Diffuse, or emission; build(tree) → socket that is its colour (diffuse: a node whose normal is taken)."""
    made = bpy.data.materials.new("Material")
    made.use_nodes = True
    tree = made.node_tree
    tree.nodes.clear()
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    shader = tree.nodes.new("ShaderNodeEmission" if emits else "ShaderNodeBsdfDiffuse")
    tree.links.new(shader.outputs[0], output.inputs[0])
    if build is not None:
        tree.links.new(build(tree), shader.inputs["Color" if emits else "Normal"])
    return made


def floor(size: float = 4.0) -> Any:
    mesh = bpy.data.meshes.new("Floor")
    mesh.from_pydata([(-size, -size, 0), (size, -size, 0), (size, size, 0), (-size, size, 0)], [], [(0, 1, 2, 3)])
    mesh.materials.append(material())
    return add("Floor", mesh)


def ball(name: str = "Ball", mirrored: bool = False, **values: Any) -> Any:
    """A smooth sphere with UVs; mirrored: its second half has those of the first the other way round."""
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.8, segments=24, ring_count=12)
    ob = bpy.context.object
    ob.name = name
    for polygon in ob.data.polygons:
        polygon.use_smooth = True
    if mirrored:
        for loop in ob.data.uv_layers.active.data:
            loop.uv[0] = abs(loop.uv[0] - 0.5) * 2
    for key, value in values.items():
        setattr(ob, key, value)
    return ob


def light(kind: str, **values: Any) -> Any:
    data = bpy.data.lights.new(kind, kind)
    data.energy = 3.0 if kind == "SUN" else 100.0
    own = {key: values.pop(key) for key in ("location", "rotation_euler", "scale") if key in values}
    for key, value in values.items():
        if key != "use_soft_falloff" or hasattr(data, key):
            setattr(data, key, value)
    return add(kind, data, **{"location": (0.3, 0.2, 1.5), "rotation_euler": (0.3, 0.2, 0.4), **own})


def shot(engine: str, seed: int, samples: int, bounces: int) -> np.ndarray:
    scene = bpy.context.scene
    scene.render.engine = engine
    own = scene.cycles if engine == "CYCLES" else scene.afterglow
    own.samples, own.seed = samples, seed
    for name in ("max_bounces", "diffuse_bounces", "glossy_bounces", "transmission_bounces"):
        setattr(own, name, bounces)
    own.sample_clamp_direct = own.sample_clamp_indirect = 0.0
    image_format(scene, "OPEN_EXR")
    scene.render.image_settings.color_mode = "RGBA"
    scene.render.filepath = os.path.join(os.path.dirname(os.environ["AFTERGLOW_RESULT"]), "shot.exr")
    bpy.ops.render.render(write_still=True)
    return load(scene.render.filepath).astype(np.float64)


def blocks(images: np.ndarray) -> np.ndarray:
    count, height, width = images.shape[:3]
    height, width = height // BLOCK * BLOCK, width // BLOCK * BLOCK
    cut = images[:, :height, :width]
    return cut.reshape(count, height // BLOCK, BLOCK, width // BLOCK, BLOCK, -1).mean((2, 4))


def compare(samples: int = 32, seeds: int = 4, bounces: int = 0, most: float = 1e9) -> dict[str, float]:
    """mean, error: ours over Cycles' and its standard error; block: the worst block's difference beyond five standard errors,
    over the image's mean. most: brighter than this counts as this (what a pixel sees of a lamp)."""
    ours = np.stack([shot("AFTERGLOW", seed, samples, bounces) for seed in range(1, seeds + 1)])
    theirs = np.stack([shot("CYCLES", seed, samples, bounces) for seed in range(1, seeds + 1)])
    if ours.shape != theirs.shape:
        return {"mean": float("nan"), "error": 0.0, "block": float("inf")}
    ours, theirs = ours.clip(0, most), theirs.clip(0, most)
    level = theirs[..., :3].mean()
    a, b = ours[..., :3].mean((1, 2, 3)), theirs[..., :3].mean((1, 2, 3))
    error = float(np.hypot(a.std(ddof=1), b.std(ddof=1)) / seeds**0.5 / level)
    x, y = blocks(ours), blocks(theirs)
    variance = (x.var(0, ddof=1) + y.var(0, ddof=1)) / seeds
    spread = np.sqrt(variance + variance.mean())  # four seeds alone may agree by chance
    beyond = np.maximum(np.abs(x.mean(0) - y.mean(0)) - 5 * spread, 0.0).max()
    return {"mean": float(a.mean() / level), "error": error, "block": float(beyond / level)}
