# SPDX-License-Identifier: GPL-3.0-or-later
"""What each of Blender's shader nodes becomes in a native graph.

Sockets are matched by identifier, which Blender keeps when it renames what users see. A plain rule is a line of a table:
native type, parameters; inputs and outputs then have the identifiers' own names in snake case. Others are functions.
"""
from __future__ import annotations

from collections.abc import Callable
from typing import Any

from . import closures, textures
from .compiler import Compiler, NodeView, Source, is_link, snake

Outputs = dict[str, Source]
Rule = Callable[[Compiler, NodeView], Any]


def plain(kind: str, params: Callable[[Any], dict[str, Any]] | None = None) -> Rule:
    def rule(compiler: Compiler, view: NodeView) -> Outputs:
        index = compiler.add(kind, view.node.name, {snake(name): value for name, value in view.inputs()},
                             **(params(view.node) if params else {}))
        return {socket.identifier: ("link", index, snake(socket.identifier)) for socket in view.node.outputs}
    return rule


def renamed(kind: str, inputs: dict[str, str], outputs: dict[str, str],
            params: Callable[[Any], dict[str, Any]] | None = None) -> Rule:
    """inputs and outputs: Blender's identifier → the native name; what is not named is not passed on."""
    def rule(compiler: Compiler, view: NodeView) -> Outputs:
        given = {native: view.input(name) for name, native in inputs.items() if view.has(name)}
        index = compiler.add(kind, view.node.name, given, **(params(view.node) if params else {}))
        return {name: ("link", index, native) for name, native in outputs.items()}
    return rule


def value_node(compiler: Compiler, view: NodeView) -> Outputs:
    socket = view.node.outputs[0]
    return {socket.identifier: float(socket.default_value)}


def rgb_node(compiler: Compiler, view: NodeView) -> Outputs:
    socket = view.node.outputs[0]
    return {socket.identifier: tuple(socket.default_value)[:3]}


def mix_node(compiler: Compiler, view: NodeView) -> Outputs:
    node = view.node
    kind = {"FLOAT": "Float", "VECTOR": "Vector", "RGBA": "Color"}.get(node.data_type)
    if kind is None:
        compiler.context.warn_once(f"node '{node.name}' mixes {node.data_type.lower()}: its first input is taken")
        return {}
    factor = "Factor_Vector" if kind == "Vector" and node.factor_mode == "NON_UNIFORM" else "Factor_Float"
    link = compiler.link("result", "mix", node.name, {"factor": view.input(factor), "a": view.input("A_" + kind),
                                                      "b": view.input("B_" + kind)},
                         data_type=kind.lower(), blend=node.blend_type.lower() if kind == "Color" else "mix",
                         clamp_factor=node.clamp_factor, clamp_result=node.clamp_result if kind == "Color" else False,
                         factor_mode=node.factor_mode.lower())
    return {"Result_" + kind: link}


def mix_rgb_node(compiler: Compiler, view: NodeView) -> Outputs:
    node = view.node
    link = compiler.link("result", "mix", node.name, {"factor": view.input("Fac"), "a": view.input("Color1"),
                                                      "b": view.input("Color2")},
                         data_type="color", blend=node.blend_type.lower(), clamp_factor=True, clamp_result=node.use_clamp,
                         factor_mode="uniform")
    return {"Color": link}


def separate(mode: str, source: str, outputs: tuple[str, str, str]) -> Rule:
    return renamed("separate", {source: "color"}, dict(zip(outputs, ("red", "green", "blue"), strict=True)),
                   lambda node: {"mode": mode or node.mode.lower()})


def combine(mode: str, inputs: tuple[str, str, str], output: str) -> Rule:
    return renamed("combine", dict(zip(inputs, ("red", "green", "blue"), strict=True)), {output: "color"},
                   lambda node: {"mode": mode or node.mode.lower()})


def map_range_node(compiler: Compiler, view: NodeView) -> Outputs:
    node = view.node
    vector = node.data_type == "FLOAT_VECTOR"
    names = ("From_Min_FLOAT3", "From_Max_FLOAT3", "To_Min_FLOAT3", "To_Max_FLOAT3", "Steps_FLOAT3") if vector else \
        ("From Min", "From Max", "To Min", "To Max", "Steps")
    given = dict(zip(("from_min", "from_max", "to_min", "to_max", "steps"), map(view.input, names), strict=True))
    given["vector" if vector else "value"] = view.input("Vector" if vector else "Value")
    index = compiler.add("map_range", node.name, given, data_type="vector" if vector else "float",
                         interpolation=node.interpolation_type.lower(), clamp=node.clamp)
    return {"Result": ("link", index, "result"), "Vector": ("link", index, "vector")}


