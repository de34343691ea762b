# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of the methods, made from what each method says about itself: a new method brings no code here.

A description is a dictionary (`afterglow.method_descriptions`): id, label, description, settings. The numbers of the
enum items are explicit, because Blender stores numbers in its files.
"""

import zlib
from typing import Any

import bpy

from .. import backend

# Numbers that files hold already; a method that is not here gets one from its name, which is as lasting.
METHOD_NUMBERS = {"AUTO": 0, "PATH_TRACING": 1, "INSTANT_RADIOSITY": 2, "INSTANT_CACHE": 3, "HASH_CACHE": 4}

_groups: dict[str, type] = {}


def method_number(identifier: str) -> int:
    """The lasting number of a method in .blend files."""
    return METHOD_NUMBERS.get(identifier, 0x100 + (zlib.crc32(identifier.encode()) & 0x3FFFFFFF))


def method_items() -> list[tuple[str, str, str, int]]:
    """Items of `scene.afterglow.method`: the choice by the engine first, then every method."""
    items = [
        (
            "AUTO",
            "Automatic",
            "Let the engine choose the method that reaches the accuracy soonest",
            method_number("AUTO"),
        )
    ]
    for method in backend.method_descriptions():
        if method["id"] != "AUTO":
            items.append((method["id"], method["label"], method["description"], method_number(method["id"])))
    return items


def make_property(setting: dict[str, Any]) -> Any:
    """The Blender property for one setting of a method's description."""
    common = {"name": setting["label"], "description": setting["description"]}
    kind, unit = setting["type"], setting.get("unit") or ""
    if kind == "bool":
        return bpy.props.BoolProperty(default=bool(setting["default"]), **common)
    if kind in ("enum", "choice"):
        items = [
            item if isinstance(item, (tuple, list)) else (item, str(item).replace("_", " ").title(), "")
            for item in setting.get("items", setting.get("choices", ()))
        ]
        numbered = [(*item[:3], zlib.crc32(item[0].encode()) & 0x3FFFFFFF) for item in items]
        return bpy.props.EnumProperty(items=numbered, default=setting["default"], **common)
    for bound in ("min", "max"):
        if setting.get(bound) is not None:
            common[bound] = int(setting[bound]) if kind == "int" else setting[bound]
    if kind == "int":
        return bpy.props.IntProperty(default=int(setting["default"]), **common)
    if kind in ("str", "string"):
        return bpy.props.StringProperty(
            default=str(setting["default"]), name=common["name"], description=common["description"]
        )
    blender_unit = {"s": "TIME", "m": "LENGTH", "rad": "ROTATION", "W": "POWER"}.get(unit, "NONE")
    subtype = {"fraction": "FACTOR", "rad": "ANGLE"}.get(unit, "NONE")
    return bpy.props.FloatProperty(
        default=float(setting["default"]), unit=blender_unit, subtype=subtype, precision=4, **common
    )


def tell_viewports(group: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    """A changed setting reaches the viewports: Blender by itself tells them of changes by hand, not of a script's."""
    group.id_data.update_tag()


def tell_changes(group: type) -> None:
    """Makes every setting of a group that is not registered yet tell the viewports when it changes."""
    for setting in group.__annotations__.values():
        if setting.function is not bpy.props.PointerProperty:
            setting.keywords["update"] = tell_viewports


def group_name(identifier: str) -> str:
    """Where a method's own settings live in `scene.afterglow`: `path_tracing` for PATH_TRACING."""
    return identifier.lower()


def own_settings(method: dict[str, Any], shared: set[str]) -> list[dict[str, Any]]:
    """Settings that only this method has; what all methods share stands in `scene.afterglow` itself."""
    return [setting for setting in method.get("settings", ()) if setting["name"] not in shared]


def is_debug(name: str) -> bool:
    """Whether a setting is there to look into a method, not to render."""
    return name.endswith(("_view", "_verify"))


def with_views(setting: dict[str, Any], method: dict[str, Any]) -> dict[str, Any]:
    """The setting that chooses a debug view as a choice among those that the method names; others as they are."""
    if not setting["name"].endswith("_view") or not method.get("debug_views"):
        return setting
    return {**setting, "type": "enum", "items": [setting["default"], *method["debug_views"]]}


def build_groups(shared: set[str]) -> dict[str, type]:
    """One property group for every method that has settings of its own, by the name it gets in `scene.afterglow`."""
    for method in backend.method_descriptions():
        settings = own_settings(method, shared)
        name = group_name(method["id"])
        if settings and name not in _groups:
            annotations = {setting["name"]: make_property(with_views(setting, method)) for setting in settings}
            title = "AfterglowMethod" + method["id"].title().replace("_", "")
            _groups[name] = type(title, (bpy.types.PropertyGroup,), {"__annotations__": annotations})
    return _groups


def register() -> None:
    from .scene import SHARED_SETTINGS

    for group in build_groups(SHARED_SETTINGS).values():
        tell_changes(group)
        bpy.utils.register_class(group)


def unregister() -> None:
    for group in _groups.values():
        bpy.utils.unregister_class(group)
    _groups.clear()
