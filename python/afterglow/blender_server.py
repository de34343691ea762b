# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs inside Blender (or in Python with the module `bpy`) and does jobs that come in as lines of JSON on standard input.

blender -b --python blender_server.py -- FD FOLDER: answers go to the file descriptor FD as lines of JSON, images to FOLDER.
Jobs: {"op": "open", "file", "percent"}, {"op": "render", "engine", "settings", "multilayer", "out"},
{"op": "frames", "frames", and a render's}, {"op": "animate", "object", "step", "last"}, {"op": "walk", "stride", "last"},
{"op": "memory"}, {"op": "grid", "triangles"}, {"op": "save", "file"}, {"op": "script", "file", "arguments"}.
Started by `afterglow.blenders`; what Blender prints stays on standard output.
"""

import json
import math
import os
import sys
import time

import bpy
import mathutils
import numpy as np

LIGHT_PASSES = ("diffuse_direct", "diffuse_indirect", "diffuse_color", "glossy_direct", "glossy_indirect", "glossy_color",
                "transmission_direct", "transmission_indirect", "transmission_color", "emit", "environment")
# The references' settings: nothing is clamped, no caustics, as many bounces for all.
BOUNCES = ("max_bounces", "diffuse_bounces", "glossy_bounces", "transmission_bounces")


def enable_addon() -> str:
    """Enables the add-on unless it is; returns why it could not be."""
    if hasattr(bpy.types.Scene, "afterglow"):
        return ""
    import addon_utils

    for name in ("bl_ext.user_default.afterglow", "render_afterglow"):
        try:
            if addon_utils.enable(name, default_set=True) is not None and hasattr(bpy.types.Scene, "afterglow"):
                return ""
        except Exception as error:
            return f"{name}: {error}"
    return "the add-on is not enabled in this Blender: start it through build/blender"


def open_file(job: dict) -> dict:
    bpy.ops.wm.open_mainfile(filepath=job["file"], load_ui=False)
    scene = bpy.context.scene
    problem = enable_addon()
    own = getattr(scene, "afterglow", None)
    names = ("method", "samples", "accuracy", "time_limit", "denoise")
    in_use = {name: getattr(own, name) for name in names if hasattr(own, name)}
    render = scene.render
    render.resolution_percentage = max(1, round(render.resolution_percentage * job.get("percent", 100) / 100))
    render.use_border = render.use_compositing = render.use_sequencer = False
    share = render.resolution_percentage / 100
    return {"resolution": [int(render.resolution_x * share), int(render.resolution_y * share)], "frame": scene.frame_current,
            "settings": in_use, "problem": problem}


def apply(scene: "bpy.types.Scene", engine: str, settings: dict) -> None:
    """Settings by the names of scene.afterglow; of Cycles those that it has, and its names of the others."""
    scene.render.engine = engine
    if engine == "AFTERGLOW":
        own = scene.afterglow
        # An unnamed setting keeps what the file says, but for these.
        method = getattr(own, str(settings.get("method", own.method)).lower(), None)  # its own settings
        for name, value in {"time_limit": 0.0, "denoise": False, **settings}.items():
            owner = next((it for it in (own, method) if it is not None and name in it.bl_rna.properties), None)
            if owner is None:  # a property group takes any name in silence
                raise AttributeError(f"{engine} has no setting '{name}'")
            setattr(owner, name, value)
        return
    cycles = scene.cycles
    settings = dict(settings)
    cycles.device = "CPU"
    cycles.use_denoising = settings.pop("denoise", False)
    if cycles.use_denoising:
        cycles.denoiser = "OPENIMAGEDENOISE"
    cycles.use_adaptive_sampling = False
    cycles.blur_glossy = 0.0
    threads = settings.pop("threads", 0)
    scene.render.threads_mode = "FIXED" if threads else "AUTO"
    if threads:
        scene.render.threads = threads
    for name in ("method", "accuracy", "time_limit"):
        settings.pop(name, None)
    for name, value in settings.items():
        if name not in cycles.bl_rna.properties:  # a property group takes any name in silence
            raise AttributeError(f"{engine} has no setting '{name}'")
        setattr(cycles, name, value)


def prepare(job: dict) -> str:
    """Settings and outputs of a job's renders. Returns the engine."""
    scene = bpy.context.scene
    settings = dict(job.get("settings", {}))
    if job.get("as_references"):
        settings = {**{name: 12 for name in BOUNCES}, "sample_clamp_direct": 0.0, "sample_clamp_indirect": 0.0,
                    "caustics_reflective": False, "caustics_refractive": False, **settings}
    engine = job.get("engine", "AFTERGLOW")
    apply(scene, engine, settings)
    scene.render.use_persistent_data = bool(job.get("persistent"))
    layer = bpy.context.view_layer
    for name in LIGHT_PASSES:
        if hasattr(layer, "use_pass_" + name):
            setattr(layer, "use_pass_" + name, bool(job.get("multilayer")))
    image = scene.render.image_settings
    kind = "OPEN_EXR_MULTILAYER" if job.get("multilayer") else "OPEN_EXR"
    if hasattr(image, "media_type"):
        image.media_type = "MULTI_LAYER_IMAGE" if job.get("multilayer") else "IMAGE"
    image.file_format, image.color_depth = kind, "32"
    if not job.get("multilayer"):
        image.color_mode = "RGB"
    scene.render.use_file_extension = False
    return engine


def frames(job: dict, folder: str, number: int) -> dict:
    """Frames in order, with nothing else changed between them, as in an animation."""
    prepare(job)
    scene = bpy.context.scene
    images, seconds = [], []
    for frame in job["frames"]:
        images.append(os.path.join(folder, f"image_{number}_{frame}.exr"))
        start = time.perf_counter()
        scene.frame_set(frame)
        scene.render.filepath = images[-1]
        bpy.ops.render.render(write_still=True)
        seconds.append(time.perf_counter() - start)
    return {"images": images, "seconds": seconds, "statistics": statistics_of(scene)}


def statistics_of(scene: "bpy.types.Scene") -> dict:
    if scene.render.engine != "AFTERGLOW":
        return {}
    import afterglow

    return {k: v for k, v in afterglow.statistics(scene).items() if k != "passes_log"}


def render(job: dict, folder: str, number: int) -> dict:
    prepare(job)
    scene = bpy.context.scene
    path = job.get("out") or os.path.join(folder, f"image_{number}.exr")
    scene.render.filepath = path
    stages = []
    start = time.perf_counter()

    def heard(*words: object) -> None:  # older Blenders give no words
        stages.append((time.perf_counter() - start, str(words[0]) if words and isinstance(words[0], str) else ""))

    bpy.app.handlers.render_stats.append(heard)
    try:
        bpy.ops.render.render(write_still=True)
        seconds = time.perf_counter() - start
    finally:
        bpy.app.handlers.render_stats.remove(heard)
    return {"image": path, "seconds": seconds, "statistics": statistics_of(scene), "stages": stages[:1000]}


def animate(job: dict) -> dict:
    """Moves an object by a step along x, evenly over all frames."""
    thing = bpy.data.objects[job["object"]]
    start = thing.location.x
    for frame, share in ((1, 0.0), (job["last"], 1.0)):
        thing.location.x = start + share * job["step"]
        thing.keyframe_insert("location", index=0, frame=frame)
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 1, job["last"]
    action = thing.animation_data.action
    curves = action.fcurves if hasattr(action, "fcurves") else action.layers[0].strips[0].channelbags[0].fcurves
    for point in curves[0].keyframe_points:
        point.interpolation = "LINEAR"
    return {}


def place_on_walk(matrix: "mathutils.Matrix", at: float, stride: float) -> np.ndarray:
    """A camera's matrix on a closed loop through its own place, without scale, looking left and right. `at` from 0 to 1."""
    turn = 2 * math.pi * at
    yaw = 0.2 * math.sin(turn)
    moved = np.array(matrix, np.float64)
    moved[:3, :3] /= np.linalg.norm(moved[:3, :3], axis=0)
    moved[:3, 3] += stride * (math.sin(turn) * moved[:3, 0] - 0.5 * (1 - math.cos(turn)) * moved[:3, 2])
    across = np.array([[math.cos(yaw), -math.sin(yaw), 0], [math.sin(yaw), math.cos(yaw), 0], [0, 0, 1]])
    moved[:3, :3] = across @ moved[:3, :3]
    return moved


def walk(job: dict) -> dict:
    """Moves the camera along that loop, a key in each frame."""
    scene = bpy.context.scene
    camera, last = scene.camera, job["last"]
    start = camera.matrix_world.copy()
    camera.constraints.clear()
    camera.animation_data_clear()
    for frame in range(1, last + 1):
        camera.matrix_world = mathutils.Matrix(place_on_walk(start, (frame - 1) / last, job["stride"]).tolist())
        camera.keyframe_insert("location", frame=frame)
        camera.keyframe_insert("rotation_quaternion" if camera.rotation_mode == "QUATERNION" else "rotation_euler", frame=frame)
    scene.frame_start, scene.frame_end = 1, last
    return {}


def script(job: dict) -> dict:
    """Runs a program that was written to be Blender's only one."""
    import runpy

    before = sys.argv
    sys.argv = [job["file"], *job["arguments"]]
    try:
        runpy.run_path(job["file"], run_name="__main__")
    except SystemExit as ended:
        if ended.code not in (None, 0):
            raise RuntimeError(f"{job['file']} ended with {ended.code}") from ended
    finally:
        sys.argv = before
    return {}


def memory() -> dict:
    """Peak and present resident memory of this process in bytes."""
    values = {}
    with open("/proc/self/status") as file:
        for line in file:
            if line.startswith(("VmHWM", "VmRSS")):
                values[line.split(":")[0]] = int(line.split()[1]) * 1024
    return {"peak": values["VmHWM"], "now": values["VmRSS"]}


def grid(job: dict) -> dict:
    """An empty file with one smooth sheet of about that many triangles, with UVs, a camera and a sun."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    enable_addon()
    side = max(1, round((job["triangles"] / 2) ** 0.5))
    y, x = np.mgrid[0 : side + 1, 0 : side + 1] / side * 2 - 1
    points = np.stack([x, y, 0.1 * np.sin(9 * x) * np.cos(7 * y)], -1).astype(np.float32)
    row, column = np.mgrid[0:side, 0:side]
    first = (row * (side + 1) + column).ravel()
    corners = np.stack([first, first + 1, first + side + 2, first + side + 1], -1).astype(np.int32)
    mesh = bpy.data.meshes.new("Sheet")
    mesh.vertices.add(points.size // 3)
    mesh.vertices.foreach_set("co", points.ravel())
    mesh.loops.add(corners.size)
    mesh.loops.foreach_set("vertex_index", corners.ravel())
    mesh.polygons.add(len(corners))
    mesh.polygons.foreach_set("loop_start", np.arange(0, corners.size, 4, dtype=np.int32))
    mesh.polygons.foreach_set("loop_total", np.full(len(corners), 4, np.int32))
    mesh.polygons.foreach_set("use_smooth", np.ones(len(corners), bool))
    flat = points.reshape(-1, 3)[corners.ravel(), :2] / 2 + 0.5
    mesh.uv_layers.new(name="UVMap").data.foreach_set("uv", np.ascontiguousarray(flat, np.float32).ravel())
    material = bpy.data.materials.new("Sheet")
    material.use_nodes = True
    mesh.materials.append(material)
    mesh.update(calc_edges=True)
    scene = bpy.context.scene
    scene.collection.objects.link(bpy.data.objects.new("Sheet", mesh))
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location = (0, 0, 4)
    scene.collection.objects.link(camera)
    scene.camera = camera
    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    scene.collection.objects.link(sun)
    scene.render.resolution_x = scene.render.resolution_y = 16
    bpy.context.view_layer.update()
    return {"triangles": 2 * len(corners)}


def main() -> None:
    descriptor, folder = sys.argv[sys.argv.index("--") + 1 :][:2]
    answers = os.fdopen(int(descriptor), "w", buffering=1)
    problem = enable_addon()
    native = getattr(sys.modules.get("afterglow._native"), "__file__", "")
    answers.write(json.dumps({"version": bpy.app.version_string, "problem": problem, "module": native}) + "\n")
    for number, line in enumerate(sys.stdin):
        job = json.loads(line)
        try:
            kind = job["op"]
            if kind == "open":
                result = open_file(job)
            elif kind == "render":
                result = render(job, folder, number)
            elif kind == "frames":
                result = frames(job, folder, number)
            elif kind == "animate":
                result = animate(job)
            elif kind == "walk":
                result = walk(job)
            elif kind == "grid":
                result = grid(job)
            elif kind == "save":
                bpy.ops.wm.save_as_mainfile(filepath=job["file"], copy=True)
                result = {}
            elif kind == "memory":
                result = memory()
            elif kind == "script":
                result = script(job)
            else:
                raise ValueError(f"no job {kind!r}")
        except Exception as error:
            result = {"error": f"{type(error).__name__}: {error}"}
        sys.stdout.flush()
        answers.write(json.dumps(result, default=float) + "\n")


if __name__ == "__main__":
    main()
