# SPDX-License-Identifier: GPL-3.0-or-later
"""Visibility rays that the update traces, over those that an edit can change: they cross the moved objects' old or new surface,
or end at a light that changed. All rays of records that ride on a moved object have to be asked again, too, for they begin
elsewhere than they did: the ratio to both together stands beside. Counted from saved caches and a scene of what moved alone."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..figure import Context, Figure
from .animations import MOVING
from .watched import Watched

HEADER = np.dtype([("magic", "S16"), ("format", "<u4"), ("slots", "<u4"), ("words", "<u4"), ("coloured", "<u4"),
                   ("records", "<u8"), ("scene", "<u8"), ("lengths", "<f4", 7), ("settings", "<u4", 8), ("update", "<u4"),
                   ("short_rays", "<u4"), ("end", "<u4")])
LIGHT = np.dtype([("position", "<f4", 3), ("normal", "<f4", 3), ("face_normal", "<f4", 3), ("front", "<f4", 3),
                  ("back", "<f4", 3), ("lift", "<f4"), ("alive", "<u4")])
RECORD = np.dtype([("instance", "<u4"), ("triangle", "<u4"), ("back", "<u4"), ("uv", "<f4", 2), ("position", "<f4", 3),
                   ("normal", "<f4", 3), ("face_normal", "<f4", 3), ("irradiance", "<f4", 3), ("gradients", "<f4", 18),
                   ("lengths", "<f4", 4), ("compensation", "<f4", 3), ("measured", "<f4"), ("born", "<u4"),
                   ("asked", "<u4"), ("rays", "<u4"), ("used", "<u4"), ("ready", "<u4"), ("wanted", "<u4")])


@dataclass
class Saved:
    """What a saved cache holds of lights and records."""

    update: int
    lights: NDArray[Any]
    records: NDArray[Any]


def saved(watched: Watched) -> Saved:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "cache"
        watched.session.save_cache(str(path))
        data = path.read_bytes()
    head = np.frombuffer(data, HEADER, 1)[0]
    slots, count = int(head["slots"]), int(head["records"])
    lights = np.frombuffer(data, LIGHT, slots, HEADER.itemsize)
    return Saved(int(head["update"]), lights, np.frombuffer(data, RECORD, count, HEADER.itemsize + lights.nbytes))


def facing(records: NDArray[Any], lights: NDArray[Any]) -> NDArray[np.bool_]:
    """(records, lights): pairs between which light can go at all."""
    way = lights["position"][None].astype(np.float64) - records["position"][:, None]
    here = (way * records["face_normal"][:, None]).sum(-1) > 0
    there = (way * lights["face_normal"][None]).sum(-1)
    front, back = (lights[side].max(-1) > 0 for side in ("front", "back"))
    return here & (lights["alive"] > 0) & (((there < 0) & front) | ((there > 0) & back))


def ghost(watched: Watched, frames: tuple[float, float]) -> Any:
    """The moved objects where they were and where they are, and nothing else."""
    from ..._native import Scene

    scene, description = Scene(), watched.built.description
    for item in description.objects:
        mesh = description.meshes[item.mesh]
        if item.move is None and mesh.deform is None:
            continue
        for frame in frames:
            positions = mesh.positions if mesh.deform is None else mesh.deform(frame)
            handle = scene.add_mesh(name=item.name, positions=positions, triangles=mesh.triangles)
            scene.add_instances(handle, item.at(frame), name=item.name)
    scene.commit()
    return scene


def needed(watched: Watched, before: Saved, after: Saved, frames: tuple[float, float]) -> tuple[int, int]:
    """Rays of the records that were there before, which the edit can change: those that cross a moved surface or end at a changed
    light, and the same with all that begin on a moved object."""
    records = after.records[after.records["born"] < after.update]
    pairs = facing(records, after.lights)
    changed = np.zeros(len(after.lights), bool)
    for name in ("position", "face_normal", "alive"):
        differs = before.lights[name] != after.lights[name]
        changed |= differs.any(-1) if differs.ndim > 1 else differs
    description = watched.built.description
    order = [item for item in description.objects for _ in range(len(item.transforms))]
    moves = np.array([item.move is not None or description.meshes[item.mesh].deform is not None for item in order])
    carried = moves[records["instance"]]
    strict = pairs & changed[None]
    rows, columns = np.nonzero(pairs & ~strict)
    from_ = records["position"][rows].astype(np.float64) + 1e-4 * records["face_normal"][rows]
    to = after.lights["position"][columns].astype(np.float64) + 1e-4 * after.lights["face_normal"][columns]
    if len(rows):
        strict[rows, columns] = ghost(watched, frames).occluded(from_, to)
    return int(strict.sum()), int((strict | (pairs & carried[:, None])).sum())


def measure(context: Context) -> list[Figure]:
    """Summed over 20 frames for every pair asked for."""
    figures = []
    for name, case in MOVING.items():
        watched = Watched(case.make, "INSTANT_CACHE")
        start = watched.built.description.frames[0]
        before, traced, crossing, carried = saved(watched), 0, 0, 0
        count = watched.values().get("update_rays", 0)
        for frame in range(1, max(2, 20 * context.pairs)):
            watched.move_to(start + frame)
            after = saved(watched)
            strict, wide = needed(watched, before, after, (start + frame - 1, start + frame))
            crossing, carried = crossing + strict, carried + wide
            now = watched.values()["update_rays"]
            traced, count, before = traced + int(now - count), now, after
        note = f"{traced / max(carried, 1):.3f} of those that an edit can change or that begin on a moved object"
        figures.append(Figure("rays of the update over rays that an edit can change", name, traced / max(crossing, 1), "", "",
                              None, None, "≤ 2", note=note,
                              details={"traced": traced, "can change": crossing, "or begin on what moves": carried}).judged())
    return figures
