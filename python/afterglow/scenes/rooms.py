# SPDX-License-Identifier: GPL-3.0-or-later
"""Small rooms: the Cornell box (after Goral et al. 1984) and its variants, furnaces, a sealed box, a door ajar.

The Cornell room is 2 × 2 × 2 m, its front open, the camera before it; the door scene is after Veach (1997, figure 10.5).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from .description import Camera, Color, Description, Light, Node, Object, Picture, look_at, node, rotate, scale, translate
from .shapes import box, bunny, cylinder, join, quad, sphere, statue, transformed

WHITE: Color = (0.725, 0.71, 0.68)
RED: Color = (0.63, 0.065, 0.05)
GREEN: Color = (0.14, 0.45, 0.091)


def diffuse(color: Color, roughness: float = 0.0) -> Node:
    return node("diffuse_bsdf", color=color, roughness=roughness)


def emission(strength: float, color: Color = (1.0, 1.0, 1.0)) -> Node:
    return node("emission", color=color, strength=strength)


def background(color: Any, strength: float = 1.0) -> Node:
    return node("background", color=color, strength=strength)


def _cornell_room(name: str, lamp: str = "area") -> Description:
    """Walls and lamp. lamp: "area" (a light), "mesh" (an emissive quad), "up" (a shaded lamp that lights the ceiling only)."""
    scene = Description(name, Camera(look_at((0, -3.9, 1), (0, 0, 1)), math.radians(39.0)))
    scene.materials.update(white=diffuse(WHITE), red=diffuse(RED), green=diffuse(GREEN))
    walls = join(
        quad((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)),
        quad((-1, 1, 2), (1, 1, 2), (1, -1, 2), (-1, -1, 2)),
        quad((-1, 1, 0), (1, 1, 0), (1, 1, 2), (-1, 1, 2)),
        quad((-1, -1, 0), (-1, 1, 0), (-1, 1, 2), (-1, -1, 2)),
        quad((1, 1, 0), (1, -1, 0), (1, -1, 2), (1, 1, 2)),
        slots=[0, 0, 0, 1, 2],
    )
    scene.add("Walls", walls, "white", "red", "green")
    if lamp == "area":
        transform = look_at((0, 0, 1.98), (0, 0, 0), (0, 1, 0))
        scene.lights.append(Light("Lamp", "area", transform, 25.0, (1, 0.85, 0.6), shape="rectangle", size=(0.6, 0.5)))
    elif lamp == "mesh":
        scene.materials["lamp"] = emission(18.0, (1, 0.85, 0.6))
        scene.add("Lamp", quad((-0.3, 0.25, 1.98), (0.3, 0.25, 1.98), (0.3, -0.25, 1.98), (-0.3, -0.25, 1.98)), "lamp")
    else:
        scene.materials["lamp"], scene.materials["shade"] = emission(40.0, (1, 0.9, 0.7)), diffuse((0.3, 0.3, 0.3))
        lift = translate((0, 0.2, 1.25))
        scene.add("Lamp", transformed(quad((-0.2, -0.2, 0.1), (0.2, -0.2, 0.1), (0.2, 0.2, 0.1), (-0.2, 0.2, 0.1)), lift), "lamp")
        tray = join(
            quad((-0.25, 0.25, 0.05), (0.25, 0.25, 0.05), (0.25, -0.25, 0.05), (-0.25, -0.25, 0.05)),
            *[transformed(quad((-0.25, -0.25, 0.05), (0.25, -0.25, 0.05), (0.25, -0.25, 0.25), (-0.25, -0.25, 0.25)),
                          rotate(i * math.pi / 2)) for i in range(4)],
        )
        scene.add("Shade", transformed(tray, lift), "shade")
    return scene


def _blocks(scene: Description, tall: str = "white", low: str = "white", gap: float = 0.0) -> None:
    """gap: between the floor and the low block, whose top stays where it is."""
    for name, material, place, angle, size in (
        ("Tall", tall, (-0.35, 0.3, 0.0), 0.3, (0.58, 0.58, 1.2)),
        ("Low", low, (0.35, -0.35, gap), -0.29, (0.58, 0.58, 0.58 - gap)),
    ):
        transform = translate(place) @ rotate(angle) @ scale(size) @ translate((0, 0, 0.5))
        scene.add(name, box(), material, transform=transform)


def cornell_box(variant: str = "diffuse", lights: int = 64) -> Description:
    """variant: "diffuse", "glossy", "glass", "textured", "many_lights", "indirect", "statue", "emissive", "mirror"."""
    lamp = {"glossy": "mesh", "emissive": "mesh", "glass": "mesh", "indirect": "up", "mirror": "mesh"}.get(variant, "area")
    scene = _cornell_room("cornell_box" if variant == "diffuse" else f"cornell_{variant}", lamp)
    if variant in ("diffuse", "indirect", "emissive"):
        _blocks(scene)
    elif variant in ("glossy", "mirror"):
        sharp = variant == "mirror"
        scene.materials["metal"] = node("glossy_bsdf", {"distribution": "sharp" if sharp else "ggx"}, color=(0.9, 0.75, 0.45),
                                        roughness=0.0 if sharp else 0.25)
        scene.materials["plastic"] = node("principled", base_color=(0.1, 0.2, 0.7), roughness=0.3)
        scene.materials["polished"] = node("principled", base_color=WHITE, roughness=0.15)
        _blocks(scene, "metal")
        scene.objects[-1].materials = ("plastic",)
        scene.add("Ball", sphere(0.25, 48, 24), "metal", transform=translate((0.4, -0.4, 0.83)))
        if not sharp:
            floor = quad((-1, -1, 0.001), (1, -1, 0.001), (1, 1, 0.001), (-1, 1, 0.001))
            scene.add("Floor", floor, "polished")
    elif variant == "glass":
        scene.materials["glass"] = node("glass_bsdf", {"distribution": "ggx"}, color=(1, 1, 1), roughness=0.0, ior=1.5)
        scene.materials["frosted"] = node("glass_bsdf", {"distribution": "ggx"}, color=(0.8, 0.95, 0.9), roughness=0.3, ior=1.45)
        # From inside, a face in the plane of the floor would be met before or behind it by chance.
        _blocks(scene, low="frosted", gap=0.01)
        scene.add("Ball", sphere(0.3, 64, 32), "glass", transform=translate((0.4, -0.35, 0.89)))
        scene.add("Tall ball", sphere(0.25, 64, 32), "glass", transform=translate((-0.35, 0.3, 1.46)))
    elif variant == "textured":
        _blocks(scene)
        _texture_walls(scene)
    elif variant == "many_lights":
        _blocks(scene)
        scene.lights = _light_grid(lights)
    elif variant == "statue":
        scene.add("Statue", statue(), "white", transform=translate((0, 0.1, 0)) @ scale(1.5))
        scene.frames = (1, 48)
        scene.materials["fur"] = diffuse((0.25, 0.35, 0.6))
        scene.add("Bunny", bunny(21), "fur", move=_around_statue)
    else:
        raise ValueError(f"no Cornell box {variant!r}")
    return scene


def _around_statue(frame: float) -> Any:
    """A hop a quarter turn, once around in 48 frames."""
    t = 2 * math.pi * (frame - 1) / 48
    lift = 0.12 * abs(math.sin(2 * t))
    return translate((0, 0.1, lift)) @ rotate(t) @ translate((0, -0.68, 0)) @ rotate(math.pi / 2) @ scale(0.4)


def floor_room(sheet: str = "mirror") -> Description:
    """A Cornell box whose floor shows its walls, blocks and ball once more. sheet: "mirror", the whole floor; "glass", a pane
    0.12 above a checkered diffuse floor, which is seen refracted through both of its faces."""
    scene = _cornell_room(f"{sheet}_floor", "mesh")
    scene.camera = Camera(look_at((0, -3.7, 1.75), (0, 0, 0.65)), math.radians(39.0))
    _blocks(scene, gap=0.2)
    # Both blocks and the ball stand free of the sheet, so that nothing lies in its plane.
    scene.objects[-2].transforms = translate((0, 0, 0.2)) @ scale((1, 1, 0.9)) @ scene.objects[-2].transforms
    scene.materials["blue"] = diffuse((0.12, 0.25, 0.6))
    scene.add("Ball", sphere(0.22, 48, 24), "blue", transform=translate((-0.45, -0.5, 0.45)))
    if sheet == "mirror":
        scene.materials["sheet"] = node("glossy_bsdf", {"distribution": "sharp"}, color=(0.85, 0.87, 0.88), roughness=0.0)
        scene.add("Sheet", quad((-1, -1, 0.01), (1, -1, 0.01), (1, 1, 0.01), (-1, 1, 0.01)), "sheet")
    elif sheet == "glass":
        scene.materials["sheet"] = node("glass_bsdf", {"distribution": "ggx"}, color=(0.95, 1, 0.97), roughness=0.0, ior=1.5)
        checker = node("checker_texture", vector=node("texture_coordinate").out("uv"), color1=(0.7, 0.6, 0.4),
                       color2=(0.2, 0.25, 0.4), scale=8.0)
        scene.materials["checker"] = diffuse(checker)  # type: ignore[arg-type]
        scene.add("Tiles", quad((-1, -1, 0.005), (1, -1, 0.005), (1, 1, 0.005), (-1, 1, 0.005)), "checker")
        scene.add("Sheet", box((-0.98, -0.98, 0.12), (0.98, 0.98, 0.17)), "sheet")
    else:
        raise ValueError(f"no floor of {sheet!r}")
    return scene


def noise_picture(size: int = 64, seed: int = 1, base: Color = (0.6, 0.45, 0.3), strength: float = 0.35) -> Picture:
    """A tiling cloudy picture made of a few waves."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[0:size, 0:size] / size * 2 * math.pi
    value = np.zeros((size, size))
    for octave in (1, 2, 3, 5, 8, 13):
        phase = rng.uniform(0, 2 * math.pi, 4)
        value += np.sin(octave * x + phase[0]) * np.sin(octave * y + phase[1]) / octave
        value += np.sin(octave * (x + y) + phase[2]) * np.sin(octave * (x - y) + phase[3]) / octave
    value = value / np.abs(value).max() * strength
    pixels = np.ones((size, size, 4), np.float32)
    pixels[..., :3] = np.clip(np.asarray(base) * (1 + value[..., None]), 0, 1)
    return Picture(pixels)


