# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes a description into the running Blender: meshes, node trees, lights, camera, key frames, Cycles' settings.

Sockets are found by their identifiers, so that one table serves every Blender; the files of `blend_files/` are written
by Blender 3.4, which all later versions open.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from .description import Camera, Description, Light, Mesh, Node, Output

TYPES = {
    "principled": "ShaderNodeBsdfPrincipled", "diffuse_bsdf": "ShaderNodeBsdfDiffuse", "glossy_bsdf": "ShaderNodeBsdfGlossy",
    "glass_bsdf": "ShaderNodeBsdfGlass", "refraction_bsdf": "ShaderNodeBsdfRefraction",
    "translucent_bsdf": "ShaderNodeBsdfTranslucent", "transparent_bsdf": "ShaderNodeBsdfTransparent",
    "emission": "ShaderNodeEmission", "background": "ShaderNodeBackground", "mix_shader": "ShaderNodeMixShader",
    "add_shader": "ShaderNodeAddShader", "image_texture": "ShaderNodeTexImage",
    "environment_texture": "ShaderNodeTexEnvironment", "checker_texture": "ShaderNodeTexChecker",
    "texture_coordinate": "ShaderNodeTexCoord", "mapping": "ShaderNodeMapping", "bump": "ShaderNodeBump",
    "normal_map": "ShaderNodeNormalMap", "color_attribute": "ShaderNodeVertexColor", "fresnel": "ShaderNodeFresnel",
    "layer_weight": "ShaderNodeLayerWeight", "rgb": "ShaderNodeRGB", "value": "ShaderNodeValue", "math": "ShaderNodeMath",
    "vector_math": "ShaderNodeVectorMath", "light_path": "ShaderNodeLightPath", "gradient_texture": "ShaderNodeTexGradient",
    "separate": "ShaderNodeSeparateColor", "combine": "ShaderNodeCombineColor", "geometry": "ShaderNodeNewGeometry",
}
# The Principled BSDF's sockets before Blender 4.0.
OLD_NAMES = {
    "specular_ior_level": "specular", "transmission_weight": "transmission", "coat_weight": "clearcoat",
    "coat_roughness": "clearcoat_roughness", "emission_color": "emission", "sheen_weight": "sheen",
    "subsurface_weight": "subsurface", "color1": "color1", "roughness": "roughness",
}
PARAMS = {"kind": "vector_type", "distribution": "distribution", "interpolation": "interpolation", "operation": "operation",
          "name": "layer_name", "space": "space"}


def write(description: Description, frame: float | None = None) -> Any:
    """Fills the current (empty) Blender scene; returns it. frame None: motion becomes key frames."""
    import bpy

    scene = bpy.context.scene
    scene.name = description.name
    images = {name: _image(name, picture) for name, picture in description.images.items()}
    materials = {}
    for name, root in description.materials.items():
        material = materials[name] = bpy.data.materials.new(name)
        material.use_nodes = True
        _tree(material.node_tree, root, "ShaderNodeOutputMaterial", images)
        if hasattr(material, "use_backface_culling"):
            material.use_backface_culling = False
    meshes = {name: _mesh(name, mesh, frame or description.frames[0]) for name, mesh in description.meshes.items()}
    used: set[str] = set()
    for item in description.objects:
        data = meshes[item.mesh]
        if item.mesh not in used:
            used.add(item.mesh)
            for material_name in item.materials:
                data.materials.append(materials[material_name])
        for i, transform in enumerate(item.at(frame or description.frames[0])):
            thing = bpy.data.objects.new(item.name if len(item.transforms) == 1 else f"{item.name} {i + 1}", data)
            scene.collection.objects.link(thing)
            thing.matrix_world = _matrix(transform)
            thing.pass_index = item.pass_index
            if not item.camera_visible:
                thing.visible_camera = False
            for slot, material_name in enumerate(item.materials):
                if data.materials[slot] is not materials[material_name]:
                    thing.material_slots[slot].link = "OBJECT"
                    thing.material_slots[slot].material = materials[material_name]
            if item.move is not None and frame is None:
                _animate(thing, item.move, description.frames)
            if description.meshes[item.mesh].deform is not None and frame is None:
                _deform(thing, description.meshes[item.mesh], description.frames)
    for light in description.lights:
        _light(scene, light, frame, description.frames)
    _camera(scene, description, frame)
    scene.world = bpy.data.worlds.new("World")
    scene.world.use_nodes = True
    world = description.world or Node("background", {"color": (0.0, 0.0, 0.0), "strength": 0.0})
    _tree(scene.world.node_tree, world, "ShaderNodeOutputWorld", images)
    _settings(scene, description)
    return scene


