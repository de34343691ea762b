# SPDX-License-Identifier: GPL-3.0-or-later
"""Takes the pictures of the user guide: docs/images/*.jpg, of a real Blender in a window under Xvfb, whole interface.

Usage: python3 tools/screenshots.py (Debian's packages xvfb and imagemagick; `make build` first). The same file runs inside
Blender, where it goes through the steps and asks for a picture after each."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
IMAGES = ROOT / "docs" / "images"
SIZE = (1280, 800)
FILE = ROOT / "blend_files" / "textured_room.blend"
INSIDE = "AFTERGLOW_SCREENSHOTS" in os.environ

if INSIDE:
    import bpy


def take(name: str) -> None:
    """A picture of the whole window."""
    window = ["import", "-window", "root", "-quality", "80", str(IMAGES / f"{name}.jpg")]
    subprocess.run(window, check=True)


def area(kind: str) -> bpy.types.Area:
    areas = bpy.context.window_manager.windows[0].screen.areas
    return max((a for a in areas if a.type == kind), key=lambda a: a.width * a.height)


def override(it: bpy.types.Area) -> object:
    region = next(r for r in it.regions if r.type == "WINDOW")
    return bpy.context.temp_override(window=bpy.context.window_manager.windows[0], area=it, region=region)


def open_panels() -> None:
    """Opens the render tab's closed panels in editors that have not shown them yet."""
    from render_afterglow.ui import render

    for kind in reversed(render.classes):
        bpy.utils.unregister_class(kind)
    for kind in render.classes:
        if hasattr(kind, "bl_options"):
            kind.bl_options = set(kind.bl_options) - {"DEFAULT_CLOSED"}
        bpy.utils.register_class(kind)


def steps() -> Iterator[float]:
    scene = bpy.context.scene
    settings = scene.afterglow
    scene.render.engine = "AFTERGLOW"
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 640, 400, 100
    settings.samples, settings.accuracy, settings.preview_samples = 256, 0.05, 64
    view, properties = area("VIEW_3D"), area("PROPERTIES")
    properties.spaces.active.context = "RENDER"
    yield 0.5
    view.spaces.active.region_3d.view_perspective = "CAMERA"
    with override(view):
        bpy.ops.view3d.view_center_camera()
    view.spaces.active.overlay.show_overlays = False
    view.spaces.active.shading.type = "RENDERED"
    yield 25.0
    take("viewport")

    properties.spaces.active.context = "VIEW_LAYER"
    yield 0.7
    take("passes")
    properties.spaces.active.context = "RENDER"
    view.spaces.active.shading.type = "SOLID"
    yield 0.5

    bpy.ops.render.render()
    view.type = "IMAGE_EDITOR"
    view.spaces.active.image = bpy.data.images["Render Result"]
    yield 0.5
    with override(view):
        bpy.ops.image.view_all(fit_view=True)
    yield 1.0
    take("render")

    open_panels()
    view.type = "PROPERTIES"
    yield 0.7
    view.spaces.active.context = "RENDER"
    yield 1.0
    take("settings")
    scroll(view)
    yield 1.0
    take("settings_2")

    view.type = "IMAGE_EDITOR"
    properties.spaces.active.context = "RENDER"
    bpy.ops.afterglow.accuracy_chart(percent=15, samples=128)
    yield 1.0
    end = time.time() + 150
    while "Afterglow Accuracy" not in bpy.data.images and time.time() < end:
        yield 0.5
    yield 1.0
    with override(view):
        bpy.ops.image.view_all(fit_view=True)
    yield 1.0
    take("accuracy_chart")


def scroll(properties: bpy.types.Area) -> None:
    """To the end of the tab, where the last render's figures are."""
    with override(properties):
        for _ in range(60):
            bpy.ops.view2d.scroll_down()


def inside() -> None:
    bpy.context.preferences.view.show_splash = False
    generator = steps()

    def step() -> float | None:
        try:
            return next(generator)
        except StopIteration:
            os._exit(0)
        except BaseException:
            import traceback

            traceback.print_exc()
            sys.stdout.flush()
            os._exit(1)

    bpy.app.timers.register(step, first_interval=1.5)


def outside() -> int:
    IMAGES.mkdir(parents=True, exist_ok=True)
    read, write = os.pipe()
    screen = ["-screen", "0", f"{SIZE[0]}x{SIZE[1]}x24", "+extension", "GLX", "-nolisten", "tcp"]
    server = subprocess.Popen(["Xvfb", "-displayfd", str(write), *screen], pass_fds=[write], stderr=subprocess.DEVNULL)
    os.close(write)
    try:
        with os.fdopen(read) as pipe:
            number = pipe.readline().strip()
        env = os.environ | {"DISPLAY": ":" + number, "LIBGL_ALWAYS_SOFTWARE": "1", "AFTERGLOW_SCREENSHOTS": "1"}
        start = [str(ROOT / "build" / "blender"), "--factory-startup", "--window-geometry", "0", "0", *map(str, SIZE)]
        return subprocess.run([*start, str(FILE), "--python", __file__], env=env, timeout=600).returncode
    finally:
        server.terminate()
        server.wait()


if __name__ == "__main__":
    if INSIDE:
        inside()
    else:
        sys.exit(outside())
