# SPDX-License-Identifier: GPL-3.0-or-later
"""Caches in Blender: the viewport's own choice of a method, and what it remembers over edits, switches of the view and frames."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

Run = Callable[..., dict[str, Any]]


def test_the_viewport_keeps_its_cache_over_switches_and_edits(in_window: Run, blend_files: Path) -> None:
    found = in_window(
        """
        s = scene()
        s.afterglow.method = 'AUTO'
        s.afterglow.preview_accuracy, s.afterglow.preview_samples = 0.0, 4
        s.render.preview_pixel_size = '2'
        box = s.objects['Tall']
        lamp = s.objects['Lamp']
        seen = []

        def look(name):
            statistics = viewport().session.statistics()
            values = statistics['values']
            seen.append({'name': name, 'method': statistics['method'], **{key: values[key] for key in (
                'resets', 'records', 'records_moved', 'objects_moved', 'lights_moved', 'lights_recoloured')}})
            return view_picture().copy()

        def steps():
            space = full_view(); yield 1.0
            yield from settled(); first = look('first')
            box.location.x += 0.2; yield 0.1
            yield from settled(); moved = look('moved')
            lamp.data.energy *= 2; yield 0.1
            yield from settled(); brighter = look('brighter')
            space.shading.type = 'SOLID'; yield 0.3
            box.location.x -= 0.2
            lamp.data.energy /= 2; yield 0.2
            space.shading.type = 'RENDERED'; yield 0.3
            yield from settled(); back = look('back')
            space.shading.type = 'SOLID'; yield 0.3
            addon('store')._resting.clear()
            space.shading.type = 'RENDERED'; yield 0.3
            yield from settled(); fresh = look('fresh')
            result(seen=seen, moved=np.abs(moved - first).mean(), brighter=(brighter - moved).mean(),
                   back=np.abs(back - first).mean(), fresh=np.abs(back - fresh).mean())
        drive(steps)
        """,
        blend_files / "cornell_box.blend",
    )
    first, moved, brighter, back, _fresh = found["seen"]
    assert first["method"] == "INSTANT_CACHE"
    assert [it["resets"] for it in found["seen"]] == [1, 1, 1, 1, 1]
    assert moved["objects_moved"] == 1 and moved["records_moved"] > 10
    assert brighter["objects_moved"] == 0 and brighter["lights_moved"] == 0 and brighter["lights_recoloured"] > 50
    assert back["objects_moved"] == 1 and back["records"] >= first["records"]
    assert found["moved"] > 0.005 and found["brighter"] > 0.02
    assert found["back"] < 0.005 and found["fresh"] < 0.005, found
    assert "Traceback" not in found["output"], found["output"][-3000:]


def test_the_viewport_follows_an_edit_by_instant_radiosity(in_window: Run, blend_files: Path) -> None:
    """The method that remembers nothing: each state's picture is its own, and coming back shows the first again."""
    found = in_window(
        """
        s = scene()
        s.afterglow.method = 'INSTANT_RADIOSITY'
        s.afterglow.preview_accuracy, s.afterglow.preview_samples = 0.0, 4
        s.render.preview_pixel_size = '4'
        box, seen = s.objects['Tall'], []

        def look():
            seen.append(viewport().session.statistics()['method'])
            return view_picture().copy()

        def steps():
            full_view(); yield 1.0
            yield from settled(); first = look()
            box.location.x += 0.2; yield 0.1
            yield from settled(); moved = look()
            box.location.x -= 0.2; yield 0.1
            yield from settled(); back = look()
            result(seen=seen, light=first.mean(), moved=np.abs(moved - first).mean(), back=np.abs(back - first).mean())
        drive(steps)
        """,
        blend_files / "cornell_box.blend",
    )
    assert "Traceback" not in found["output"], found["output"][-3000:]
    assert found["seen"] == ["INSTANT_RADIOSITY"] * 3
    assert found["light"] > 0.05 and found["moved"] > 0.005 and found["back"] < 0.1 * found["moved"], found


