# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs inside Blender on the opened file: inside.py JOBS.json ANSWERS.npz. Reads the file once as the add-on reads it, then does
the jobs in their order on the same native scene, so that caches stay alive between them.

Jobs: {"do": "render", "settings", "at": place on the walk or null, "warm"?, "denoise"?, "keep": array's name or null},
{"do": "cells", "levels"}, {"do": "drop"}: the scene is made anew, {"do": "edit", "lights": factor}. What they gave stands in
ANSWERS.npz: kept images, and "answers", a list of JSON.
"""

import importlib
import json
import resource
import sys
import time

import bpy
import numpy as np
from blender_server import place_on_walk  # the program that runs this one

jobs_file, answers_file = sys.argv[-2:]
with open(jobs_file) as file:
    given = json.load(file)
package = next(name for name in ("bl_ext.user_default.afterglow", "render_afterglow") if name in sys.modules)
sync = importlib.import_module(package + ".sync")
importlib.import_module(package + ".sync.camera")
afterglow = importlib.import_module(package + ".backend").afterglow

scene = bpy.context.scene
camera = scene.camera
width, height = given["size"]


def cpu() -> float:
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


def read_scene() -> tuple:
    """The native scene, and the seconds that reading and building took."""
    began = time.perf_counter()
    native = afterglow.Scene()
    keeper = sync.SceneSync(native, lambda level, text: None)
    keeper.sync(bpy.context.evaluated_depsgraph_get(), full=True)
    look(native, None)
    native.commit(flatten=True)
    return native, keeper, time.perf_counter() - began


def look(native: "afterglow.Scene", at: "float | None") -> None:
    """The file's camera, or its place on a closed walk: a loop round it, looking left and right. `at` from 0 to 1."""
    matrix = np.array(camera.matrix_world, np.float64)
    matrix[:3, :3] /= np.linalg.norm(matrix[:3, :3], axis=0)
    if at is not None:
        matrix = place_on_walk(camera.matrix_world, at, given["stride"])
    projection = camera.calc_matrix_camera(bpy.context.evaluated_depsgraph_get(), x=width, y=height)
    clip = (camera.data.clip_start, camera.data.clip_end)
    native.set_camera("perspective", matrix, window=sync.camera.window_of(projection), clip=clip)


def render(native: "afterglow.Scene", job: dict, images: dict) -> dict:
    look(native, job.get("at"))
    native.commit()
    settings = {"width": width, "height": height, "accuracy": 0.0, "passes": ["combined"], **given["settings"], **job["settings"]}
    used, began = cpu(), time.perf_counter()
    session = afterglow.Session(native, settings)
    session.start()
    session.wait()
    image = session.read("combined")
    seconds, used = time.perf_counter() - began, cpu() - used
    if job.get("keep"):
        images[job["keep"]] = image[..., :3]
    statistics = session.statistics()
    return {"seconds": seconds, "cpu": used, "values": statistics.get("values", {}), "stages": statistics["seconds"]}


def main() -> None:
    native, keeper, seconds = read_scene()
    images, answers = {}, [{"seconds": seconds, "bytes": native.bytes}]
    for job in given["jobs"]:
        if job["do"] == "render":
            answers.append(render(native, job, images))
        elif job["do"] == "drop":
            del keeper, native
            native, keeper, seconds = read_scene()
            answers.append({"seconds": seconds})
        elif job["do"] == "cells":
            found = afterglow._native.occupied_cells(native, job["levels"], np.empty((0, 3)))
            answers.append({name: np.asarray(value).tolist() for name, value in found.items() if name != "index"})
        elif job["do"] == "lookups":
            answers.append(afterglow._native.measure_lookups(job["cells"], job["lookups"]))
        else:
            raise ValueError(f"no job {job['do']!r}")
    np.savez(answers_file, answers=np.array(json.dumps(answers, default=float)), **images)


main()
