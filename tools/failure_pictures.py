# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of what the instant cache shows wrongly, for docs/methods/instant_cache.md: the cache on the left, path tracing on the
right. PYTHONPATH=build/release/python python3 tools/failure_pictures.py [folder]"""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import Any

import afterglow
import numpy as np
import OpenImageIO
from afterglow.scenes import Camera, Description, Light, look_at, make, node, translate
from afterglow.scenes.rooms import diffuse
from afterglow.scenes.shapes import box, quad, sphere

SIZE: dict[str, Any] = dict(width=200, height=150, diffuse_bounces=4)
CACHE: dict[str, Any] = dict(method="INSTANT_CACHE", samples=8)
TRUTH: dict[str, Any] = dict(method="PATH_TRACING", samples=1024)


def room() -> Description:
    scene = Description("room", Camera(look_at((0, -2.6, 1.1), (0, 0.4, 0.6)), math.radians(50)))
    scene.materials.update(white=diffuse((0.75, 0.75, 0.75)), red=diffuse((0.8, 0.15, 0.1)))
    scene.add("Room", box((-1.5, -3, 0), (1.5, 1.5, 2), inward=True), "white")
    return scene


def caustic() -> Description:
    scene = room()
    scene.materials["metal"] = node("glossy_bsdf", {"distribution": "sharp"}, color=(0.95, 0.85, 0.6), roughness=0.0)
    scene.add("Mirror", quad((-0.5, 0.9, 0), (0.5, 0.9, 0), (0.5, 1.2, 1.2), (-0.5, 1.2, 1.2)), "metal")
    scene.add("Ball", sphere(0.25, 48, 24), "red", transform=translate((-0.6, 0.0, 0.25)))
    scene.lights = [Light("L", "area", look_at((0, -1.5, 1.8), (0, 1.05, 0.5)), 40.0, size=(0.2, 0.2), spread=0.8)]
    return scene


def partition() -> Description:
    scene = room()
    scene.add("Partition", quad((0, -1, 0), (0, 1.5, 0), (0, 1.5, 2), (0, -1, 2)), "white")
    scene.add("Lit wall", quad((1.49, -1, 0), (1.49, 1.4, 0), (1.49, 1.4, 1), (1.49, -1, 1)), "red")
    scene.lights = [Light("L", "spot", look_at((0.7, 0.5, 1.9), (1.4, 0.5, 0.4)), 200.0, spot_size=0.9)]
    return scene


def contact() -> Description:
    """A box that stands and a ball that lies on a floor which only a wall's light reaches."""
    scene = room()
    scene.add("Box", box((-0.7, -0.2, 0), (-0.3, 0.2, 0.4)), "white")
    scene.add("Ball", sphere(0.2, 48, 24), "white", transform=translate((0.3, -0.1, 0.2)))
    scene.lights = [Light("L", "spot", look_at((0.0, 0.0, 1.9), (1.5, 0.3, 1.2)), 300.0, spot_size=0.9)]
    return scene


def shown(scene: Description, passes: str, **settings: Any) -> Any:
    result = afterglow.render(scene, passes=["combined", passes], **{**SIZE, **settings})
    return result.passes[passes][..., :3]


def write(path: Path, pictures: list[Any]) -> None:
    bright = float(np.mean(pictures[-1])) * 3
    row = np.clip(np.concatenate(pictures, 1) / bright, 0, 1) ** (1 / 2.2)
    pixels = np.ascontiguousarray((row[::-1] * 255 + 0.5).astype(np.uint8))
    out = OpenImageIO.ImageOutput.create(str(path))
    spec = OpenImageIO.ImageSpec(pixels.shape[1], pixels.shape[0], 3, "uint8")
    spec.attribute("Compression", "jpeg:88")
    out.open(str(path), spec)
    out.write_image(pixels)
    out.close()


def main() -> None:
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "docs/images")
    on = dict(caustics_reflective=True)
    write(folder / "instant_cache_caustic.jpg",
          [shown(caustic(), "combined", **on, **method) for method in (CACHE, TRUTH)])
    write(folder / "instant_cache_partition.jpg",
          [shown(partition(), "diffuse_indirect", **CACHE), shown(partition(), "diffuse_indirect", **TRUTH)])
    for name, scene, lights in (("corners", "cornell_box", 64), ("blinds", "office_with_blinds", 256)):
        write(folder / f"instant_cache_{name}.jpg",
              [shown(make(scene), "diffuse_indirect", **CACHE, virtual_lights=lights, light_compensation=rays)
               for rays in (0, 64)]
              + [shown(make(scene), "diffuse_indirect", **TRUTH)])
    cells: dict[str, Any] = dict(method="HASH_CACHE", samples=16)
    write(folder / "hash_cache_partition.jpg",
          [shown(partition(), "diffuse_indirect", **cells, hash_cell=size) for size in (16, 4)]
          + [shown(partition(), "diffuse_indirect", **TRUTH)])
    write(folder / "hash_cache_contact.jpg",
          [shown(contact(), "diffuse_indirect", **cells, hash_cell=size) for size in (16, 4)]
          + [shown(contact(), "diffuse_indirect", **TRUTH)])
    write(folder / "hash_cache_first.jpg",
          [shown(make("cornell_box"), "diffuse_indirect", method="HASH_CACHE", samples=n, hash_filter=on)
           for n, on in ((1, False), (1, True), (16, True))])


if __name__ == "__main__":
    main()
