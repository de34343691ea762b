# SPDX-License-Identifier: GPL-3.0-or-later
"""From an object's move to the first viewport image of the new state, seen from outside a real window under Xvfb.

Blender runs the shared program (../shared/tools/viewport_latency.py), which opens the view and moves the object. What the
screen shows is judged here in blocks of pixels: the program's own number compares pixel with pixel, and a path traced
picture's noise, which differs from image to image, hides the edit there for seconds. That number is kept in the details.
"""

from __future__ import annotations

import os
import shutil
import statistics
import subprocess
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ... import blenders
from ..figure import Context, Figure, spread_of_median
from .kitchen import scene

OBJECT, STEP, SETTLE, WATCH = "Mesh090", "0.4", 10.0, 9.0
WIDTH, HEIGHT, MARGIN, BLOCK = 800, 600, 60, 8
PATH_TRACED = ("method=PATH_TRACING",)  # this set's method; the viewport's own choice has a figure in another set
CHANGED = 0.06  # of display white: blocks that the edit changes
LEVELS = 10


@dataclass
class Watched:
    """Pictures of the screen, each with the seconds since the edit; the first is the one of before."""

    seconds: list[float]
    pictures: list[NDArray[np.float32]]


def blocks(picture: NDArray[np.float32]) -> NDArray[np.float32]:
    """Means over blocks of pixels and channels."""
    rows, columns = (n // BLOCK for n in picture.shape[:2])
    return picture[: rows * BLOCK, : columns * BLOCK].reshape(rows, BLOCK, columns, BLOCK, -1).mean((1, 3, 4))


def smooth(values: NDArray[np.float32]) -> NDArray[np.float32]:
    """Means of three by three blocks."""
    rows, columns = values.shape
    padded = np.pad(values, 1, mode="edge")
    return np.mean([padded[y : y + rows, x : x + columns] for y in range(3) for x in range(3)], axis=0)


def new_share(before: NDArray[np.float32], after: NDArray[np.float32], picture: NDArray[np.float32]) -> float:
    """How much of the way from the picture before to the one after a picture of the screen has gone, 0 to 1, from block means.
    Noise makes pictures darker on screen, because bright samples are cut off; how much at each brightness is learned from the
    blocks that the edit leaves alone."""
    old, new, seen = smooth(blocks(before)), smooth(blocks(after)), blocks(picture)
    changed = np.abs(new - old) > CHANGED
    if changed.sum() < 8:
        raise ValueError("the edit changes too little of the picture")
    still = np.abs(new - old) < 0.5 * CHANGED
    level = 0.5 * (old + new)[still]
    edges = np.unique(np.quantile(level, np.linspace(0.0, 1.0, LEVELS + 1)))
    places = np.clip(np.digitize(level, edges) - 1, 0, len(edges) - 2)
    used = np.unique(places)
    centres = np.array([level[places == i].mean() for i in used])
    shown = np.array([seen[still][places == i].mean() for i in used])

    def as_shown(values: NDArray[np.float32]) -> NDArray[np.float64]:
        return np.interp(values, centres, shown)

    step = as_shown(new[changed]) - as_shown(old[changed])
    return float(((seen[changed] - as_shown(old[changed])) * step).sum() / max((step**2).sum(), 1e-12))


def watch(engine: str, settings: tuple[str, ...] = ()) -> Watched:
    """Opens the window, lets the shared program edit, and takes every picture of the screen that differs from the last."""
    tool = blenders.shared_tool("viewport_latency.py")
    with tempfile.TemporaryDirectory(prefix="afterglow_window_") as name:
        folder = Path(name)
        read, write = os.pipe()
        server = subprocess.Popen(["Xvfb", "-displayfd", str(write), "-screen", "0", f"{WIDTH}x{HEIGHT}x24", "+extension", "GLX",
                                   "-nolisten", "tcp", "-fbdir", name], pass_fds=[write], stdout=subprocess.DEVNULL,
                                  stderr=subprocess.DEVNULL)
        os.close(write)
        try:
            with os.fdopen(read) as pipe:
                number = pipe.readline().strip()
            stamp, screen = folder / "edit", folder / "Xvfb_screen0"
            command = [*blenders.debian(), "--window-geometry", "0", "0", str(WIDTH), str(HEIGHT), str(scene()[0]), "--python",
                       str(tool), "--", str(stamp), engine, OBJECT, STEP, str(SETTLE), str(WATCH), *settings]
            env = os.environ | {"DISPLAY": ":" + number, "LIBGL_ALWAYS_SOFTWARE": "1",
                                "BLENDER_USER_CONFIG": str(folder / "config")}
            with open(folder / "log", "w") as log:
                program = subprocess.Popen(command, env=env, stdout=log, stderr=subprocess.STDOUT)
                try:
                    return _take(program, stamp, screen)
                finally:
                    program.kill()
                    program.wait()
        finally:
            server.terminate()
            server.wait()


def _take(program: subprocess.Popen[bytes], stamp: Path, screen: Path) -> Watched:
    memory = np.memmap(screen, np.uint8, "r", screen.stat().st_size - WIDTH * HEIGHT * 4, (HEIGHT, WIDTH, 4))
    last = memory[MARGIN:-MARGIN].copy()
    times, pictures = [0.0], [last]
    end = time.time() + 200.0
    while program.poll() is None and time.time() < end:
        edited = stamp.exists()
        picture = memory[MARGIN:-MARGIN].copy()
        if not edited:
            pictures[0] = picture
        elif (picture != pictures[-1]).any():
            times.append(time.time())
            pictures.append(picture)
        time.sleep(0.005 if edited else 0.05)
    if not stamp.exists() or len(pictures) < 3:
        raise RuntimeError("the window showed no edit")
    start = float(stamp.read_text())
    inside = [i for i, t in enumerate(times) if i == 0 or 0.0 < t - start < WATCH - 0.5]
    return Watched([0.0 if i == 0 else times[i] - start for i in inside],
                   [pictures[i][:, :, 2::-1].astype(np.float32) / 255 for i in inside])


def first_image(watched: Watched) -> float:
    """Seconds until more than half of what the edit changes is shown."""
    before, after = watched.pictures[0], watched.pictures[-1]
    for seconds, picture in zip(watched.seconds[1:], watched.pictures[1:], strict=True):
        if new_share(before, after, picture) > 0.5:
            return seconds
    raise RuntimeError("no first image was seen")


def first_pixel_by_pixel(watched: Watched) -> float:
    """The same as the shared program counts it; nan: not within the time watched."""
    before, after = watched.pictures[0][::2, ::2], watched.pictures[-1][::2, ::2]
    changed = np.abs(after - before).max(-1) > 0.1
    whole = np.abs(after - before)[changed].mean()
    for seconds, picture in zip(watched.seconds[1:], watched.pictures[1:], strict=True):
        if np.abs(picture[::2, ::2] - after)[changed].mean() < 0.5 * whole:
            return seconds
    return float("nan")


def measure(context: Context) -> list[Figure]:
    if shutil.which("Xvfb") is None:
        raise blenders.Unavailable("Xvfb is absent: a window cannot be opened (Debian: xvfb)")
    watch("AFTERGLOW", PATH_TRACED)  # shaders and pages are cached now
    ours: list[Watched] = []
    theirs: list[Watched] = []
    for number in range(max(5, context.pairs)):
        ours.append(watch("AFTERGLOW", PATH_TRACED))
        if number % 2 == 0:
            theirs.append(watch("CYCLES"))
    times, peers = [first_image(w) for w in ours], [first_image(w) for w in theirs]
    return [Figure("edit to first viewport image", "country_kitchen 800×600", 1e3 * statistics.median(times), "ms",
                   "Cycles in Debian's Blender", 1e3 * statistics.median(peers), None, "≤ 150",
                   spread=1e3 * spread_of_median(times),
                   details={"seconds": times, "cycles": peers,
                            "pixel by pixel": [[first_pixel_by_pixel(w) for w in every] for every in (ours, theirs)]}).judged()]
