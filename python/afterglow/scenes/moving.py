# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes that move: bouncing bunnies, a wobbling cylinder, a kite on the wind, sixty-six glossy bouncing balls.

Motion is a function of the frame, which may be negative or fractional; the meshes' triangles never change.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .description import Camera, Color, Description, Light, Motion, look_at, node, rotate, scale, translate
from .rooms import background, diffuse, emission
from .shapes import box, bunny, cylinder, grid, sphere


def _bounce(x: float, y: float, height: float, period: float, phase: float, size: float, spin: float = 0.0) -> Motion:
    def move(frame: float) -> Any:
        t = (frame / period + phase) % 1.0
        lift = height * 4 * t * (1 - t)
        squash = 1 - 0.18 * max(0.0, 1 - lift / (0.15 * height))
        return translate((x, y, lift)) @ rotate(spin * frame) @ scale(
            (size / math.sqrt(squash), size / math.sqrt(squash), size * squash))

    return move


def _hall(scene: Description, radius: float) -> None:
    scene.materials.update(wall=diffuse((0.72, 0.7, 0.66)), floor=diffuse((0.5, 0.42, 0.33)),
                           lamp=emission(14.0, (1, 0.95, 0.85)))
    scene.add("Room", box((-radius, -radius, -0.001), (radius, radius, radius), inward=True), "wall")
    scene.add("Floor", grid(2 * radius, 2 * radius, 2, 2), "floor")
    from .shapes import quad

    w = radius / 3
    scene.add("Lamp", quad((-w, w, radius * 0.99), (w, w, radius * 0.99), (w, -w, radius * 0.99),
                           (-w, -w, radius * 0.99)), "lamp")


