# SPDX-License-Identifier: GPL-3.0-or-later
"""What test scripts use inside Blender: results handed out, pictures of the real window, steps driven by timers.

Not a test by itself. A script's results go to the file that AFTERGLOW_RESULT names, as JSON. In a window under Xvfb the
screen is a file (AFTERGLOW_SCREEN, made by `Xvfb -fbdir`), so that a picture of the window is an array read from it.
"""

from __future__ import annotations

import gc
import json
import os
import shutil
import sys
import time
import traceback
from collections.abc import Callable, Iterator
from typing import Any

import bpy
import numpy as np


def arguments() -> list[str]:
    """The script's own arguments."""
    return sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else []


def result(**values: Any) -> None:
    """Adds to what the test gets."""
    path = os.environ["AFTERGLOW_RESULT"]
    old = {}
    if os.path.exists(path):
        with open(path) as file:
            old = json.load(file)
    with open(path, "w") as file:
        json.dump({**old, **values}, file, default=plain)


def plain(value: Any) -> Any:
    """Numbers and arrays of numpy as plain data."""
    return value.tolist() if hasattr(value, "tolist") else str(value)


def addon(name: str = "") -> Any:
    """The add-on's module, or one in it: its name differs between a legacy add-on and an extension."""
    root = next(
        m for m in sorted(sys.modules) if m.endswith("render_afterglow") or m == "bl_ext.user_default.afterglow"
    )
    __import__(root + "." + name if name else root)
    return sys.modules[root + "." + name if name else root]


def scene(width: int = 96, height: int = 64, samples: int = 8, **settings: Any) -> bpy.types.Scene:
    """The open file's scene, set up for a small render of exactly so many samples."""
    it = bpy.context.scene
    it.render.engine = "AFTERGLOW"
    it.render.resolution_x, it.render.resolution_y, it.render.resolution_percentage = width, height, 100
    it.afterglow.method, it.afterglow.accuracy, it.afterglow.samples = "PATH_TRACING", 0.0, samples
    for name, value in settings.items():
        setattr(it.afterglow, name, value)
    return it


def render(name: str = "render.exr") -> np.ndarray:
    """Renders the frame; gives Combined as (height, width, 4) floats, row 0 at the bottom."""
    it = bpy.context.scene
    target = os.path.join(os.path.dirname(os.environ["AFTERGLOW_RESULT"]), name)
    image_format(it, "OPEN_EXR")
    it.render.filepath = target
    bpy.ops.render.render(write_still=True)
    return load(target)


def image_format(it: bpy.types.Scene, name: str) -> None:
    """Chooses the format of files; Blender 5.0 asks for the kind of medium first."""
    settings = it.render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "MULTI_LAYER_IMAGE" if name == "OPEN_EXR_MULTILAYER" else "IMAGE"
    settings.file_format = name
    if name.startswith("OPEN_EXR"):
        settings.color_depth = "32"


def load(path: str, colorspace: str = "Non-Color") -> np.ndarray:
    """A file's pixels without any colour management: (height, width, channels), row 0 at the bottom."""
    image = bpy.data.images.load(path)
    try:
        image.colorspace_settings.name = colorspace
        pixels = np.empty(image.size[0] * image.size[1] * image.channels, np.float32)
        image.pixels.foreach_get(pixels)
        return pixels.reshape(image.size[1], image.size[0], image.channels).copy()
    finally:
        bpy.data.images.remove(image)


# In a window ---------------------------------------------------------------------------------------------------------


def screen() -> np.ndarray:
    """The whole screen as (height, width, 3) display values 0 to 1, row 0 at the top."""
    width, height = (int(n) for n in os.environ["AFTERGLOW_SCREEN_SIZE"].split("x"))
    path = os.environ["AFTERGLOW_SCREEN"]
    memory = np.memmap(path, np.uint8, "r", os.path.getsize(path) - width * height * 4, (height, width, 4))
    return memory[:, :, 2::-1].astype(np.float32) / 255


def view_area() -> bpy.types.Area:
    areas = bpy.context.window_manager.windows[0].screen.areas
    return max((area for area in areas if area.type == "VIEW_3D"), key=lambda area: area.width * area.height)


def view_region() -> bpy.types.Region:
    return next(region for region in view_area().regions if region.type == "WINDOW")


def view_picture() -> np.ndarray:
    """The 3D view's part of the screen: (height, width, 3), row 0 at the bottom."""
    region, picture = view_region(), screen()[::-1]
    return picture[region.y : region.y + region.height, region.x : region.x + region.width]


def in_view() -> Any:
    """Operators called inside `with in_view():` mean the 3D view."""
    return bpy.context.temp_override(
        window=bpy.context.window_manager.windows[0], area=view_area(), region=view_region()
    )


def full_view(camera: bool = True, rendered: bool = True) -> bpy.types.SpaceView3D:
    """One 3D view over the whole window, without overlays and panels, in rendered mode, through the camera."""
    with in_view():
        bpy.ops.screen.screen_full_area(use_hide_panels=True)
    space = view_area().spaces.active
    space.overlay.show_overlays = space.show_gizmo = False
    for name in ("show_region_header", "show_region_tool_header", "show_region_toolbar", "show_region_ui"):
        if hasattr(space, name):
            setattr(space, name, False)
    if camera:
        space.region_3d.view_perspective = "CAMERA"
    if rendered:
        space.shading.type = "RENDERED"
    return space


def viewport() -> Any:
    """The engine's viewport that draws now; None when there is none."""
    kind = addon("viewport").Viewport
    found = [thing for thing in gc.get_objects() if type(thing) is kind and thing.session is not None]
    return found[-1] if found else None


def settled(seconds: float = 60.0) -> Iterator[float]:
    """`yield from settled()` waits until the viewport's session has finished and was drawn."""
    end = time.time() + seconds
    while time.time() < end:
        found = viewport()
        if found is not None and found.session.progress()["state"] == "finished":
            yield 0.4
            return
        yield 0.1
    raise AssertionError(f"the viewport did not settle: {found and found.session.progress()}")


def drive(steps: Callable[[], Iterator[float]]) -> None:
    """Runs a generator in the window: each value that it yields is the pause before its next step. Blender ends after
    the last, with an error code when a step raised. AFTERGLOW_SCREENSHOT names the file that keeps the last screen."""
    bpy.context.preferences.view.show_splash = False
    walk = steps()

    def step() -> float | None:
        try:
            return next(walk)
        except StopIteration:
            if "AFTERGLOW_SCREENSHOT" in os.environ:
                shutil.copyfile(os.environ["AFTERGLOW_SCREEN"], os.environ["AFTERGLOW_SCREENSHOT"])
            bpy.ops.wm.quit_blender()
        except BaseException:
            traceback.print_exc()
            sys.stdout.flush()
            os._exit(1)
        return None

    bpy.app.timers.register(step, first_interval=0.5)