def _settings(scene: Any, description: Description) -> None:
    scene.render.engine = "CYCLES"
    cycles = scene.cycles
    cycles.device, cycles.samples, cycles.preview_samples = "CPU", 64, 64
    cycles.use_denoising = cycles.use_adaptive_sampling = False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.blur_glossy = 0.0
    cycles.caustics_reflective = cycles.caustics_refractive = False
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = cycles.transmission_bounces = 12
    cycles.transparent_max_bounces = 12
    scene.render.resolution_x, scene.render.resolution_y = description.resolution
    scene.render.resolution_percentage = 100
    scene.frame_start, scene.frame_end = description.frames
    scene.frame_set(description.frames[0])
    scene.view_settings.view_transform = "Standard"


def _matrix(transform: Any) -> Any:
    from mathutils import Matrix

    return Matrix([[float(v) for v in row] for row in transform])


def _animate(thing: Any, move: Any, frames: tuple[int, int]) -> None:
    thing.rotation_mode = "QUATERNION"
    previous = None
    for frame in range(frames[0], frames[1] + 1):
        thing.matrix_world = _matrix(np.asarray(move(frame)).reshape(4, 4))
        if previous is not None and thing.rotation_quaternion.dot(previous) < 0:
            thing.rotation_quaternion.negate()
        previous = thing.rotation_quaternion.copy()
        for path in ("location", "rotation_quaternion", "scale"):
            thing.keyframe_insert(path, frame=frame)


def _deform(thing: Any, mesh: Mesh, frames: tuple[int, int]) -> None:
    """One absolute shape key for every frame, linear between them."""
    assert mesh.deform is not None
    keys = None
    for frame in range(frames[0], frames[1] + 1):
        if keys is not None:
            keys.eval_time = 10.0 * (frame - frames[0])
        block = thing.shape_key_add(name=f"Frame {frame}", from_mix=False)
        keys = thing.data.shape_keys
        keys.use_relative = False
        block.data.foreach_set("co", np.asarray(mesh.deform(frame), np.float32).ravel())
        block.interpolation = "KEY_LINEAR"
    times = [block.frame for block in keys.key_blocks]
    for frame, time in zip(range(frames[0], frames[1] + 1), times, strict=True):
        keys.eval_time = time
        keys.keyframe_insert("eval_time", frame=frame)
    for curve in keys.animation_data.action.fcurves:
        for point in curve.keyframe_points:
            point.interpolation = "LINEAR"


def _mesh(name: str, mesh: Mesh, frame: float) -> Any:
    import bpy

    data = bpy.data.meshes.new(name)
    positions = mesh.positions if mesh.deform is None else np.asarray(mesh.deform(frame), np.float32)
    count = len(mesh.triangles)
    data.vertices.add(len(positions))
    data.vertices.foreach_set("co", positions.ravel())
    data.loops.add(3 * count)
    data.loops.foreach_set("vertex_index", mesh.triangles.ravel())
    data.polygons.add(count)
    data.polygons.foreach_set("loop_start", np.arange(0, 3 * count, 3, dtype=np.int32))
    data.polygons.foreach_set("loop_total", np.full(count, 3, np.int32))
    data.polygons.foreach_set("use_smooth", np.full(count, mesh.smooth))
    if mesh.slots is not None:
        data.polygons.foreach_set("material_index", mesh.slots.astype(np.int32))
    if mesh.uvs is not None:
        data.uv_layers.new(name="UVMap").data.foreach_set("uv", mesh.uvs.astype(np.float32).ravel())
    if mesh.colors is not None:
        data.color_attributes.new("Color", "FLOAT_COLOR", "POINT").data.foreach_set("color", mesh.colors.ravel())
    data.update(calc_edges=True)
    data.validate()
    return data