def test_frames_of_an_animation_share_a_cache(in_blender: Run, blend_files: Path) -> None:
    found = in_blender(
        """
        import os
        s = scene(96, 72, samples=1, method='INSTANT_CACHE')
        box = s.objects['Tall']
        for frame in (1, 2, 3):
            box.location.x += 0.1
            box.keyframe_insert('location', frame=frame)
        s.frame_start, s.frame_end = 1, 3
        s.render.filepath = os.path.join(os.path.dirname(os.environ['AFTERGLOW_RESULT']), 'frame_')
        seen = []
        store = addon('store')
        bpy.app.handlers.render_post.append(lambda *_: seen.append(store.statistics(s)['values']))
        bpy.ops.render.render(animation=True)
        result(resets=[v['resets'] for v in seen], moved=[v['objects_moved'] for v in seen], kept=len(store._kept))
        """,
        blend_files / "cornell_box.blend",
    )
    assert found["resets"] == [1, 1, 1]
    assert found["moved"][1:] == [1, 1]
    assert found["kept"] == 0


def test_caches_are_saved_loaded_forgotten_and_shown(in_window: Run, blend_files: Path, tmp_path: Path) -> None:
    """The buttons of the panel, for both methods that remember; without a viewport that renders they are greyed out."""
    found = in_window(
        f"""
        s = scene()
        s.afterglow.preview_accuracy, s.afterglow.preview_samples = 0.0, 2
        s.render.preview_pixel_size = '4'
        seen = {{}}
        panel = addon('ui.render')

        def values():
            return viewport().session.statistics()['values']

        def steps():
            ops = bpy.ops.afterglow
            seen['asleep'] = [op.poll() for op in (ops.cache_save, ops.cache_load, ops.cache_forget)]
            space = full_view(); yield 1.0
            for method, held, resets in (('INSTANT_CACHE', 'records', 'resets'), ('HASH_CACHE', 'cells', 'cache_resets')):
                s.afterglow.method = method; yield 0.3
                yield from settled()
                path, it = {str(tmp_path)!r} + '/' + method, {{}}
                first, before = view_picture().copy(), values()
                it['held'] = before[held]
                it['save'] = list(ops.cache_save(filepath=path))
                it['forget'] = list(ops.cache_forget()); yield 0.1
                it['load'] = list(ops.cache_load(filepath=path)); yield 0.1
                yield from settled()
                it['resets'], it['loaded'] = values()[resets], values()[held]
                it['same'] = np.abs(view_picture() - first).mean()
                try:
                    ops.cache_load(filepath=path + ' that is not there')
                    it['error'] = ''
                except RuntimeError as error:
                    it['error'] = str(error)
                group, name = panel.view_setting(s)
                choices = addon('backend').method_descriptions()
                views = next(m for m in choices if m['id'] == method)['debug_views']
                setattr(group, name, views[0]); yield 0.1
                yield from settled()
                it['shown'] = np.abs(view_picture() - first).mean()
                seen[method] = it
            result(**seen)
        drive(steps)
        """,
        blend_files / "cornell_box.blend",
    )
    assert "Traceback" not in found["output"], found["output"][-3000:]
    assert found["asleep"] == [False, False, False]
    for method in ("INSTANT_CACHE", "HASH_CACHE"):
        it = found[method]
        assert it["save"] == it["load"] == it["forget"] == ["FINISHED"] and it["held"] > 10, it
        assert (tmp_path / method).stat().st_size > 1000 and it["error"]
        assert it["loaded"] >= 0.9 * it["held"] and it["resets"] == 0 and it["same"] < 0.02, it
        assert it["shown"] > 0.05, it


def test_frames_of_an_animation_share_cells(in_blender: Run, blend_files: Path) -> None:
    """HashCache: the second frame begins with the cells of the first, and an object that moves throws none but its own away."""
    found = in_blender(
        """
        import os
        s = scene(64, 48, samples=1, method='HASH_CACHE')
        box = s.objects['Tall']
        for frame in (1, 2, 3):
            box.location.x += 0.1
            box.keyframe_insert('location', frame=frame)
        s.frame_start, s.frame_end = 1, 3
        s.render.filepath = os.path.join(os.path.dirname(os.environ['AFTERGLOW_RESULT']), 'frame_')
        seen = []
        store = addon('store')
        bpy.app.handlers.render_post.append(lambda *_: seen.append(store.statistics(s)['values']))
        bpy.ops.render.render(animation=True)
        result(resets=[v['cache_resets'] for v in seen], cells=[v['cells'] for v in seen], kept=len(store._kept))
        """,
        blend_files / "cornell_box.blend",
    )
    assert found["resets"] == [1, 1, 1]
    assert found["cells"][0] > 100 and found["cells"][1] > 0.8 * found["cells"][0]
    assert found["kept"] == 0
