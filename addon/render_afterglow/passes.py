# SPDX-License-Identifier: GPL-3.0-or-later
"""Render passes: what Blender calls them, what the native session calls them, and which of them a view layer asks for.

Names are those of the running Blender's Cycles, so that compositor set-ups keep working; Cycles renamed its passes in
5.0.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import bpy

# Blender from this version on has the long names of passes.
LONG_NAMES_SINCE = (5, 0, 0)


class Pass(NamedTuple):
    """One pass: the native name, Blender's old and new names, channels, kind of data, and the view layer's switch."""

    native: str
    short: str
    long: str
    channels: str
    kind: str
    switch: str

    @property
    def name(self) -> str:
        return self.long if bpy.app.version >= LONG_NAMES_SINCE else self.short


COMBINED = Pass("combined", "Combined", "Combined", "RGBA", "COLOR", "use_pass_combined")
NOISY = Pass("combined_noisy", "Noisy Image", "Noisy Image", "RGBA", "COLOR", "")

PASSES = (
    Pass("depth", "Depth", "Depth", "Z", "VALUE", "use_pass_z"),
    Pass("mist", "Mist", "Mist", "Z", "VALUE", "use_pass_mist"),
    Pass("position", "Position", "Position", "XYZ", "VECTOR", "use_pass_position"),
    Pass("normal", "Normal", "Normal", "XYZ", "VECTOR", "use_pass_normal"),
    Pass("uv", "UV", "UV", "UVA", "VECTOR", "use_pass_uv"),
    Pass("object_index", "IndexOB", "Object Index", "X", "VALUE", "use_pass_object_index"),
    Pass("material_index", "IndexMA", "Material Index", "X", "VALUE", "use_pass_material_index"),
    Pass("diffuse_direct", "DiffDir", "Diffuse Direct", "RGB", "COLOR", "use_pass_diffuse_direct"),
    Pass("diffuse_indirect", "DiffInd", "Diffuse Indirect", "RGB", "COLOR", "use_pass_diffuse_indirect"),
    Pass("diffuse_color", "DiffCol", "Diffuse Color", "RGB", "COLOR", "use_pass_diffuse_color"),
    Pass("glossy_direct", "GlossDir", "Glossy Direct", "RGB", "COLOR", "use_pass_glossy_direct"),
    Pass("glossy_indirect", "GlossInd", "Glossy Indirect", "RGB", "COLOR", "use_pass_glossy_indirect"),
    Pass("glossy_color", "GlossCol", "Glossy Color", "RGB", "COLOR", "use_pass_glossy_color"),
    Pass("transmission_direct", "TransDir", "Transmission Direct", "RGB", "COLOR", "use_pass_transmission_direct"),
    Pass(
        "transmission_indirect", "TransInd", "Transmission Indirect", "RGB", "COLOR", "use_pass_transmission_indirect"
    ),
    Pass("transmission_color", "TransCol", "Transmission Color", "RGB", "COLOR", "use_pass_transmission_color"),
    Pass("emission", "Emit", "Emission", "RGB", "COLOR", "use_pass_emit"),
    Pass("environment", "Env", "Environment", "RGB", "COLOR", "use_pass_environment"),
)

DATA_PASSES = tuple(p for p in PASSES if p.kind != "COLOR")
LIGHT_PASSES = tuple(p for p in PASSES if p.kind == "COLOR")


def wanted(view_layer: bpy.types.ViewLayer) -> Iterator[Pass]:
    """The passes that a view layer asks for; Combined always is the first."""
    yield COMBINED
    for item in PASSES:
        if getattr(view_layer, item.switch, False):
            yield item


def register_passes(engine: bpy.types.RenderEngine, scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> None:
    """Tells the compositor which sockets a layer has."""
    for item in wanted(view_layer):
        engine.register_pass(scene, view_layer, item.name, len(item.channels), item.channels, item.kind)
