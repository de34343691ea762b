# SPDX-License-Identifier: GPL-3.0-or-later
"""What the last render of each scene did, for scripts: the add-on writes it, `afterglow.statistics(scene)` reads it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

_records: dict[str, dict[str, dict[str, Any]]] = {}


def _key(scene: Any) -> str:
    """A scene's name: of a Blender scene with its library's, of a text the text itself."""
    return scene if isinstance(scene, str) else getattr(scene, "name_full", None) or scene.name


def record_statistics(scene: Any, statistics: Mapping[str, Any], layer: str = "") -> None:
    """Keeps what a render of one view layer did until the same layer is rendered again."""
    layers = _records.setdefault(_key(scene), {})
    layers.pop(layer, None)  # the layer rendered last stands last
    layers[layer] = dict(statistics)


def statistics(scene: Any, layer: str | None = None) -> dict[str, Any]:
    """What the last render of a scene did: method, samples, seconds by stage, believed error, rays, bytes, dropped values,
    warnings (see `Session.statistics`), of the view layer rendered last unless `layer` names one. scene: a Blender scene or
    a scene's name. Empty when nothing of it was rendered yet."""
    layers = _records.get(_key(scene), {})
    if layer is not None:
        return dict(layers.get(layer, {}))
    return dict(next(reversed(layers.values()), {}))


def clear_statistics() -> None:
    """Forgets every render: another file was opened."""
    _records.clear()