def normal_node(compiler: Compiler, view: NodeView) -> Outputs:
    direction = tuple(view.node.outputs["Normal"].default_value)
    index = compiler.add("normal", view.node.name, {"normal": view.input("Normal")}, direction=direction)
    return {"Normal": ("link", index, "normal"), "Dot": ("link", index, "dot")}


def bump_node(compiler: Compiler, view: NodeView) -> Outputs:
    if not view.linked("Height"):
        return {"Normal": view.input("Normal")}
    given = {"strength": view.input("Strength"), "distance": view.input("Distance"), "height": view.input("Height"),
             "normal": view.input("Normal")}
    width = view.input("Filter Width") if view.has("Filter Width") else 1.0  # before 4.3: always a pixel
    return {"Normal": compiler.link("normal", "bump", view.node.name, given, invert=view.node.invert,
                                    shadowing=closures.bump_shadowing(),
                                    filter_width=1.0 if is_link(width) or width is None else float(width),
                                    version=closures.generation("bump"))}


def displacement_node(compiler: Compiler, view: NodeView) -> Outputs:
    given = {"height": view.input("Height"), "scale": view.input("Scale")}
    return {"Displacement": compiler.link("vector", "displacement", view.node.name, given)}


def attribute_node(compiler: Compiler, view: NodeView) -> Outputs:
    node = view.node
    if node.attribute_type in {"OBJECT", "INSTANCER", "VIEW_LAYER"}:
        value = compiler.context.attribute(node.attribute_type, node.attribute_name) or (0.0, 0.0, 0.0, 0.0)
        return {"Color": value[:3], "Vector": value[:3], "Fac": sum(value[:3]) / 3.0, "Alpha": value[3]}
    index = compiler.add("attribute", node.name, name=node.attribute_name, kind=node.attribute_type.lower())
    return {name: ("link", index, name.lower()) for name in ("Color", "Vector", "Fac", "Alpha")}


def falloff_node(compiler: Compiler, view: NodeView) -> Outputs:
    """Light Falloff: quadratic is light's own; linear and constant multiply by the distance once and twice."""
    strength, smooth = view.input("Strength"), view.input("Smooth")
    distance = compiler.link("ray_length", "light_path")
    squared = compiler.math("multiply", distance, distance)
    if smooth != 0.0:
        strength = compiler.math("multiply", strength, compiler.math("divide", squared, compiler.math("add", squared, smooth)))
    linear = compiler.math("multiply", strength, distance)
    return {"Quadratic": strength, "Linear": linear, "Constant": compiler.math("multiply", strength, squared)}


def first_input(name: str, output: str, said: str) -> Rule:
    """Nodes that are shown as one of their inputs, with a warning."""
    def rule(compiler: Compiler, view: NodeView) -> Outputs:
        compiler.context.warn_once(f"node '{view.node.name}' ({view.node.bl_label}) is not supported yet: {said}")
        return {output: view.input(name)}
    return rule


def ambient_occlusion_node(compiler: Compiler, view: NodeView) -> Outputs:
    compiler.context.warn_once(f"node '{view.node.name}' (Ambient Occlusion) is not supported yet: nothing is occluded")
    return {"Color": view.input("Color"), "AO": 1.0}


def unknown(compiler: Compiler, view: NodeView) -> Outputs:
    """Grey for colours, 0 for numbers, the default for vectors, a grey diffuse surface for shaders."""
    node = view.node
    compiler.context.warn_once(f"node '{node.name}' ({node.bl_label}) is not supported yet: a neutral value stands in")
    outputs: Outputs = {}
    for socket in node.outputs:
        if socket.type == "SHADER":
            outputs[socket.identifier] = compiler.link("shader", "diffuse_bsdf", node.name,
                                                       {"color": view.input("Color", "Base Color", "Tint")})
        else:
            outputs[socket.identifier] = {"RGBA": (0.8, 0.8, 0.8), "VALUE": 0.0}.get(socket.type)
    return outputs


def no_volume(compiler: Compiler, view: NodeView) -> Outputs:
    return {}


