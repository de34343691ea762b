# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes about one thing each: a sky and the sun, transparency and blinds, every kind of light, a row of materials."""

from __future__ import annotations

import math

import numpy as np

from .description import Camera, Description, Light, Node, Picture, look_at, node, rotate, scale, translate
from .rooms import background, cornell_box, diffuse, emission, noise_picture
from .shapes import box, bunny, grid, join, quad, sphere, statue, transformed


def sky_picture(width: int = 64, height: int = 32) -> Picture:
    """A sky by formula: blue above, hazy at the horizon, brown below, a bright patch around a hidden sun."""
    latitude = (np.arange(height) + 0.5)[:, None] / height * math.pi - math.pi / 2
    longitude = (np.arange(width) + 0.5)[None] / width * 2 * math.pi - math.pi
    up = np.sin(latitude) * np.ones_like(longitude)
    haze = np.exp(-6 * np.abs(up))[..., None]
    sky = np.array([0.25, 0.45, 0.9]) * (1 - haze) + np.array([0.9, 0.85, 0.75]) * haze
    ground = np.array([0.22, 0.18, 0.14]) * np.ones_like(sky)
    sun = np.array([math.cos(0.6) * math.cos(0.9), math.cos(0.6) * math.sin(0.9), math.sin(0.6)])
    direction = np.stack([np.cos(latitude) * np.cos(longitude), np.cos(latitude) * np.sin(longitude), up], -1)
    glow = np.exp(30 * (direction @ sun - 1))[..., None] * np.array([12.0, 10.0, 7.0])
    pixels = np.ones((height, width, 4), np.float32)
    pixels[..., :3] = np.where(up[..., None] > 0, sky + glow, ground)
    return Picture(pixels, "linear")


def sun_and_sky(sun: bool = True) -> Description:
    """A statue, a bunny and some blocks on a field, lit by a picture of a sky and by the sun."""
    scene = Description("sun_and_sky", Camera(look_at((0.3, -5.5, 1.9), (0, 0, 0.75)), math.radians(36)), resolution=(320, 180))
    scene.materials.update(ground=diffuse((0.35, 0.33, 0.25)), stone=diffuse((0.7, 0.66, 0.6), 0.5),
                           brick=diffuse((0.55, 0.2, 0.12)),
                           lacquer=node("principled", base_color=(0.5, 0.05, 0.08), roughness=0.2))
    scene.images["sky"] = sky_picture()
    scene.world = background(node("environment_texture", {"image": "sky"}))
    scene.add("Ground", grid(40, 40, 8, 8), "ground")
    scene.add("Statue", statue(40, 64), "stone", transform=translate((-0.9, 0.2, 0)) @ scale(1.7))
    scene.add("Bunny", bunny(14), "lacquer", transform=translate((0.9, -0.4, 0)) @ rotate(-1.9) @ scale(0.9))
    scene.add("Block", box((-0.5, -0.5, 0), (0.5, 0.5, 1.4)), "brick", transform=translate((0.4, 1.3, 0)) @ rotate(0.5))
    if sun:
        toward = (math.cos(0.6) * math.cos(0.9), math.cos(0.6) * math.sin(0.9) - 1.2, math.sin(0.6))
        scene.lights = [Light("Sun", "sun", look_at(toward, (0, 0, 0)), 2.5, (1, 0.93, 0.8), angle=math.radians(2))]
    return scene


def transparency() -> Description:
    """Blinds before a lamp, a veil of mixed transparency, a leaf cut out by an image's alpha, coloured panes, alpha 0.5."""
    scene = cornell_box("emissive")
    scene.name = "transparency"
    scene.objects = [o for o in scene.objects if o.name != "Tall"]
    leaf = noise_picture(64, 9, (0.2, 0.55, 0.15), 0.5)
    y, x = np.mgrid[0:64, 0:64] / 31.5 - 1
    leaf.pixels[..., 3] = (x**2 + y**2 < 0.3 + 0.25 * np.cos(5 * np.arctan2(y, x))).astype(np.float32)
    scene.images["leaf"] = leaf
    image = node("image_texture", {"image": "leaf", "interpolation": "linear"}, vector=node("texture_coordinate").out("uv"))
    scene.materials["leaf"] = node("principled", base_color=image.out("color"), alpha=image.out("alpha"), roughness=0.8)
    scene.materials["veil"] = node("mix_shader", fac=0.4, shader=node("transparent_bsdf", color=(1.0, 1.0, 1.0)),
                                   shader_001=diffuse((0.9, 0.3, 0.4)))
    scene.materials["pane"] = node("transparent_bsdf", color=(0.35, 0.55, 0.95))
    scene.materials["ghost"] = node("principled", base_color=(0.8, 0.8, 0.3), roughness=0.9, alpha=0.5)
    scene.materials["slat"] = node("mix_shader", fac=0.5, shader=diffuse((0.85, 0.8, 0.7)),
                                   shader_001=node("translucent_bsdf", color=(0.85, 0.8, 0.7)))
    slat = quad((-0.9, -0.06, 0), (0.9, -0.06, 0), (0.9, 0.06, 0), (-0.9, 0.06, 0))
    blinds = join(*[transformed(slat, translate((0, -0.7 + 0.14 * i, 1.6)) @ rotate(0.6, "x")) for i in range(11)])
    scene.add("Blinds", blinds, "slat")
    scene.add("Leaf", quad((-0.35, 0, -0.35), (0.35, 0, -0.35), (0.35, 0, 0.35), (-0.35, 0, 0.35)), "leaf",
              transform=translate((-0.5, -0.2, 0.6)) @ rotate(0.3))
    scene.add("Veil", quad((-0.9, 0.5, 0), (-0.1, 0.6, 0), (-0.1, 0.6, 1.3), (-0.9, 0.5, 1.3)), "veil")
    scene.add("Pane", quad((0.05, -0.7, 0), (0.75, -0.75, 0), (0.75, -0.75, 0.9), (0.05, -0.7, 0.9)), "pane")
    scene.add("Ghost", sphere(0.22, 32, 16), "ghost", transform=translate((0.35, -0.35, 0.8)))
    return scene


