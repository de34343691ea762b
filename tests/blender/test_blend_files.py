# SPDX-License-Identifier: GPL-3.0-or-later
"""The animated files of `blend_files` are, in every frame asked, the procedural scenes they were written from."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest


@pytest.mark.parametrize("name", ["wobbling_cylinder", "kite", "bouncing_bunnies", "desk_with_chair", "spheres",
                                  "cornell_statue", "conference_room", "pillared_hall", "office_with_blinds"])
def test_motion_in_the_file_is_that_of_the_scene(in_blender: Callable[..., dict[str, Any]], blend_files: Path, name: str) -> None:
    found = in_blender(
        f"""
        from afterglow import scenes
        made, off, checked = scenes.BLEND_FILES[{name!r}](), 0.0, 0
        for frame in (1, 7, made.frames[1]):
            bpy.context.scene.frame_set(frame)
            depsgraph = bpy.context.evaluated_depsgraph_get()
            for item in made.objects:
                mesh, places = made.meshes[item.mesh], item.at(frame)
                for i, place in enumerate(places, 1):
                    name = item.name if len(places) == 1 else f"{{item.name}} {{i}}"
                    thing = bpy.data.objects[name].evaluated_get(depsgraph)
                    points = np.empty(3 * len(thing.data.vertices), np.float32)
                    thing.data.vertices.foreach_get("co", points)
                    wanted = mesh.positions if mesh.deform is None else mesh.deform(frame)
                    off = max(off, float(abs(points.reshape(-1, 3) - wanted).max()),
                              float(abs(np.array(thing.matrix_world) - place).max()))
                checked += mesh.deform is not None or item.move is not None
        result(off=off, checked=checked)
        """,
        blend_files / f"{name}.blend",
    )
    assert found["checked"] >= 3
    assert found["off"] < 1e-5


def test_one_file_holds_one_two_four_and_nine_bunnies(in_blender: Callable[..., dict[str, Any]], blend_files: Path) -> None:
    found = in_blender(
        """
        result(moving={scene.name: sum(o.animation_data is not None for o in scene.objects if o.name.startswith("Bunny"))
                       for scene in bpy.data.scenes},
               meshes=sum(len(mesh.polygons) > 60000 for mesh in bpy.data.meshes),
               all=[sum(o.name.startswith("Bunny") for o in scene.objects) for scene in bpy.data.scenes])
        """,
        blend_files / "bouncing_bunnies.blend",
    )
    assert found["moving"] == {"bouncing_bunnies": 9, "bouncing_bunnies_1": 1, "bouncing_bunnies_2": 2, "bouncing_bunnies_4": 4}
    assert found["meshes"] == 1 and found["all"] == [9, 9, 9, 9]
