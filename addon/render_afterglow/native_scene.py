# SPDX-License-Identifier: GPL-3.0-or-later
"""A native scene with what keeps it equal to Blender's depsgraph: final renders, viewports and the accuracy chart
have one each."""

from __future__ import annotations

import bpy

from . import backend
from .sync import SceneSync
from .sync.scene import weakly


class NativeScene:
    """A native scene, what keeps it equal to the depsgraph, and the warnings that it gave."""

    def __init__(self) -> None:
        self.warnings: list[str] = []
        self.depsgraph = 0
        self.scene = backend.afterglow.Scene()
        self.sync = SceneSync(self.scene, weakly(self.log))

    def log(self, level: str, text: str) -> None:
        if level == "warning":
            self.warnings.append(text)
        else:
            print("Afterglow:", text)

    def sync_with(self, depsgraph: bpy.types.Depsgraph, view: bpy.types.SpaceView3D | None = None) -> None:
        """Makes the native scene equal to the depsgraph, as a view shows it. Everything is read again where it is another
        depsgraph than before, or where edits may have been missed since; what then turns out to be the same changes
        nothing, so that the methods keep what they remember."""
        address = depsgraph.as_pointer()
        self.sync.sync(depsgraph, view=view, full=address != self.depsgraph)
        self.depsgraph = address

    def rest(self) -> None:
        """From now on edits are missed: the next sync reads everything."""
        self.depsgraph = 0

    def take_warnings(self) -> list[str]:
        taken, self.warnings[:] = list(dict.fromkeys(self.warnings)), []
        return taken
