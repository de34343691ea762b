# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's cameras and viewports as arguments of `Scene.set_camera`, image size and the region to render.

The window of a view is read back from the projection matrix that Blender itself would draw with, so that sensor fit, shift,
pixel aspect, camera zoom and passepartout need no arithmetic of their own here.
"""
from __future__ import annotations

from dataclasses import dataclass, field
from math import pi
from typing import Any

import numpy as np
from numpy.typing import NDArray

Window = tuple[float, float, float, float]


@dataclass
class CameraView:
    """camera: keyword arguments of `Scene.set_camera`; width, height: the full image in pixels; region: x0, y0, x1, y1 of
    what is to be rendered, x1 and y1 exclusive, row 0 at the bottom; warnings: what the camera asks for and does not get."""

    camera: dict[str, Any]
    width: int
    height: int
    region: tuple[int, int, int, int]
    warnings: list[str] = field(default_factory=list)


def window_of(projection: Any) -> Window:
    """(left, right, bottom, top) of a projection matrix: at distance 1, or in scene units for a parallel one."""
    parallel = projection[3][3] == 1.0
    column, sign = (3, -1.0) if parallel else (2, 1.0)
    x, y = projection[0][0], projection[1][1]
    offset_x, offset_y = sign * projection[0][column], sign * projection[1][column]
    return ((offset_x - 1) / x, (offset_x + 1) / x, (offset_y - 1) / y, (offset_y + 1) / y)


def without_scale(matrix: Any) -> NDArray[np.float64]:
    """A camera's matrix with its axes at length 1."""
    result = np.array([list(row) for row in matrix], np.float64)
    lengths = np.linalg.norm(result[:3, :3], axis=0)
    result[:3, :3] /= np.where(lengths > 0, lengths, 1.0)
    return result


def pixel_border(border: Window, width: int, height: int) -> tuple[int, int, int, int]:
    """Pixels of a border given in fractions of the image, at least one. Rounded in 32 bits, as Blender does."""
    left, right, bottom, top = (int(np.float32(edge) * np.float32(size))
                                for edge, size in zip(border, (width, width, height, height)))
    x0, y0 = min(max(left, 0), width - 1), min(max(bottom, 0), height - 1)
    return (x0, y0, min(max(right, x0 + 1), width), min(max(top, y0 + 1), height))


