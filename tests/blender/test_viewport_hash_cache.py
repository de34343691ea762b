# SPDX-License-Identifier: GPL-3.0-or-later
"""HashCache in Blender's viewport: cells that one view filled serve the next, over switches of the shading, too; edits heal."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

Run = Callable[..., dict[str, Any]]


def test_cells_live_while_the_view_walks_and_switches(in_window: Run, blend_files: Path) -> None:
    found = in_window(
        """
        s = scene()
        s.afterglow.method = 'HASH_CACHE'
        s.afterglow.preview_accuracy, s.afterglow.preview_samples = 0.0, 4
        s.render.preview_pixel_size = '2'
        lamp = s.objects['Lamp']
        seen = []

        def look(name):
            statistics = viewport().session.statistics()
            values = statistics['values']
            seen.append({'name': name, 'status': addon().viewport.cache_status(statistics)[0],
                         'method': statistics['method'], **{key: values[key] for key in (
                'cache_resets', 'cells', 'cache_paths')}})
            return view_picture().copy()

        def steps():
            space = full_view(); yield 1.0
            yield from settled(); first = look('first')
            s.camera.location.x += 0.1; yield 0.1
            yield from settled(); walked = look('walked')
            s.camera.location.x -= 0.1; yield 0.1
            yield from settled(); returned = look('returned')
            space.shading.type = 'SOLID'; yield 0.3
            space.shading.type = 'RENDERED'; yield 0.3
            yield from settled(); back = look('back')
            lamp.data.energy *= 2; yield 0.1
            yield from settled(); brighter = look('brighter')
            result(seen=seen, walked=np.abs(walked - first).mean(), returned=np.abs(returned - first).mean(),
                   back=np.abs(back - first).mean(), brighter=(brighter - back).mean())
        drive(steps)
        """,
        blend_files / "cornell_box.blend",
    )
    first, walked, returned, back, _ = found["seen"]
    assert first["method"] == "HASH_CACHE"
    assert first["status"].startswith(f"{int(first['cells']):,} cells, ") and first["status"].endswith("MiB")
    assert [it["cache_resets"] for it in found["seen"]] == [1, 1, 1, 1, 1]
    assert first["cells"] <= walked["cells"] <= returned["cells"] <= back["cells"]
    assert found["returned"] < 0.02 and found["back"] < 0.02 and found["brighter"] > 0.02, found
    assert "Traceback" not in found["output"], found["output"][-3000:]