def area_lights() -> Description:
    """Every kind of light once: point, spot, sun, square, rectangle, disk, ellipse, a narrow spread, an emissive mesh."""
    scene = Description("area_lights", Camera(look_at((0, -7.2, 4.6), (0, -0.1, 0.5)), math.radians(58)), resolution=(320, 180))
    scene.materials.update(floor=diffuse((0.6, 0.6, 0.6)), wall=diffuse((0.7, 0.65, 0.6)), peg=diffuse((0.5, 0.55, 0.7)),
                           glow=emission(8.0, (0.4, 1.0, 0.5)))
    scene.add("Floor", quad((-4, -3, 0), (4, -3, 0), (4, 2, 0), (-4, 2, 0)), "floor")
    scene.add("Wall", quad((-4, 2, 0), (4, 2, 0), (4, 2, 4), (-4, 2, 4)), "wall")
    kinds = [
        dict(kind="point", power=30, radius=0.1, color=(1, 0.6, 0.5)),
        dict(kind="point", power=30, radius=0.0, color=(0.6, 1, 0.6)),
        dict(kind="spot", power=120, radius=0.05, spot_size=1.0, spot_blend=0.3, color=(0.6, 0.7, 1)),
        dict(kind="area", power=25, shape="square", size=(0.6, 0.6), color=(1, 1, 0.6)),
        dict(kind="area", power=25, shape="rectangle", size=(0.9, 0.15), color=(1, 0.6, 1)),
        dict(kind="area", power=25, shape="disk", size=(0.7, 0.7), color=(0.6, 1, 1)),
        dict(kind="area", power=25, shape="ellipse", size=(0.9, 0.4), color=(1, 0.8, 0.6)),
        dict(kind="area", power=12, shape="square", size=(0.4, 0.4), spread=math.radians(40), color=(0.8, 0.8, 1)),
    ]
    for i, values in enumerate(kinds):
        x, y = -3 + 2 * (i % 4), -1.2 + 1.9 * (i // 4)
        scene.lights.append(Light(f"Light {i + 1}", transform=look_at((x, y, 1.5), (x + 0.2, y + 0.1, 0), (0, 1, 0)), **values))  # type: ignore[arg-type]
        scene.add(f"Peg {i + 1}", box((-0.08, -0.08, 0), (0.08, 0.08, 0.5)), "peg", transform=translate((x + 0.3, y - 0.2, 0)))
    scene.add("Lamp", sphere(0.15, 16, 8), "glow", transform=translate((0, -2.2, 0.5)))
    scene.lights.append(Light("Sun", "sun", look_at((1, -2, 3), (0, 0, 0)), 0.15, angle=math.radians(5)))
    return scene


def materials() -> Description:
    """Twelve balls, each of another material, under a sky: what the Principled node can do and the plain lobes."""
    scene = Description("materials", Camera(look_at((0, -9.5, 5.2), (0, 0, 0.45)), math.radians(50)), resolution=(320, 180))
    scene.images["sky"] = sky_picture()
    scene.world = background(node("environment_texture", {"image": "sky"}))
    scene.materials["ground"] = diffuse((0.4, 0.4, 0.4))
    scene.add("Ground", grid(30, 30, 4, 4), "ground")
    balls: dict[str, Node] = {
        "diffuse": diffuse((0.7, 0.3, 0.2)), "rough diffuse": diffuse((0.7, 0.3, 0.2), 1.0),
        "translucent": node("translucent_bsdf", color=(0.7, 0.6, 0.2)),
        "plastic": node("principled", base_color=(0.1, 0.3, 0.7), roughness=0.2),
        "satin": node("principled", base_color=(0.1, 0.6, 0.3), roughness=0.6),
        "gold": node("principled", base_color=(1.0, 0.72, 0.3), metallic=1.0, roughness=0.25),
        "rough metal": node("glossy_bsdf", {"distribution": "ggx"}, color=(0.8, 0.8, 0.85), roughness=0.6),
        "mirror": node("glossy_bsdf", {"distribution": "sharp"}, color=(0.9, 0.9, 0.9)),
        "glass": node("glass_bsdf", {"distribution": "ggx"}, color=(0.95, 1.0, 0.97), roughness=0.0, ior=1.5),
        "frosted": node("glass_bsdf", {"distribution": "ggx"}, color=(0.9, 0.9, 1.0), roughness=0.4, ior=1.4),
        "layered": node("mix_shader", fac=node("layer_weight", blend=0.4).out("fresnel"), shader=diffuse((0.5, 0.1, 0.5)),
                        shader_001=node("glossy_bsdf", {"distribution": "ggx"}, color=(1.0, 1.0, 1.0), roughness=0.1)),
        "lamp": node("add_shader", shader=diffuse((0.5, 0.5, 0.5)), shader_001=emission(1.5, (1, 0.7, 0.3))),
    }
    ball = sphere(0.6, 48, 24)
    for i, (name, material) in enumerate(balls.items()):
        scene.materials[name] = material
        item = scene.add(f"Ball {name}", ball, name, transform=translate((-3.4 + 1.36 * (i % 6), -0.8 + 1.8 * (i // 6), 0.6)))
        item.pass_index = i + 1
    return scene