def render_size(render: Any) -> tuple[int, int]:
    """Full image in pixels, as Blender rounds it."""
    scale = render.resolution_percentage
    return max(render.resolution_x * scale // 100, 1), max(render.resolution_y * scale // 100, 1)


def focus_distance(ob: Any, dof: Any) -> float:
    """Along the camera's axis to the focus object, or to its bone, or the distance that was set."""
    target = dof.focus_object
    if target is None:
        return dof.focus_distance
    matrix = target.matrix_world
    bone = target.pose.bones.get(getattr(dof, "focus_subtarget", "")) if target.pose is not None else None
    point = np.array((matrix @ bone.matrix).translation if bone is not None else matrix.translation)
    camera = without_scale(ob.matrix_world)
    return float(abs(np.dot(camera[:3, 2], camera[:3, 3] - point)))


def lens_of(ob: Any) -> dict[str, Any]:
    """Depth of field of a camera object, evaluated."""
    camera, dof = ob.data, ob.data.dof
    result: dict[str, Any] = {"focus_distance": max(focus_distance(ob, dof), 1e-5)}
    if dof.use_dof and dof.aperture_fstop > 0:
        length = 1.0 if camera.type == "ORTHO" else camera.lens * 1e-3
        result.update(aperture_radius=length / (2.0 * dof.aperture_fstop), aperture_blades=dof.aperture_blades,
                      aperture_rotation=dof.aperture_rotation, aperture_ratio=dof.aperture_ratio)
    return result


def panorama_of(camera: Any, name: str, warnings: list[str]) -> Window:
    """Longitude and latitude ranges; other panoramas than the equirectangular one show their field of view in it."""
    owner = camera if hasattr(camera, "panorama_type") else camera.cycles
    if owner.panorama_type == "EQUIRECTANGULAR":
        return (owner.longitude_min, owner.longitude_max, owner.latitude_min, owner.latitude_max)
    warnings.append(f"Camera '{name}': panorama {owner.panorama_type.replace('_', ' ').lower()} is not supported: "
                    "an equirectangular one of the same field of view is shown")
    if owner.panorama_type.startswith("FISHEYE"):
        half = min(owner.fisheye_fov / 2, pi)
        return (-half, half, -min(half, pi / 2), min(half, pi / 2))
    return (-pi, pi, -pi / 2, pi / 2)


def clip_of(camera: Any) -> tuple[float, float]:
    """Panoramas have no clipping but what the user gives; all keep the near end above zero."""
    return (max(camera.clip_start, 0.0), camera.clip_end)


def sync_camera_final(engine: Any, depsgraph: Any) -> CameraView | None:
    """The scene's (or the engine's overriding) camera at the render's resolution; None: the scene has no camera."""
    scene = depsgraph.scene
    render = scene.render
    chosen = getattr(engine, "camera_override", None) or scene.camera
    if chosen is None:
        return None
    ob = chosen.evaluated_get(depsgraph)
    width, height = render_size(render)
    region = (0, 0, width, height)
    if render.use_border:
        border = (render.border_min_x, render.border_max_x, render.border_min_y, render.border_max_y)
        region = pixel_border(border, width, height)
    warnings: list[str] = []
    if ob.type != "CAMERA":  # Blender lets any object be the camera; it looks like a default one
        warnings.append(f"Object '{ob.name}' is used as a camera: default lens")
        window = default_window(width * render.pixel_aspect_x, height * render.pixel_aspect_y)
        camera = {"kind": "perspective", "transform": without_scale(ob.matrix_world), "window": window, "clip": (0.1, 1000.0)}
        return CameraView(camera, width, height, region, warnings)
    kind = ob.data.type
    projection = ob.calc_matrix_camera(depsgraph, x=width, y=height, scale_x=render.pixel_aspect_x,
                                       scale_y=render.pixel_aspect_y)
    camera = {"kind": "orthographic" if kind == "ORTHO" else "perspective", "transform": without_scale(ob.matrix_world),
              "window": window_of(projection), "clip": clip_of(ob.data), **lens_of(ob)}
    if kind == "PANO":
        camera.update(kind="panorama", panorama=panorama_of(ob.data, ob.name, warnings))
    elif kind not in {"PERSP", "ORTHO"}:
        warnings.append(f"Camera '{ob.name}': type {kind.lower()} is not supported: shown as a perspective camera")
    return CameraView(camera, width, height, region, warnings)


def default_window(width: float, height: float) -> Window:
    """Blender's default camera: 50 mm on a sensor of 36 mm along the longer side."""
    half = 18.0 / 50.0 / max(width, height)
    return (-half * width, half * width, -half * height, half * height)


def sync_camera_view(depsgraph: Any, region: Any, rv3d: Any, space: Any, scale: float = 1.0) -> CameraView:
    """What a 3D viewport looks at. scale: rendered pixels for one pixel of the region (1/2: half the resolution)."""
    width, height = max(int(region.width * scale), 1), max(int(region.height * scale), 1)
    warnings: list[str] = []
    transform = without_scale(rv3d.view_matrix.inverted())
    window = window_of(rv3d.window_matrix)
    parallel = rv3d.window_matrix[3][3] == 1.0
    camera: dict[str, Any] = {"kind": "orthographic" if parallel else "perspective", "window": window}
    chosen = space.camera if space.use_local_camera else depsgraph.scene.camera
    looks_through = rv3d.view_perspective == "CAMERA" and chosen is not None
    ob = chosen.evaluated_get(depsgraph) if looks_through else None
    if ob is not None and ob.type == "CAMERA":
        transform = without_scale(ob.matrix_world)
        camera.update(clip=clip_of(ob.data), **lens_of(ob))
        if ob.data.type == "PANO":
            frame = camera_frame(depsgraph, ob, rv3d)
            camera.update(kind="panorama", panorama=spread_over(panorama_of(ob.data, ob.name, warnings), frame))
    elif parallel:  # Blender sees half of the clipping distance behind the eye, too
        reach = space.clip_end
        transform[:3, 3] += transform[:3, 2] * reach * 0.5
        camera["clip"] = (0.0, reach)
    else:
        camera["clip"] = (space.clip_start, space.clip_end)
    camera["transform"] = transform
    return CameraView(camera, width, height, view_border(depsgraph, rv3d, space, ob, width, height), warnings)


def camera_frame(depsgraph: Any, ob: Any, rv3d: Any) -> Window:
    """Where the camera's picture lies in the viewport: left, right, bottom, top as fractions of the region."""
    render = depsgraph.scene.render
    width, height = render_size(render)
    if ob.type == "CAMERA":
        inner = window_of(ob.calc_matrix_camera(depsgraph, x=width, y=height, scale_x=render.pixel_aspect_x,
                                                scale_y=render.pixel_aspect_y))
    else:
        inner = default_window(width * render.pixel_aspect_x, height * render.pixel_aspect_y)
    left, right, bottom, top = window_of(rv3d.window_matrix)
    return ((inner[0] - left) / (right - left), (inner[1] - left) / (right - left),
            (inner[2] - bottom) / (top - bottom), (inner[3] - bottom) / (top - bottom))


def spread_over(panorama: Window, frame: Window) -> Window:
    """The panorama's ranges stretched over the whole region, so that the frame shows what the picture will."""
    def stretched(low: float, high: float, start: float, end: float) -> tuple[float, float]:
        size = (high - low) / (end - start)
        return low - start * size, low + (1 - start) * size
    return (*stretched(*panorama[:2], *frame[:2]), *stretched(*panorama[2:], *frame[2:]))


def view_border(depsgraph: Any, rv3d: Any, space: Any, ob: Any, width: int, height: int) -> tuple[int, int, int, int]:
    """The part of a viewport that its render border leaves: the scene's in camera view, its own elsewhere."""
    render = depsgraph.scene.render
    if ob is not None:
        if not render.use_border:
            return (0, 0, width, height)
        left, right, bottom, top = camera_frame(depsgraph, ob, rv3d)
        border = (left + render.border_min_x * (right - left), left + render.border_max_x * (right - left),
                  bottom + render.border_min_y * (top - bottom), bottom + render.border_max_y * (top - bottom))
    elif space.use_render_border:
        border = (space.render_border_min_x, space.render_border_max_x, space.render_border_min_y, space.render_border_max_y)
    else:
        return (0, 0, width, height)
    return pixel_border(border, width, height)
