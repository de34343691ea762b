# SPDX-License-Identifier: GPL-3.0-or-later
"""The packaged extension in official Blenders, rendering in the background: passes by their new names, borders, layers,
metadata, animation, failures. The same scripts run in Debian's Blender in the other files."""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from . import test_engine_images
from .conftest import HERE, write_script

VERSIONS = os.environ.get("AFTERGLOW_OFFICIAL", "4.5 5.0").split()
pytestmark = pytest.mark.slow


@pytest.fixture(scope="session")
def resources(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("resources")


@pytest.fixture(params=VERSIONS)
def official(
    request: pytest.FixtureRequest,
    package: dict[str, Path],
    bpy_venv: Callable[[str], Path],
    resources: Path,
    tmp_path: Path,
) -> Callable[..., dict[str, Any]]:
    """official(text, file=None): as `in_blender`, in an official Blender with the extension."""
    python = bpy_venv(request.param)

    def run(text: str, file: Path | None = None) -> dict[str, Any]:
        values = tmp_path / "result.json"
        values.unlink(missing_ok=True)
        script = write_script(tmp_path, text)
        env = {name: value for name, value in os.environ.items() if name not in ("AFTERGLOW_LIBRARY", "PYTHONPATH")}
        env |= {"AFTERGLOW_RESULT": str(values), "BLENDER_USER_RESOURCES": str(resources / request.param)}
        command = [
            str(python),
            str(HERE / "official_start.py"),
            str(package["extension"]),
            str(script),
            str(file or "-"),
        ]
        pipes = dict(stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace")
        ended = subprocess.run(command, env=env, timeout=300, **pipes)
        assert ended.returncode == 0, ended.stdout[-6000:]
        return {**json.loads(values.read_text()), "output": ended.stdout}

    return run


def test_passes_border_layers(official: Callable[..., dict[str, Any]], blend_files: Path) -> None:
    found = official(
        """
        import os, afterglow
        passes = addon('passes')
        s, layer = scene(64, 48, samples=8), bpy.context.view_layer
        whole = render()
        r = s.render
        r.use_border = r.use_crop_to_border = True
        r.border_min_x, r.border_max_x, r.border_min_y, r.border_max_y = 0.25, 0.75, 0.5, 1.0
        result(border=np.abs(render() - whole[24:48, 16:48]).max(), level=whole[..., :3].mean(),
               samples=afterglow.statistics(s)['samples'])
        r.use_border = False
        for item in passes.PASSES:
            setattr(layer, item.switch, True)
        s.view_layers.new('Second')
        folder = os.path.dirname(os.environ['AFTERGLOW_RESULT'])
        def write(name):
            image_format(s, 'OPEN_EXR_MULTILAYER')
            s.render.filepath = os.path.join(folder, name)
            bpy.ops.render.render(write_still=True)
            return s.render.filepath
        ours = write('ours.exr')
        s.render.engine = 'CYCLES'
        s.cycles.samples, s.cycles.use_denoising = 1, False
        result(ours=ours, theirs=write('theirs.exr'))
        """,
        blend_files / "cornell_box.blend",
    )
    assert found["border"] == 0 and found["level"] > 0.02 and found["samples"] == 8
    oiio = pytest.importorskip("OpenImageIO")
    assert channel_names(oiio, found["ours"]) == channel_names(oiio, found["theirs"])
    fields = oiio.ImageInput.open(found["ours"]).spec().extra_attribs
    assert any(item.name.endswith(".samples") and item.name.startswith("afterglow.") for item in fields)


def channel_names(oiio: Any, path: str) -> set[str]:
    image, part, names = oiio.ImageInput.open(path), 0, set()
    while image.seek_subimage(part, 0):
        names |= set(image.spec().channelnames)
        part += 1
    return names


def test_animation_failure_panels(official: Callable[..., dict[str, Any]]) -> None:
    found = official(
        """
        import addon_utils, glob, os
        s = scene(48, 32, samples=4)
        cube = bpy.data.objects['Cube']
        cube.keyframe_insert('location', frame=1); cube.location.x += 2; cube.keyframe_insert('location', frame=3)
        folder = os.path.dirname(os.environ['AFTERGLOW_RESULT'])
        image_format(s, 'PNG')
        s.frame_start, s.frame_end, s.render.filepath = 1, 3, os.path.join(folder, 'frame_')
        s.render.use_persistent_data = True
        bpy.ops.render.render(animation=True)
        frames = sorted(glob.glob(os.path.join(folder, 'frame_*.png')))
        result(frames=[hash(open(f, 'rb').read()) for f in frames])
        s.render.use_multiview = True
        try:
            bpy.ops.render.render()
        except RuntimeError as error:
            print(error)
        s.render.use_multiview = False
        result(after=np.isfinite(render()).all())
        panels = [p.__name__ for p in bpy.types.Panel.__subclasses__() if 'AFTERGLOW' in getattr(p, 'COMPAT_ENGINES', ())]
        result(panels=panels)
        addon_utils.disable('bl_ext.user_default.afterglow')
        result(left=hasattr(bpy.types.Scene, 'afterglow'))
        """
    )
    assert len(set(found["frames"])) == 3
    assert "stereoscopic" in found["output"]
    assert found["after"] and not found["left"]
    assert {"DATA_PT_lens", "RENDER_PT_color_management", "AFTERGLOW_RENDER_PT_sampling"} <= set(found["panels"])
    assert "Traceback" not in found["output"], found["output"][-4000:]


def test_every_kind_of_image(official: Callable[..., dict[str, Any]]) -> None:
    test_engine_images.check(official(test_engine_images.SCRIPT))


def test_what_the_bench_measures_is_the_packaged_module(package: dict[str, Path], bpy_venv: Callable[[str], Path], library: Path,
                                                        monkeypatch: pytest.MonkeyPatch) -> None:
    """Also where Python's path, as for `make bench`, or AFTERGLOW_LIBRARY names the module built from source."""
    from afterglow import blenders

    bpy_venv("5.0")
    monkeypatch.setenv("PYTHONPATH", str(library))
    monkeypatch.setenv("AFTERGLOW_LIBRARY", str(library))
    with blenders.Worker.of_official("5.0") as worker:
        assert worker.problem == "" and library not in Path(worker.module).parents
        assert Path(worker.module).is_relative_to(blenders.resources("5.0"))
