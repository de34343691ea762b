# SPDX-License-Identifier: GPL-3.0-or-later
"""Which rays see an object, an instance or the world: Blender's flags as the native module's bits."""
from __future__ import annotations

from typing import Any

# the native module's values, so that everything here can be read without the module
CAMERA, DIFFUSE, GLOSSY, TRANSMISSION, SHADOW, VOLUME = (1 << bit for bit in range(6))
ALL_RAYS = (1 << 6) - 1

FLAGS = (("visible_camera", CAMERA), ("visible_diffuse", DIFFUSE), ("visible_glossy", GLOSSY),
         ("visible_transmission", TRANSMISSION), ("visible_shadow", SHADOW), ("visible_volume_scatter", VOLUME))
WORLD_FLAGS = (("camera", CAMERA), ("diffuse", DIFFUSE), ("glossy", GLOSSY), ("transmission", TRANSMISSION),
               ("scatter", VOLUME))


def use_bits(module: Any) -> None:
    """Takes the bits from the native module, where it is there."""
    names = ("CAMERA", "DIFFUSE", "GLOSSY", "TRANSMISSION", "SHADOW", "VOLUME")
    bits = [getattr(module, name) for name in names]
    global FLAGS, WORLD_FLAGS, ALL_RAYS
    FLAGS = tuple((flag, bits[i]) for i, (flag, _) in enumerate(FLAGS))
    WORLD_FLAGS = tuple((flag, bits[i]) for (flag, _), i in zip(WORLD_FLAGS, (0, 1, 2, 3, 5), strict=True))
    ALL_RAYS = module.ALL_RAYS


def object_visibility(ob: Any, parent: Any, view_layer: Any) -> tuple[int, bool, bool]:
    """(bits, holdout, shadow catcher) of an object, or of an instance that `parent` made."""
    bits = ALL_RAYS
    holdout = catcher = False
    for owner in (ob,) if parent is None else (ob, parent):
        for name, bit in FLAGS:
            if not getattr(owner, name, True):
                bits &= ~bit
        catcher = catcher or bool(getattr(owner, "is_shadow_catcher", False))
    owner = ob if parent is None else parent
    if view_layer is not None:
        holdout = bool(owner.holdout_get(view_layer=view_layer))
        if owner.indirect_only_get(view_layer=view_layer):
            bits &= ~FLAGS[0][1]
    return bits, holdout or bool(owner.is_holdout), catcher


def world_visibility(world: Any) -> int:
    flags, bits = getattr(world, "cycles_visibility", None), ALL_RAYS
    for name, bit in WORLD_FLAGS:
        if not getattr(flags, name, True):
            bits &= ~bit
    return bits