RULES: dict[str, Rule] = {
    **closures.RULES, **textures.RULES,
    "ShaderNodeValue": value_node,
    "ShaderNodeRGB": rgb_node,
    "ShaderNodeMix": mix_node,
    "ShaderNodeMixRGB": mix_rgb_node,
    "ShaderNodeMath": plain("math", lambda n: {"operation": n.operation.lower(), "clamp": n.use_clamp}),
    "ShaderNodeVectorMath": plain("vector_math", lambda n: {"operation": n.operation.lower()}),
    "ShaderNodeSeparateColor": separate("", "Color", ("Red", "Green", "Blue")),
    "ShaderNodeSeparateRGB": separate("rgb", "Image", ("R", "G", "B")),
    "ShaderNodeSeparateHSV": separate("hsv", "Color", ("H", "S", "V")),
    "ShaderNodeSeparateXYZ": separate("xyz", "Vector", ("X", "Y", "Z")),
    "ShaderNodeCombineColor": combine("", ("Red", "Green", "Blue"), "Color"),
    "ShaderNodeCombineRGB": combine("rgb", ("R", "G", "B"), "Image"),
    "ShaderNodeCombineHSV": combine("hsv", ("H", "S", "V"), "Color"),
    "ShaderNodeCombineXYZ": combine("xyz", ("X", "Y", "Z"), "Vector"),
    "ShaderNodeHueSaturation": plain("hue_saturation"),
    "ShaderNodeGamma": plain("gamma"),
    "ShaderNodeInvert": plain("invert"),
    "ShaderNodeBrightContrast": renamed("bright_contrast", {"Color": "color", "Bright": "bright", "Contrast": "contrast"},
                                        {"Color": "color"}),
    "ShaderNodeRGBToBW": plain("rgb_to_bw"),
    "ShaderNodeClamp": plain("clamp", lambda n: {"kind": n.clamp_type.lower()}),
    "ShaderNodeMapRange": map_range_node,
    "ShaderNodeMapping": plain("mapping", lambda n: {"kind": n.vector_type.lower()}),
    "ShaderNodeNormalMap": renamed("normal_map", {"Strength": "strength", "Color": "color"}, {"Normal": "normal"},
                                   lambda n: {"space": n.space.lower(), "uv_map": n.uv_map,
                                              "version": closures.generation("normal_map"),
                                              "shadowing": closures.bump_shadowing()}),
    "ShaderNodeBump": bump_node,
    "ShaderNodeNormal": normal_node,
    "ShaderNodeDisplacement": displacement_node,
    "ShaderNodeFresnel": renamed("fresnel", {"IOR": "ior", "Normal": "normal"}, {"Fac": "fac"}),
    "ShaderNodeLayerWeight": renamed("layer_weight", {"Blend": "blend", "Normal": "normal"},
                                     {"Fresnel": "fresnel", "Facing": "facing"}),
    "ShaderNodeCameraData": plain("camera"),
    "ShaderNodeNewGeometry": plain("geometry"),
    "ShaderNodeLightPath": plain("light_path"),
    "ShaderNodeObjectInfo": plain("object_info"),
    "ShaderNodeParticleInfo": plain("particle_info"),
    "ShaderNodeAttribute": attribute_node,
    "ShaderNodeVertexColor": plain("color_attribute", lambda n: {"name": n.layer_name}),
    "ShaderNodeUVMap": plain("uv_map", lambda n: {"uv_map": n.uv_map}),
    "ShaderNodeBlackbody": plain("blackbody"),
    "ShaderNodeWavelength": plain("wavelength"),
    "ShaderNodeVectorTransform": plain("vector_transform", lambda n: {"kind": n.vector_type.lower(),
                                                                      "from": n.convert_from.lower(),
                                                                      "to": n.convert_to.lower()}),
    "ShaderNodeVectorRotate": plain("vector_rotate", lambda n: {"kind": n.rotation_type.lower(), "invert": n.invert}),
    "ShaderNodeTangent": plain("tangent", lambda n: {"direction_type": n.direction_type.lower(), "axis": n.axis.lower(),
                                                     "uv_map": n.uv_map}),
    "ShaderNodeWireframe": plain("wireframe", lambda n: {"use_pixel_size": n.use_pixel_size}),
    "ShaderNodeHairInfo": plain("hair_info"),
    "ShaderNodePointInfo": plain("point_info"),
    "ShaderNodeLightFalloff": falloff_node,
    "ShaderNodeBevel": first_input("Normal", "Normal", "the normal is taken"),
    "ShaderNodeAmbientOcclusion": ambient_occlusion_node,
    "ShaderNodeVolumeAbsorption": no_volume,
    "ShaderNodeVolumeScatter": no_volume,
    "ShaderNodeVolumePrincipled": no_volume,
    "ShaderNodeVolumeCoefficients": no_volume,
}


def translate(compiler: Compiler, view: NodeView) -> Outputs:
    try:
        return RULES.get(view.node.bl_idname, unknown)(compiler, view)
    except (AttributeError, KeyError, TypeError, ValueError) as error:  # a node of a version that nobody here has seen
        compiler.context.warn_once(f"node '{view.node.name}' cannot be read ({error}): a neutral value stands in")
        return unknown(compiler, view)
