# SPDX-License-Identifier: GPL-3.0-or-later
"""Large rooms of many triangles: a hall of fluted pillars, an office behind blinds, a conference room. In each one thing moves
for 100 frames, as in the animations of Debattista et al. 2009 (a box in Sibenik, a bunny on the table of Conference)."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from .description import Camera, Description, Light, Matrix, Object, look_at, node, rotate, scale, translate
from .rooms import background, diffuse, emission
from .shapes import box, bunny, cylinder, grid, join, lathe, quad, sphere, statue, transformed

FRAMES = (1, 100)


def _share(frame: float) -> float:
    """How much of the motion has gone by: 0 in the first frame, 1 in the last, going on at the same speed beyond."""
    return (frame - FRAMES[0]) / (FRAMES[1] - FRAMES[0])


def _fluted_pillar(height: float = 4.0, flutes: int = 20, rings: int = 24) -> Any:
    """A pillar with base and capital; its flutes are waves of the radius."""
    z = np.linspace(0.0, 1.0, rings + 1)
    radius = np.where(z < 0.06, 0.36, np.where(z > 0.94, 0.34, 0.25 - 0.03 * z))
    mesh = lathe(np.stack([radius, z * height], -1), 4 * flutes)
    points = mesh.positions.astype(np.float64)
    angle, shaft = np.arctan2(points[:, 1], points[:, 0]), (points[:, 2] > 0.07 * height) & (points[:, 2] < 0.93 * height)
    points[:, :2] *= np.where(shaft, 1 - 0.06 * np.abs(np.sin(angle * flutes / 2)), 1.0)[:, None]
    mesh.positions = points.astype(np.float32)
    return mesh


def pillared_hall(rows: int = 10) -> Description:
    """Two rows of fluted pillars under a vault, light from one side and a skylight: about 80,000 triangles. A yellow box slides
    across the nave, turning, from between two pillars to those on the other side."""
    length = 2.4 * rows
    scene = Description("pillared_hall",
                        Camera(look_at((0.6, -length / 2 + 0.8, 1.7), (-0.3, length / 2, 1.6)), math.radians(70)),
                        frames=FRAMES, resolution=(300, 200))
    scene.materials.update(stone=diffuse((0.7, 0.65, 0.55)), floor=diffuse((0.5, 0.4, 0.35)), lamp=emission(30.0, (1, 0.9, 0.75)),
                           yellow=diffuse((0.75, 0.6, 0.06)))
    scene.meshes["Pillar"] = _fluted_pillar()
    places = [translate((x, (i + 0.5) * 2.4 - length / 2, 0)) for i in range(rows) for x in (-1.8, 1.8)]
    scene.objects.append(Object("Pillar", "Pillar", np.array(places), ("stone",)))
    scene.add("Floor", grid(9, length, 8, 8), "floor")
    walls = join(
        quad((-4.5, length / 2, 0), (4.5, length / 2, 0), (4.5, length / 2, 6), (-4.5, length / 2, 6)),
        quad((4.5, -length / 2, 0), (-4.5, -length / 2, 0), (-4.5, -length / 2, 6), (4.5, -length / 2, 6)),
        quad((-4.5, -length / 2, 0), (-4.5, length / 2, 0), (-4.5, length / 2, 4), (-4.5, -length / 2, 4)),
        *[box((4.5, i * 2.4 - length / 2, 0), (4.8, i * 2.4 + 1.4 - length / 2, 4)) for i in range(rows)],
    )
    scene.add("Walls", walls, "stone")
    vault = grid(9, length, 24, 6, lambda x, y: 4 + 1.9 * np.sqrt(np.maximum(0, 1 - (x / 4.5) ** 2)))
    scene.add("Vault", vault, "stone")
    scene.add("Statue", statue(40, 60), "stone", transform=translate((0, length / 4, 0)) @ scale(2.2))
    scene.add("Lamp", quad((-0.5, -1, 5), (-0.5, 1, 5), (0.5, 1, 5), (0.5, -1, 5)), "lamp")

    def slide(frame: float) -> Matrix:
        at = _share(frame)
        return translate((-1.8 + 3.2 * at, 2 * 2.4 - length / 2, 0.01)) @ rotate(0.4 + 1.2 * at)

    scene.add("Box", box((-0.3, -0.3, 0), (0.3, 0.3, 1.2)), "yellow", move=slide)
    scene.lights = [Light("Sun", "sun", look_at((5, 1, 4), (0, 0, 0)), 8.0, (1, 0.9, 0.75), angle=math.radians(1))]
    scene.world = background((0.4, 0.6, 1.0), 0.6)
    return scene


def office_with_blinds() -> Description:
    """Desks in a room lit by the sky through forty slats. One of four chairs rolls away from its desk and back."""
    scene = Description("office_with_blinds", Camera(look_at((2.4, -2.6, 1.7), (-1.5, 1.2, 0.8)), math.radians(62)),
                        frames=FRAMES, resolution=(320, 180))
    scene.materials.update(
        wall=diffuse((0.75, 0.74, 0.7)), carpet=diffuse((0.25, 0.27, 0.3)), wood=diffuse((0.5, 0.33, 0.2)),
        slat=node("mix_shader", fac=0.3, shader=diffuse((0.8, 0.8, 0.76)),
                  shader_001=node("translucent_bsdf", color=(0.8, 0.8, 0.76))),
        screen=node("principled", base_color=(0.02, 0.02, 0.025), roughness=0.1), seat=diffuse((0.15, 0.2, 0.35)),
    )
    walls = join(
        quad((-3, 3, 0), (3, 3, 0), (3, 3, 2.8), (-3, 3, 2.8)), quad((3, -3, 0), (-3, -3, 0), (-3, -3, 2.8), (3, -3, 2.8)),
        quad((3, 3, 0), (3, -3, 0), (3, -3, 2.8), (3, 3, 2.8)), quad((-3, 3, 2.8), (3, 3, 2.8), (3, -3, 2.8), (-3, -3, 2.8)),
        box((-3.2, -3, 0), (-3, 3, 0.9)), box((-3.2, -3, 2.4), (-3, 3, 2.8)),
        box((-3.2, -3, 0.9), (-3, -2, 2.4)), box((-3.2, 2, 0.9), (-3, 3, 2.4)),
    )
    scene.add("Walls", walls, "wall")
    scene.add("Carpet", grid(6.4, 6, 4, 4), "carpet")
    slat = box((-0.02, -2, -0.0005), (0.02, 2, 0.0005))
    scene.meshes["Slat"] = slat
    places = [translate((-2.95, 0, 0.92 + 0.037 * i)) @ rotate(0.7, "y") for i in range(40)]
    scene.objects.append(Object("Slat", "Slat", np.array(places), ("slat",)))
    scene.meshes["Desk"] = join(box((-0.7, -0.4, 0.7), (0.7, 0.4, 0.74)), *[
        box((x - 0.03, y - 0.03, 0), (x + 0.03, y + 0.03, 0.7)) for x in (-0.65, 0.65) for y in (-0.35, 0.35)])
    scene.meshes["Screen"] = join(box((-0.35, -0.02, 0.9), (0.35, 0.02, 1.3)), box((-0.12, -0.1, 0.74), (0.12, 0.1, 0.76)),
                                  box((-0.03, -0.02, 0.76), (0.03, 0.02, 0.9)))
    scene.meshes["Chair"] = _chair()
    desks = [translate((x, y, 0)) for x in (-1.6, 0.6) for y in (-0.8, 1.3)]
    scene.objects.append(Object("Desk", "Desk", np.array(desks), ("wood",)))
    scene.objects.append(Object("Screen", "Screen", np.array([d @ translate((0, 0.1, 0)) for d in desks]), ("screen",)))
    chairs = [d @ translate((0, -0.75, 0)) @ rotate(0.3) for d in desks]
    rolls = chairs.pop(2)  # of the desk next to the camera
    scene.objects.append(Object("Chair", "Chair", np.array(chairs), ("seat",)))

    def roll(frame: float) -> Matrix:
        t = 2 * math.pi * _share(frame)
        away = 0.5 - 0.5 * math.cos(t)
        return translate((-0.75 * away, 0.1 * math.sin(t), 0)) @ rolls @ rotate(1.2 * away)

    scene.objects.append(Object("Rolling chair", "Chair", materials=("seat",), move=roll))
    scene.lights = [Light("Sun", "sun", look_at((-5, 1.0, 3.5), (0, 0, 0)), 12.0, (1, 0.92, 0.8), angle=math.radians(0.6))]
    scene.world = background((0.6, 0.75, 1.0), 2.0)
    return scene


def _chair(segments: int = 24) -> Any:
    seat = transformed(cylinder(0.24, 0.07, segments, 1), translate((0, 0, 0.42)))
    back = transformed(box((-0.22, -0.03, 0.55), (0.22, 0.03, 1.0)), translate((0, -0.24, 0)))
    legs = [transformed(cylinder(0.02, 0.42, max(8, segments // 3)), translate((0.17 * math.cos(a), 0.17 * math.sin(a), 0)))
            for a in np.arange(4) * math.pi / 2 + math.pi / 4]
    for part in (back,):
        part.uvs = None
    return join(seat, back, *legs)


def conference_room(chairs: int = 40) -> Description:
    """A long table, cushioned chairs, lamps in the ceiling: about 200,000 triangles, few of them instances. A green bunny hops
    across the table."""
    scene = Description("conference_room", Camera(look_at((3.6, -4.4, 2.1), (-0.8, 1.5, 0.7)), math.radians(65)),
                        frames=FRAMES, resolution=(320, 180))
    scene.materials.update(
        wall=diffuse((0.72, 0.7, 0.66)), carpet=diffuse((0.3, 0.12, 0.12)), steel=node(
            "principled", base_color=(0.7, 0.7, 0.7), metallic=1.0, roughness=0.3),
        table=node("principled", base_color=(0.35, 0.18, 0.08), roughness=0.2), cushion=diffuse((0.1, 0.15, 0.3)),
        lamp=emission(12.0), fur=diffuse((0.12, 0.5, 0.1)),
    )
    scene.add("Room", box((-4.5, -6, 0), (4.5, 6, 3.0), inward=True), "wall")
    scene.add("Carpet", transformed(grid(8.98, 11.98, 60, 80, lambda x, y: 0.004 * np.sin(40 * x) * np.sin(37 * y)),
                                    translate((0, 0, 0.01))), "carpet")
    profile = [(0.0, 0.7), (1.0, 0.7), (1.08, 0.72), (1.08, 0.75), (1.04, 0.76), (0.0, 0.76)]
    scene.add("Table", transformed(lathe(profile, 128), scale((1.2, 3.3, 1.0))), "table")
    for i, y in enumerate((-2.2, 0.0, 2.2)):
        scene.add(f"Foot {i + 1}", cylinder(0.2, 0.69, 48, 4), "steel", transform=translate((0, y, 0)))
    cushion = transformed(sphere(1.0, 48, 24), translate((0, 0, 0.45)) @ scale((0.26, 0.26, 0.07)))
    back = transformed(sphere(1.0, 48, 24), translate((0, -0.26, 0.8)) @ scale((0.25, 0.06, 0.3)))
    for i in range(chairs):
        side, at = i % 2 * 2 - 1, (i // 2 + 0.5) / (chairs / 2)
        angle = math.pi * at * 0.94 + 0.1
        place = (side * 1.75 * math.sin(angle), -4.3 * math.cos(angle), 0)
        turn = math.atan2(-place[1] * 0.2, -place[0]) - math.pi / 2
        scene.add(f"Chair {i + 1}", join(cushion, back, slots=[0, 0]), "cushion", transform=translate(place) @ rotate(turn))
    for i in range(8):
        x, y = -2.2 + 4.4 * (i % 2), -4.2 + 2.8 * (i // 2)
        lamp = quad((x - 0.5, y + 0.2, 2.99), (x + 0.5, y + 0.2, 2.99), (x + 0.5, y - 0.2, 2.99), (x - 0.5, y - 0.2, 2.99))
        scene.add(f"Lamp {i + 1}", lamp, "lamp")

    def hop(frame: float) -> Matrix:
        at = _share(frame)
        lift = 0.12 * abs(math.sin(8 * math.pi * at))
        return translate((0.5 - at, -2.0 + 3.6 * at, 0.76 + lift)) @ rotate(math.atan2(3.6, -1.0)) @ scale(0.5)

    scene.add("Bunny", bunny(21), "fur", move=hop)
    return scene


def place(x: float, y: float, z: float = 0.0, turn: float = 0.0, size: float = 1.0) -> Matrix:
    """Short for a translation, a turn about z and a size."""
    return translate((x, y, z)) @ rotate(turn) @ scale(size)