def _image(name: str, picture: Any) -> Any:
    import bpy

    height, width = picture.pixels.shape[:2]
    linear = picture.colorspace == "linear"
    image = bpy.data.images.new(name, width, height, alpha=True, float_buffer=linear)
    wanted = {"sRGB": ("sRGB",), "linear": ("Linear Rec.709", "Linear"), "non-color": ("Non-Color",)}[picture.colorspace]
    for candidate in wanted:
        try:
            image.colorspace_settings.name = candidate
            break
        except TypeError:
            continue
    image.pixels.foreach_set(np.ascontiguousarray(picture.pixels, np.float32).ravel())
    image.pack()
    return image


def _socket(sockets: Any, name: str) -> Any:
    for wanted in (name, OLD_NAMES.get(name, name)):
        for socket in sockets:
            if socket.identifier.lower().replace(" ", "_") == wanted:
                return socket
        for socket in sockets:
            if socket.name.lower().replace(" ", "_") == wanted:
                return socket
    raise KeyError(f"no socket {name!r} among {[s.identifier for s in sockets]}")


def _tree(tree: Any, root: Node, output_type: str, images: dict[str, Any]) -> None:
    tree.nodes.clear()
    output = tree.nodes.new(output_type)
    made: dict[int, Any] = {}
    columns: dict[int, int] = {}

    def build(item: Node, depth: int) -> Any:
        if id(item) in made:
            return made[id(item)]
        made[id(item)] = result = tree.nodes.new(TYPES[item.type])
        columns[depth] = columns.get(depth, 0) + 1
        result.location = (-260 * depth, 300 - 300 * columns[depth])
        for key, value in item.params.items():
            if key == "image":
                result.image = images[value]
            elif key == "value":
                result.outputs[0].default_value = value if item.type == "value" else (*value, 1.0)
            else:
                text = value if key == "name" else str(value).capitalize() if key == "interpolation" else str(value).upper()
                setattr(result, PARAMS.get(key, key), text)
        for key, value in item.inputs.items():
            socket = _socket(result.inputs, key)
            if isinstance(value, Node):
                source = build(value, depth + 1)
                tree.links.new(_socket(source.outputs, value.output) if value.output else source.outputs[0], socket)
            elif isinstance(value, Output):
                tree.links.new(_socket(build(value.node, depth + 1).outputs, value.name), socket)
            elif isinstance(value, (int, float)):
                socket.default_value = value
            else:
                size = len(socket.default_value)
                socket.default_value = tuple(float(v) for v in value) + ((1.0,) if size == 4 and len(value) == 3 else ())
        return result

    tree.links.new(build(root, 1).outputs[0], output.inputs[0])


def _light(scene: Any, light: Light, frame: float | None, frames: tuple[int, int]) -> None:
    import bpy

    data = bpy.data.lights.new(light.name, light.kind.upper())
    data.energy, data.color = light.power, light.color
    if light.kind in ("point", "spot"):
        data.shadow_soft_size = light.radius
    if light.kind == "spot":
        data.spot_size, data.spot_blend = light.spot_size, light.spot_blend
    if light.kind == "sun":
        data.angle = light.angle
    if light.kind == "area":
        data.shape, data.spread = light.shape.upper(), light.spread
        data.size, data.size_y = light.size
    thing = bpy.data.objects.new(light.name, data)
    scene.collection.objects.link(thing)
    thing.matrix_world = _matrix(light.at(frame or frames[0]))
    if light.move is not None and frame is None:
        _animate(thing, light.move, frames)


def _camera(scene: Any, description: Description, frame: float | None) -> None:
    import bpy

    camera: Camera = description.camera
    data = bpy.data.cameras.new("Camera")
    data.type = {"perspective": "PERSP", "orthographic": "ORTHO", "panorama": "PANO"}[camera.kind]
    data.sensor_fit, data.angle, data.ortho_scale = "AUTO", camera.angle, camera.width
    data.clip_start, data.clip_end = camera.clip
    if camera.aperture_radius > 0:
        data.dof.use_dof, data.dof.focus_distance = True, camera.focus_distance
        # The lens is data.lens millimetres long and Blender's units are metres: f-number = lens / diameter.
        data.dof.aperture_fstop = data.lens * 1e-3 / (2 * camera.aperture_radius)
    thing = bpy.data.objects.new("Camera", data)
    scene.collection.objects.link(thing)
    scene.camera = thing
    thing.matrix_world = _matrix(camera.at(frame or description.frames[0]))
    if camera.move is not None and frame is None:
        _animate(thing, camera.move, description.frames)
