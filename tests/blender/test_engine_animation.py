# SPDX-License-Identifier: GPL-3.0-or-later
"""Animations: frames from the command line, persistent data, many renders in one process without a leak."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

Run = Callable[..., dict[str, Any]]

MOVING = """
s = scene(48, 32, samples=4)
cube = bpy.data.objects['Cube']
cube.keyframe_insert('location', frame=1)
cube.location.x += 2.0
cube.keyframe_insert('location', frame=3)
s.frame_start, s.frame_end = 1, 3
"""


def test_frames_from_the_command_line(blender: Callable[..., Any], in_blender: Run, tmp_path: Path) -> None:
    saved = tmp_path / "moving.blend"
    in_blender(MOVING + f"image_format(s, 'PNG')\nbpy.ops.wm.save_as_mainfile(filepath={str(saved)!r})")
    ended = blender(saved, "-E", "AFTERGLOW", "-o", str(tmp_path / "frame_"), "-a")
    assert ended.returncode == 0
    pictures = sorted(tmp_path.glob("frame_*.png"))
    assert len(pictures) == 3, ended.stdout[-2000:]
    assert len({picture.read_bytes() for picture in pictures}) == 3


@pytest.mark.parametrize("method", ["PATH_TRACING", "INSTANT_RADIOSITY"])
def test_persistent_data_changes_no_pixel(in_blender: Run, method: str) -> None:
    """Of methods that remember nothing between frames."""
    found = in_blender(
        MOVING
        + f"s.afterglow.method = {method!r}"
        + """
differences, kept = [], []
for frame in (1, 2, 3, 1):
    s.frame_set(frame)
    s.render.use_persistent_data = False
    fresh = render()
    s.render.use_persistent_data = True
    differences.append(np.abs(render() - fresh).max())
# without a fresh render in between
frames = []
for frame in (1, 2, 3, 1):
    s.frame_set(frame)
    frames.append(render())
result(differences=differences, moved=np.abs(frames[0] - frames[2]).max(), back=np.abs(frames[0] - frames[3]).max())
"""
    )
    assert found["differences"] == [0, 0, 0, 0]
    assert found["moved"] > 0.01 and found["back"] == 0


@pytest.mark.slow
def test_two_hundred_files_opened_rendered_closed(in_blender: Run, blend_files: Path) -> None:
    found = in_blender(
        """
        import gc, os, threading
        def resident():
            with open('/proc/self/statm') as file:
                return int(file.read().split()[1]) * os.sysconf('SC_PAGE_SIZE')
        path, sizes, threads = arguments()[0], [], []
        for cycle in range(200):
            bpy.ops.wm.open_mainfile(filepath=path)
            scene(32, 32, samples=1)
            bpy.ops.render.render()
            bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
            gc.collect()
            sizes.append(resident())
            threads.append(threading.active_count())
        result(sizes=sizes, threads=threads, sessions=addon('store')._kept == {})
        """,
        None,
        str(blend_files / "cornell_box.blend"),
    )
    sizes = found["sizes"]
    first, last = sum(sizes[40:80]) / 40, sum(sizes[160:200]) / 40
    assert found["threads"][-1] <= found["threads"][0]
    assert found["sessions"]
    # the same growth of Blender itself, without a render, is below this
    assert last - first < 4e6, f"{(last - first) / 120:.0f} bytes a cycle"
