# SPDX-License-Identifier: GPL-3.0-or-later
"""Afterglow against Cycles in the same Blender, scene for scene: lamps, cameras, attributes and bent normals. In 3.4, and in
official 5.0 by the packaged extension, for some of what they show differs between the two and must differ in ours, too."""

from __future__ import annotations

import json
import os
import subprocess
import textwrap
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from .conftest import HERE, write_script

HEAD = "from parity_tools import *\nimport math\n"


@pytest.fixture(scope="module")
def resources(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("resources")


@pytest.fixture(params=["3.4", pytest.param("5.0", marks=pytest.mark.slow)])
def parity(request: pytest.FixtureRequest, tmp_path: Path, resources: Path) -> Callable[[str], dict[str, Any]]:
    """parity(text): runs it in that Blender after `from parity_tools import *`; what it gave to `result`."""

    def run(text: str) -> dict[str, Any]:
        text = HEAD + textwrap.dedent(text)
        if request.param == "3.4":
            return request.getfixturevalue("in_blender")(text)
        values = tmp_path / "result.json"
        python = request.getfixturevalue("bpy_venv")(request.param)
        archive = request.getfixturevalue("package")["extension"]
        env = {name: value for name, value in os.environ.items() if name not in ("AFTERGLOW_LIBRARY", "PYTHONPATH")}
        env |= {"AFTERGLOW_RESULT": str(values), "BLENDER_USER_RESOURCES": str(resources)}
        command = [str(python), str(HERE / "official_start.py"), str(archive), str(write_script(tmp_path, text)), "-"]
        ended = subprocess.run(command, env=env, timeout=600, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                               errors="replace")
        assert ended.returncode == 0, ended.stdout[-6000:]
        return json.loads(values.read_text())

    return run


def agree(found: dict[str, Any], mean: float = 0.002, block: float = 0.03) -> None:
    """Every scene's mean within `mean` beyond 4.5 standard errors, every block within `block` of the image's mean."""
    bad = {name: one for name, one in found.items() if isinstance(one, dict)
           and not (abs(one["mean"] - 1) <= mean + 4.5 * one["error"] and one["block"] <= block)}
    assert not bad, bad
    assert len([one for one in found.values() if isinstance(one, dict)]) > 0


def test_lamps(parity: Callable[[str], dict[str, Any]]) -> None:
    """Shapes, units, spreads and falloffs; a receiver close to each, and what lies beside the cone."""
    agree(parity("""
        LAMPS = {
            "rectangle": ("AREA", dict(shape="RECTANGLE", size=0.8, size_y=0.3)),
            "scaled ellipse": ("AREA", dict(shape="ELLIPSE", size=0.8, size_y=0.4, scale=(-1.5, 0.5, 2))),
            "spread": ("AREA", dict(size=0.8, spread=2.0)),
            "disk with spread": ("AREA", dict(shape="DISK", size=0.8, spread=1.5)),
            "point": ("POINT", dict(shadow_soft_size=0.25)),
            "hard point": ("POINT", dict(shadow_soft_size=0.6, location=(0.3, 0.2, 0.7), use_soft_falloff=False)),
            "spot": ("SPOT", dict(shadow_soft_size=0.1, spot_size=1.8, spot_blend=0.5)),
            "wide spot": ("SPOT", dict(shadow_soft_size=0.1, spot_size=3.0, spot_blend=0.3)),
            "scaled spot": ("SPOT", dict(shadow_soft_size=0.1, spot_size=2.0, spot_blend=0.3, scale=(1.5, 0.7, 1.2))),
            "sun": ("SUN", dict(angle=0.3)),
            "wide sun": ("SUN", dict(angle=1.5)),
        }
        for name, (kind, values) in LAMPS.items():
            start(); camera(); floor(); light(kind, **values)
            result(**{name: compare(most=5.0)})
    """))


def test_cameras(parity: Callable[[str], dict[str, Any]]) -> None:
    """Boxes that shine, so that only the place of every edge and its blur count."""
    agree(parity("""
        def setup():
            scene = start((0.2, 0.3, 0.4))
            for i in range(6):
                bpy.ops.mesh.primitive_cube_add(size=0.5, location=(i * 0.7 - 1.7, i % 3 * 1.2 - 1, i * 0.37 % 1.3 - 0.3),
                                                rotation=(i, 0.5 * i, 0.3))
                made = material(emits=True)
                made.node_tree.nodes["Emission"].inputs[0].default_value = (i % 3 / 2, i % 2, 1 - i / 6, 1)
                bpy.context.object.data.materials.append(made)
            return scene, camera((0, -5, 0.8), (0, 0, 0.3), 35)
        def ortho(s, c):
            c.type, c.ortho_scale, c.shift_x, c.shift_y = "ORTHO", 4.3, 0.13, -0.2
        def shifted(s, c):
            c.shift_x, c.sensor_fit, c.sensor_height, s.render.pixel_aspect_x = 0.13, "VERTICAL", 20, 1.5
        def panorama(s, c):
            c.type = "PANO"
            owner = c if hasattr(c, "panorama_type") else c.cycles
            owner.panorama_type = "EQUIRECTANGULAR"
            owner.longitude_min, owner.longitude_max, owner.latitude_min, owner.latitude_max = -1.2, 0.8, -0.5, 0.7
        def blades(s, c):
            dof = c.dof
            dof.use_dof, dof.focus_distance, dof.aperture_fstop = True, 3.8, 0.15
            dof.aperture_blades, dof.aperture_rotation, dof.aperture_ratio = 5, 0.4, 1.5
        def clipped(s, c):
            c.clip_start, c.clip_end = 4.5, 5.8
        def cropped(s, c):
            r = s.render
            r.use_border, r.resolution_percentage = True, 70
            r.use_crop_to_border = True
            r.border_min_x, r.border_max_x, r.border_min_y, r.border_max_y = 0.21, 0.83, 0.12, 0.77
        for change in (ortho, shifted, panorama, blades, clipped, cropped):
            s, c = setup()
            change(s, c.data)
            result(**{change.__name__: compare(samples=64)})
    """), block=0.04)


def test_properties_of_objects(parity: Callable[[str], dict[str, Any]]) -> None:
    """What Attribute and Object Info nodes find: one material on objects, instances and in the view layer."""
    agree(parity("""
        def of(kind, output="Color", **values):
            def build(tree):
                node = tree.nodes.new(kind)
                for key, value in values.items():
                    setattr(node, key, value)
                return node.outputs[output]
            return material(build, emits=True)
        asked = {"random": of("ShaderNodeObjectInfo", "Random"), "color": of("ShaderNodeObjectInfo", "Color")}
        for name, kind in (("own", "OBJECT"), ("color", "OBJECT"), ("shared", "OBJECT"), ("own", "INSTANCER"),
                           ("color", "INSTANCER"), ("layer", "VIEW_LAYER"), ("sky", "VIEW_LAYER")):
            asked[kind + " " + name] = of("ShaderNodeAttribute", attribute_name=name, attribute_type=kind)
        for name, made in asked.items():
            scene = start((0.1, 0.15, 0.2))
            camera((0.5, -4, 1.6), (0, 0, 0.5), 30)
            bpy.context.view_layer["layer"], scene.world["sky"] = (0.9, 0.2, 0.1), 0.55
            first = ball("First", location=(-1.0, 0, 0.5), color=(0.2, 0.7, 0.4, 0.6))
            second = add("Second", first.data, location=(1.0, 0, 0.5), color=(0.9, 0.1, 0.3, 1.0))
            first["own"], second["own"], first.data["shared"] = 0.4, (0.3, 0.6, 0.9), 0.35
            inside = add("Inside", first.data, color=(1.0, 0.2, 0.1, 1.0))
            inside["own"] = 0.2
            group = bpy.data.collections.new("Group")
            scene.collection.objects.unlink(inside)
            group.objects.link(inside)
            for i in range(2):
                holder = add("Holder%d" % i, None, location=(i - 0.5, 1.0, 1.4), scale=(0.6,) * 3,
                             color=(0.1 * i, 0.5, 0.9, 1.0), instance_type="COLLECTION", instance_collection=group)
                holder["own"] = 0.3 * i + 0.1
            first.data.materials.clear()
            first.data.materials.append(made)
            result(**{name: compare(samples=64)})
    """), block=0.04)


def test_bent_normals(parity: Callable[[str], dict[str, Any]]) -> None:
    """Normal maps over mirrored UVs (MikkTSpace) and bumps, under a sharp light that shows where they fade."""
    agree(parity("""
        y, x = np.mgrid[0:32, 0:32] / 32 * 2 * np.pi
        nx, ny = 0.5 * np.sin(x) + 0.2, 0.4 * np.cos(2 * y)
        nz = np.sqrt(np.maximum(1 - nx**2 - ny**2, 0.1))
        image = bpy.data.images.new("Normals", 32, 32)
        image.colorspace_settings.name = "Non-Color"
        image.pixels.foreach_set((np.stack([nx, ny, nz, np.ones_like(nx)], -1) / 2 + 0.5).astype(np.float32).ravel())
        image.update(); image.pack()
        def mapped(space, strength=1.0):
            def build(tree):
                picture, node = tree.nodes.new("ShaderNodeTexImage"), tree.nodes.new("ShaderNodeNormalMap")
                picture.image, node.space, node.inputs["Strength"].default_value = image, space, strength
                tree.links.new(picture.outputs[0], node.inputs["Color"])
                return node.outputs[0]
            return build
        def bumped(distance, width):
            def build(tree):
                wave, node, at = (tree.nodes.new("ShaderNode" + kind) for kind in ("TexWave", "Bump", "TexCoord"))
                node.inputs["Distance"].default_value, wave.inputs["Scale"].default_value = distance, 3.0
                if "Filter Width" in node.inputs:
                    node.inputs["Filter Width"].default_value = width
                tree.links.new(at.outputs["Object"], wave.inputs["Vector"])
                tree.links.new(wave.outputs["Fac"], node.inputs["Height"])
                return node.outputs[0]
            return build
        cases = {"tangent": mapped("TANGENT"), "weak": mapped("TANGENT", 0.4), "object": mapped("OBJECT"),
                 "bump": bumped(0.05, 1.0), "narrow bump": bumped(0.05, 0.1)}
        for name, build in cases.items():
            start((0.1, 0.1, 0.1))
            camera((0.5, -4, 1.6), (0, 0, 0.0), 35)
            light("SUN", rotation_euler=(0.6, 0.3, 0.2), angle=0.0)
            ob = ball(mirrored=True)
            ob.data.materials.append(material(build))
            result(**{name: compare(samples=64)})
    """), mean=0.004, block=0.06)