def bouncing_bunnies(count: int = 9, divisions: int = 76, moving: int | None = None) -> Description:
    """`count` bunnies (12 · divisions² triangles, one mesh) in a lit room, the first `moving` of them bouncing (None: all)."""
    scene = Description("bouncing_bunnies", Camera(look_at((0, -0.95, 0.62), (0, 0, 0.25)), math.radians(62)), frames=(1, 48),
                        resolution=(300, 200))
    columns = max(1, math.ceil(math.sqrt(count)))
    radius = 1.0
    _hall(scene, radius)
    mesh, rng = bunny(divisions), np.random.default_rng(5)
    from .description import Object

    scene.meshes["Bunny"] = mesh
    for i in range(count):
        color: Color = tuple(float(c) for c in rng.uniform(0.15, 0.85, 3))  # type: ignore[assignment]
        scene.materials[f"fur {i}"] = diffuse(color)
        cell = 1.5 * radius / columns
        x, y = (i % columns - (columns - 1) / 2) * cell, (i // columns - (columns - 1) / 2) * cell + 0.2
        size, turn = 0.75 * cell, float(rng.uniform(0, 6.28))
        motion = _bounce(x, y, 0.5 * cell, float(rng.uniform(14, 22)), float(rng.random()), size, 0.02)
        still = translate((x, y, 0)) @ rotate(turn) @ scale(size)
        walks = moving is None or i < moving
        scene.objects.append(Object(f"Bunny {i + 1}", "Bunny", still, (f"fur {i}",), motion if walks else None))
    return scene


def wobbling_cylinder(segments: int = 128, rings: int = 128) -> Description:
    """A tall cylinder whose vertices sway: 2 · segments · rings triangles that deform in every frame."""
    scene = Description("wobbling_cylinder", Camera(look_at((0, -0.95, 0.55), (0, 0, 0.35)), math.radians(62)), frames=(1, 48))
    _hall(scene, 1.0)
    mesh = cylinder(0.16, 0.8, segments, rings, caps=False)
    rest = mesh.positions.astype(np.float64)

    def deform(frame: float) -> NDArray[np.float32]:
        t, h = 2 * math.pi * frame / 48, rest[:, 2] / 0.8
        points = rest.copy()
        points[:, 0] += 0.18 * h**2 * np.sin(t + 3 * h)
        points[:, 1] += 0.10 * h**2 * np.cos(t + 4 * h)
        points[:, :2] *= (1 + 0.2 * np.sin(12 * h + t))[:, None]
        return points.astype(np.float32)

    mesh.deform, mesh.positions = deform, deform(1)
    scene.materials["rubber"] = diffuse((0.75, 0.35, 0.15))
    scene.add("Cylinder", mesh, "rubber")
    return scene


def kite() -> Description:
    """A translucent kite with a tail over a field: a deforming sheet under sun and sky, its shadow wandering."""
    scene = Description("kite", Camera(look_at((0, -6, 1.2), (0, 0, 1.6)), math.radians(45)), frames=(1, 48),
                        resolution=(320, 180))
    scene.materials.update(
        field=diffuse((0.2, 0.35, 0.1)),
        cloth=node("mix_shader", fac=0.4, shader=diffuse((0.8, 0.15, 0.1)),
                   shader_001=node("translucent_bsdf", color=(0.8, 0.15, 0.1))),
        tail=diffuse((0.9, 0.8, 0.1)), wall=diffuse((0.75, 0.75, 0.72)),
    )
    scene.add("Field", grid(30, 30, 40, 40, lambda x, y: 0.08 * np.sin(1.3 * x) * np.cos(1.1 * y)), "field")
    scene.add("Wall", box((-3, 2, -0.2), (3, 2.2, 1.6)), "wall")
    sheet = grid(1.4, 1.4, 24, 24)
    flat = sheet.positions.astype(np.float64)
    flat = flat @ rotate(math.pi / 4)[:3, :3].T

    def cloth(frame: float) -> NDArray[np.float32]:
        points, t = flat.copy(), 2 * math.pi * frame / 24
        points[:, 2] = 0.12 * np.sin(3 * points[:, 0] + t) + 0.08 * np.sin(4 * points[:, 1] - 1.3 * t)
        return points.astype(np.float32)

    def fly(frame: float) -> Any:
        t = 2 * math.pi * frame / 48
        place = translate((0.9 * math.sin(t), 0.3 * math.cos(2 * t), 2.2 + 0.3 * math.sin(2 * t)))
        return place @ rotate(1.0, "x") @ rotate(0.3 * math.sin(t))

    sheet.deform, sheet.positions, sheet.smooth = cloth, cloth(1), True
    scene.add("Kite", sheet, "cloth", move=fly)
    ribbon = grid(0.08, 2.0, 2, 40)
    line = ribbon.positions.astype(np.float64)

    def tail(frame: float) -> NDArray[np.float32]:
        points, t = line.copy(), 2 * math.pi * frame / 24
        along = points[:, 1] - 1.0
        points[:, 1] = along - 0.9
        points[:, 0] += 0.15 * along * np.sin(3 * along + t)
        points[:, 2] = 0.2 * along * np.cos(2 * along + t)
        return points.astype(np.float32)

    ribbon.deform, ribbon.positions = tail, tail(1)
    scene.add("Tail", ribbon, "tail", move=fly)
    scene.lights = [Light("Sun", "sun", look_at((2, -3, 4), (0, 0, 0)), 4.0, (1, 0.95, 0.85), angle=math.radians(0.6))]
    scene.world = background((0.45, 0.6, 0.95), 0.8)
    return scene


def bouncing_spheres(count: int = 66, segments: int = 32) -> Description:
    """`count` balls, glossy and mirror-like among them, bouncing in a room."""
    scene = Description("spheres", Camera(look_at((0, -0.95, 0.7), (0, 0.1, 0.25)), math.radians(62)), frames=(1, 24),
                        resolution=(320, 180))
    _hall(scene, 1.0)
    from .description import Object

    scene.meshes["Ball"] = sphere(1.0, segments, segments // 2)
    rng, columns = np.random.default_rng(11), math.ceil(math.sqrt(count * 1.3))
    for i in range(count):
        color: Color = tuple(float(c) for c in rng.uniform(0.2, 0.9, 3))  # type: ignore[assignment]
        rough = float(rng.choice([0.05, 0.15, 0.3, 0.5]))
        scene.materials[f"ball {i}"] = (
            node("glossy_bsdf", {"distribution": "ggx"}, color=color, roughness=rough)
            if i % 3 else node("principled", base_color=color, roughness=rough)
        )
        size = float(rng.uniform(0.04, 0.075))
        x, y = (i % columns + 0.5) / columns * 1.8 - 0.9, (i // columns + 0.5) / math.ceil(count / columns) * 1.6 - 0.7
        motion = _bounce(x, y, float(rng.uniform(0.2, 0.7)), 24.0, float(rng.random()), size)
        lifted = _lifted(motion, size)
        scene.objects.append(Object(f"Ball {i + 1}", "Ball", lifted(1), (f"ball {i}",), lifted))
    return scene


def _lifted(motion: Motion, height: float) -> Motion:
    return lambda frame: translate((0, 0, height)) @ motion(frame)
