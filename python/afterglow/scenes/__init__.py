# SPDX-License-Identifier: GPL-3.0-or-later
"""Procedural scenes. `SCENES` names every one, `BLEND_FILES` those that stand as files in `blend_files/`."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from . import halls, moving, outdoors, rooms
from .description import Camera, Description, Light, Mesh, Node, Object, Picture, look_at, node, rotate, scale, translate

SCENES: dict[str, Callable[..., Description]] = {
    "cornell_box": rooms.cornell_box,
    **{f"cornell_{v}": partial(rooms.cornell_box, v)
       for v in ("glossy", "glass", "textured", "many_lights", "indirect", "statue", "emissive", "mirror")},
    "mirror_floor": partial(rooms.floor_room, "mirror"),
    "glass_floor": partial(rooms.floor_room, "glass"),
    "furnace": rooms.furnace,
    "world_furnace": rooms.world_furnace,
    "sealed_box": rooms.sealed_box,
    "thin_walls": rooms.thin_walls,
    "veach_door": rooms.veach_door,
    "many_lights": rooms.many_lights,
    "textured_room": rooms.textured_room,
    "desk_with_chair": rooms.desk_with_chair,
    "sun_and_sky": outdoors.sun_and_sky,
    "transparency": outdoors.transparency,
    "area_lights": outdoors.area_lights,
    "materials": outdoors.materials,
    "pillared_hall": halls.pillared_hall,
    "office_with_blinds": halls.office_with_blinds,
    "conference_room": halls.conference_room,
    "bouncing_bunnies": moving.bouncing_bunnies,
    "wobbling_cylinder": moving.wobbling_cylinder,
    "kite": moving.kite,
    "spheres": moving.bouncing_spheres,
}
# The cylinder has a shape key for every frame, and is therefore coarser in its file.
BLEND_FILES: dict[str, Callable[..., Description]] = {
    **{name: scene for name, scene in SCENES.items() if name != "world_furnace"},
    "wobbling_cylinder": partial(moving.wobbling_cylinder, 64, 64),
}
# Further scenes of a file, which share its meshes: how many of the nine bunnies bounce.
FURTHER_SCENES: dict[str, dict[str, Callable[..., Description]]] = {
    "bouncing_bunnies": {f"bouncing_bunnies_{n}": partial(moving.bouncing_bunnies, moving=n) for n in (1, 2, 4)},
}


def make(name: str) -> Description:
    """The scene of that name with its defaults; a KeyError names the ones there are."""
    if name not in SCENES:
        raise KeyError(f"no scene {name!r}; there are {', '.join(SCENES)}")
    return SCENES[name]()


__all__ = [
    "BLEND_FILES", "FURTHER_SCENES", "SCENES", "Camera", "Description", "Light", "Mesh", "Node", "Object", "Picture", "look_at",
    "make", "node", "rotate", "scale", "translate",
]