def _texture_walls(scene: Description) -> None:
    scene.images["plaster"] = noise_picture(64, 1, (0.8, 0.7, 0.55))
    scene.images["height"] = noise_picture(64, 2, (0.5, 0.5, 0.5), 0.9)
    scene.images["height"].colorspace = "non-color"
    uv = node("texture_coordinate").out("uv")
    plaster = node("image_texture", {"image": "plaster"}, vector=uv)
    height = node("image_texture", {"image": "height"}, vector=uv)
    bump = node("bump", strength=0.6, distance=0.03, height=height)
    scene.materials["white"] = node("principled", base_color=plaster, roughness=0.6, normal=bump)
    checker = node("checker_texture", vector=uv, color1=RED, color2=(0.75, 0.7, 0.2), scale=7.3)
    scene.materials["red"] = diffuse(checker)  # type: ignore[arg-type]


def _light_grid(count: int) -> list[Light]:
    """Point and spot lights of all colours under the ceiling, together as bright as one lamp."""
    rng, result, columns = np.random.default_rng(3), [], math.ceil(math.sqrt(count))
    for i in range(count):
        x, y = (i % columns + 0.5) / columns * 1.8 - 0.9, (i // columns + 0.5) / columns * 1.8 - 0.9
        color = tuple(float(c) for c in rng.uniform(0.2, 1.0, 3))
        power, place = 40.0 / count * float(rng.uniform(0.3, 1.7)), (x, y, 1.9 - 0.1 * float(rng.random()))
        if i % 3:
            result.append(Light(f"Point {i}", "point", translate(place), power, color, radius=0.01))
        else:
            aim = look_at(place, (x * 0.8, y * 0.8, 0))
            result.append(Light(f"Spot {i}", "spot", aim, 3 * power, color, radius=0.01, spot_size=1.1, spot_blend=0.4))
    return result


def furnace(albedo: float = 0.8, radiance: float = 1.0, shape: str = "sphere") -> Description:
    """A closed room that glows by itself so that every surface shows `radiance`: emission L(1 − albedo) plus reflection.

    shape: "sphere", "box". `world_furnace` is its open sister.
    """
    scene = Description("furnace", Camera(look_at((0.1, -0.5, 0.05), (0, 0.5, 0)), math.radians(70)))
    surface = node("add_shader", shader=diffuse((albedo,) * 3), shader_001=emission(radiance * (1 - albedo)))
    scene.materials["furnace"] = surface
    from .shapes import flipped

    walls = flipped(sphere(1.0, 32, 16)) if shape == "sphere" else box((-1, -1, -1), (1, 1, 1), inward=True)
    walls.smooth = False
    scene.add("Furnace", walls, "furnace")
    return scene


def world_furnace(material: Node | None = None, radiance: float = 1.0) -> Description:
    """A sphere under an even sky: a material that loses nothing vanishes."""
    scene = Description("world_furnace", Camera(look_at((0, -4, 0), (0, 0, 0)), math.radians(39)))
    scene.materials["ball"] = material or diffuse((1.0, 1.0, 1.0))
    scene.add("Ball", sphere(1.0, 64, 32), "ball")
    scene.world = background((1, 1, 1), radiance)
    return scene


def sealed_box(outside: float = 1000.0) -> Description:
    """A box without a hole, light of every kind outside, the camera within: black."""
    scene = Description("sealed_box", Camera(look_at((0, -0.9, 0), (0, 1, 0)), math.radians(90)))
    scene.materials.update(white=diffuse((0.9, 0.9, 0.9)), lamp=emission(outside))
    scene.add("Box", box((-1, -1, -1), (1, 1, 1), inward=True), "white")
    scene.add("Lamp mesh", quad((-3, -3, 4), (-3, 3, 4), (3, 3, 4), (3, -3, 4)), "lamp")
    scene.lights = [
        Light("Point", "point", translate((0, 0, 2)), outside, radius=0.1),
        Light("Touching", "point", translate((1.001, 0, 0)), outside),
        Light("Sun", "sun", look_at((0, 0, 2), (0.3, 0.2, 0)), outside, angle=0.01),
        Light("Area", "area", look_at((0, 3, 0), (0, 0, 0)), outside, size=(2, 2)),
        Light("Spot", "spot", look_at((-3, 0, 0), (0, 0, 0)), outside),
    ]
    scene.world = background((1, 1, 1), outside)
    return scene


def veach_door() -> Description:
    """A room lit only through a door ajar, with a table, three vessels and a picture on the wall."""
    scene = Description("veach_door", Camera(look_at((-0.6, -3.6, 1.5), (0.15, 1, 0.85)), math.radians(52)),
                        resolution=(320, 180))
    scene.materials.update(
        wall=diffuse((0.75, 0.73, 0.7)), floor=diffuse((0.35, 0.28, 0.22), 0.5), door=diffuse((0.4, 0.25, 0.13)),
        clay=diffuse((0.6, 0.25, 0.15)), metal=node("principled", base_color=(0.85, 0.8, 0.7), metallic=1.0, roughness=0.3),
        porcelain=node("principled", base_color=(0.8, 0.85, 0.9), roughness=0.15), lamp=emission(200.0, (1, 0.92, 0.8)),
    )
    x0, x1, y0, y1, top = -2.5, 2.5, -4.0, 2.0, 2.7
    left, right, door = 0.9, 1.9, 2.1  # the opening in the back wall
    room = join(
        quad((x0, y0, top), (x0, y1 + 3, top), (x1, y1 + 3, top), (x1, y0, top)),
        quad((x0, y0, 0), (x0, y1, 0), (x0, y1, top), (x0, y0, top)),
        quad((x1, y1, 0), (x1, y0, 0), (x1, y0, top), (x1, y1, top)),
        quad((x1, y0, 0), (x0, y0, 0), (x0, y0, top), (x1, y0, top)),
        box((x0, y1, 0), (left, y1 + 0.15, top)),
        box((right, y1, 0), (x1, y1 + 0.15, top)),
        box((left, y1, door), (right, y1 + 0.15, top)),
        quad((x0, y1, 0), (x0, y1 + 3, 0), (x0, y1 + 3, top), (x0, y1, top)),
        quad((x1, y1 + 3, 0), (x1, y1, 0), (x1, y1, top), (x1, y1 + 3, top)),
        quad((x0, y1 + 3, 0), (x1, y1 + 3, 0), (x1, y1 + 3, top), (x0, y1 + 3, top)),
    )
    scene.add("Room", room, "wall")
    scene.add("Floor", quad((x0, y0, 0), (x1, y0, 0), (x1, y1 + 3, 0), (x0, y1 + 3, 0)), "floor")
    hinge = translate((left, y1, 0)) @ rotate(math.radians(-48))
    scene.add("Door", box((0, -0.04, 0.005), (right - left - 0.01, 0, door - 0.01)), "door", transform=hinge)
    scene.add("Lamp", quad((-0.5, 3.2, 2.69), (-0.5, 4.2, 2.69), (0.9, 4.2, 2.69), (0.9, 3.2, 2.69)), "lamp")
    table = join(
        box((-0.9, -0.5, 0.72), (0.9, 0.5, 0.77)),
        *[box((x - 0.04, y - 0.04, 0), (x + 0.04, y + 0.04, 0.72)) for x in (-0.8, 0.8) for y in (-0.4, 0.4)],
    )
    scene.add("Table", table, "door", transform=translate((-0.1, 0.2, 0)))
    from .shapes import lathe

    vessel = [(0, 0), (0.08, 0), (0.13, 0.06), (0.15, 0.13), (0.1, 0.21), (0.07, 0.26), (0.09, 0.3)]
    for i, material in enumerate(("clay", "metal", "porcelain")):
        scene.add(f"Vessel {i + 1}", lathe(vessel, 48), material, transform=translate((-0.6 + 0.5 * i, 0.2 - 0.1 * i, 0.771)))
    return scene


def many_lights(count: int = 100) -> Description:
    """A room with as many small lights of all colours and kinds as you like."""
    scene = cornell_box("many_lights", count)
    scene.name = "many_lights"
    return scene


def textured_room() -> Description:
    """Image, checker, noise-free bump, normal-free mapping, vertex colours and mixed shaders in one room."""
    scene = cornell_box("textured")
    scene.name = "textured_room"
    scene.images["tiles"] = noise_picture(48, 5, (0.25, 0.4, 0.55), 0.5)
    mapped = node("mapping", {"kind": "point"}, vector=node("texture_coordinate").out("uv"), location=(0.1, 0.2, 0.0),
                  rotation=(0.0, 0.0, 0.5), scale=(3.0, 2.0, 1.0))
    tiles = node("image_texture", {"image": "tiles", "interpolation": "closest"}, vector=mapped)
    shine = node("glossy_bsdf", {"distribution": "ggx"}, color=(0.8, 0.8, 0.8), roughness=0.2)
    scene.materials["tiles"] = node("mix_shader", fac=0.3, shader=diffuse(tiles), shader_001=shine)  # type: ignore[arg-type]
    scene.materials["green"] = scene.materials["tiles"]
    ball = sphere(0.3, 48, 24)
    height = ball.positions[:, 2:] / 0.6 + 0.5
    ball.colors = np.concatenate([height, 1 - height, np.full_like(height, 0.2), np.ones_like(height)], 1).astype(np.float32)
    scene.materials["painted"] = diffuse(node("color_attribute", {"name": "Color"}))  # type: ignore[arg-type]
    scene.add("Ball", ball, "painted", transform=translate((0.35, -0.35, 0.88)))
    return scene


def thin_walls(gap: float = 2e-4) -> Description:
    """Two sheets `gap` metres apart in a 2 m room: light above, a black room below."""
    scene = Description("thin_walls", Camera(look_at((0, -2.0, -0.6), (0, 1, -0.6)), math.radians(60)))
    scene.materials["white"] = diffuse((0.8, 0.8, 0.8))
    scene.add("Room", box((-1, -2.5, -1), (1, 1, 1), inward=True), "white")
    for name, z in (("Upper", gap / 2), ("Lower", -gap / 2)):
        scene.add(name, quad((-1.1, -2.6, z), (1.1, -2.6, z), (1.1, 1.1, z), (-1.1, 1.1, z)), "white")
    scene.lights = [Light("Lamp", "point", translate((0, 0, 0.5)), 100.0, radius=0.05)]
    return scene


def desk_with_chair() -> Description:
    """A desk under a lamp and a chair that rolls to and fro (24 frames)."""
    scene = _cornell_room("desk_with_chair", "mesh")
    scene.frames = (1, 24)
    scene.materials.update(wood=diffuse((0.45, 0.28, 0.14)), seat=diffuse((0.12, 0.2, 0.5)), steel=node(
        "principled", base_color=(0.7, 0.7, 0.72), metallic=1.0, roughness=0.35))
    desk = join(
        box((-0.6, -0.3, 0.66), (0.6, 0.3, 0.7)),
        box((-0.58, -0.28, 0), (-0.54, 0.28, 0.66)), box((0.54, -0.28, 0), (0.58, 0.28, 0.66)),
        box((-0.54, 0.24, 0.2), (0.54, 0.28, 0.66)),
    )
    scene.add("Desk", desk, "wood", transform=translate((0, 0.4, 0)))
    chair = join(
        cylinder(0.22, 0.06, 32), slots=[0]
    )
    chair = transformed(chair, translate((0, 0, 0.42)))
    back = transformed(box((-0.2, -0.02, 0.5), (0.2, 0.02, 0.95)), translate((0, -0.2, 0)))
    post = cylinder(0.03, 0.42, 16)
    feet = join(*[transformed(box((-0.02, 0, 0.02), (0.02, 0.25, 0.06)), rotate(i * 2 * math.pi / 5)) for i in range(5)])
    whole = join(chair, *[_without_uv(m) for m in (back, post, feet)], slots=[0, 0, 1, 1])

    def move(frame: float) -> Any:
        t = 2 * math.pi * (frame - 1) / 24
        return translate((0.35 * math.sin(t), -0.25 - 0.1 * math.cos(t), 0)) @ rotate(0.8 * math.sin(t))

    scene.add("Chair", whole, "seat", "steel", move=move)
    scene.add("Bunny", bunny(20), "white", transform=translate((-0.3, 0.4, 0.7)) @ scale(0.35))
    return scene


def _without_uv(mesh: Any) -> Any:
    mesh.uvs = None
    return mesh


def object_grid(name: str, mesh: str, transforms: Any, *materials: str) -> Object:
    """One object at many places."""
    return Object(name, mesh, transforms, materials)
