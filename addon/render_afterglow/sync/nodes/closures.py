# SPDX-License-Identifier: GPL-3.0-or-later
"""Rules for shader nodes: BSDFs, emission, mixing. The Principled BSDF's two generations (before and since Blender 4.0) are
told apart by the sockets that the node has."""
from __future__ import annotations

from typing import Any

import bpy

from .compiler import Compiler, NodeView, Source, is_link

Outputs = dict[str, Source]

# Blender's identifier → the native input; the second generation
PRINCIPLED_2 = {
    "Base Color": "base_color", "Metallic": "metallic", "Roughness": "roughness", "IOR": "ior", "Alpha": "alpha",
    "Normal": "normal", "Diffuse Roughness": "diffuse_roughness", "Specular IOR Level": "specular_ior_level",
    "Specular Tint": "specular_tint", "Anisotropic": "anisotropic", "Anisotropic Rotation": "anisotropic_rotation",
    "Tangent": "tangent", "Transmission Weight": "transmission_weight", "Coat Weight": "coat_weight",
    "Coat Roughness": "coat_roughness", "Coat IOR": "coat_ior", "Coat Tint": "coat_tint", "Coat Normal": "coat_normal",
    "Sheen Weight": "sheen_weight", "Sheen Roughness": "sheen_roughness", "Sheen Tint": "sheen_tint",
    "Emission Color": "emission_color", "Emission Strength": "emission_strength", "Subsurface Weight": "subsurface_weight",
}
PRINCIPLED_1 = {
    "Base Color": "base_color", "Metallic": "metallic", "Roughness": "roughness", "IOR": "ior", "Alpha": "alpha",
    "Normal": "normal", "Specular": "specular_ior_level", "Specular Tint": "specular_tint", "Anisotropic": "anisotropic",
    "Anisotropic Rotation": "anisotropic_rotation", "Tangent": "tangent", "Transmission": "transmission_weight",
    "Transmission Roughness": "transmission_roughness", "Clearcoat": "coat_weight",
    "Clearcoat Roughness": "coat_roughness", "Clearcoat Normal": "coat_normal", "Sheen": "sheen_weight",
    "Sheen Tint": "sheen_tint", "Emission": "emission_color", "Emission Strength": "emission_strength",
    "Subsurface": "subsurface_weight",
}
DISTRIBUTIONS = {"GGX": "ggx", "MULTI_GGX": "multi_ggx", "SHARP": "sharp", "BECKMANN": "beckmann",
                 "ASHIKHMIN_SHIRLEY": "ashikhmin_shirley"}


def distribution(node: Any) -> str:
    return DISTRIBUTIONS.get(getattr(node, "distribution", "GGX"), "ggx")


def generation(kind: str) -> int:
    """1: what the node meant before Blender 4.0 (diffuse: 4.3, when rough surfaces began to keep their energy)."""
    return 1 if bpy.app.version < ((4, 3, 0) if kind == "diffuse_bsdf" else (4, 0, 0)) else 2


def bump_shadowing() -> str:
    """How light at grazing angles fades on bent normals (measured: 4.3 the old way, 4.5 the new)."""
    return "chiang" if bpy.app.version < (4, 5, 0) else "conty"


def principled_node(compiler: Compiler, view: NodeView) -> Outputs:
    first = view.has("Specular") and not view.has("Specular IOR Level")
    names = PRINCIPLED_1 if first else PRINCIPLED_2
    given = {native: view.input(name) for name, native in names.items() if view.has(name)}
    if given.get("subsurface_weight", 0.0) != 0.0:
        compiler.context.warn_once(f"node '{view.node.name}': subsurface scattering is not supported yet: shown as diffuse")
        if first:
            given["base_color"] = compiler.link("result", "mix", "", {
                "factor": given["subsurface_weight"], "a": given["base_color"], "b": view.input("Subsurface Color")},
                data_type="color", blend="mix", clamp_factor=True, clamp_result=False, factor_mode="uniform")
    if view.has("Thin Film Thickness") and view.input("Thin Film Thickness") != 0.0:
        compiler.context.warn_once(f"node '{view.node.name}': thin film is not supported yet: left out")
    return {"BSDF": compiler.link("shader", "principled", view.node.name, given, distribution=distribution(view.node),
                                  version=1 if first else 2)}


def closure(kind: str, inputs: dict[str, str], output: str = "BSDF", with_distribution: bool = False, said: str = "") -> Any:
    def rule(compiler: Compiler, view: NodeView) -> Outputs:
        if said:
            compiler.context.warn_once(f"node '{view.node.name}' ({view.node.bl_label}) is not supported yet: {said}")
        given = {native: view.input(name) for name, native in inputs.items() if view.has(name)}
        params: dict[str, Any] = {"version": generation(kind)}
        if with_distribution:
            params["distribution"] = distribution(view.node)
        return {output: compiler.link("shader", kind, view.node.name, given, **params)}
    return rule


def mix_shader_node(compiler: Compiler, view: NodeView) -> Outputs:
    """A constant factor of 0 or 1 drops the unused branch."""
    factor = view.input("Fac")
    if not is_link(factor) and factor is not None and (factor <= 0.0 or factor >= 1.0):
        return {"Shader": view.input("Shader" if factor <= 0.0 else "Shader_001")}
    given = {"fac": factor, "shader": view.input("Shader"), "shader_001": view.input("Shader_001")}
    return {"Shader": compiler.link("shader", "mix_shader", view.node.name, given)}


def add_shader_node(compiler: Compiler, view: NodeView) -> Outputs:
    first, second = view.input("Shader"), view.input("Shader_001")
    if first is None or second is None:
        return {"Shader": second if first is None else first}
    return {"Shader": compiler.link("shader", "add_shader", view.node.name, {"shader": first, "shader_001": second})}


def metallic_node(compiler: Compiler, view: NodeView) -> Outputs:
    given = {native: view.input(name) for name, native in {
        "Base Color": "base_color", "Edge Tint": "edge_tint", "Roughness": "roughness", "Anisotropy": "anisotropy",
        "Rotation": "rotation", "Normal": "normal", "IOR": "ior", "Extinction": "extinction"}.items() if view.has(name)}
    fresnel = "physical_conductor" if getattr(view.node, "fresnel_type", "F82") == "PHYSICAL_CONDUCTOR" else "f82"
    return {"BSDF": compiler.link("shader", "metallic_bsdf", view.node.name, given, distribution=distribution(view.node),
                                  fresnel=fresnel)}


AS_DIFFUSE = closure("diffuse_bsdf", {"Color": "color", "Normal": "normal"}, said="shown as diffuse")
GLOSSY = closure("glossy_bsdf", {"Color": "color", "Roughness": "roughness", "Anisotropy": "anisotropy",
                                 "Rotation": "rotation", "Normal": "normal"}, with_distribution=True)

RULES = {
    "ShaderNodeBsdfPrincipled": principled_node,
    "ShaderNodeBsdfDiffuse": closure("diffuse_bsdf", {"Color": "color", "Roughness": "roughness", "Normal": "normal"}),
    "ShaderNodeBsdfGlossy": GLOSSY,
    "ShaderNodeBsdfAnisotropic": GLOSSY,
    "ShaderNodeBsdfGlass": closure("glass_bsdf", {"Color": "color", "Roughness": "roughness", "IOR": "ior",
                                                  "Normal": "normal"}, with_distribution=True),
    "ShaderNodeBsdfRefraction": closure("refraction_bsdf", {"Color": "color", "Roughness": "roughness", "IOR": "ior",
                                                            "Normal": "normal"}, with_distribution=True),
    "ShaderNodeBsdfMetallic": metallic_node,
    "ShaderNodeBsdfTranslucent": closure("translucent_bsdf", {"Color": "color", "Normal": "normal"}),
    "ShaderNodeBsdfTransparent": closure("transparent_bsdf", {"Color": "color"}),
    "ShaderNodeBsdfSheen": closure("sheen_bsdf", {"Color": "color", "Roughness": "roughness", "Normal": "normal"}),
    "ShaderNodeBsdfVelvet": closure("sheen_bsdf", {"Color": "color", "Sigma": "roughness", "Normal": "normal"},
                                    said="shown as sheen"),
    "ShaderNodeBsdfToon": AS_DIFFUSE,
    "ShaderNodeBsdfHair": AS_DIFFUSE,
    "ShaderNodeBsdfHairPrincipled": AS_DIFFUSE,
    "ShaderNodeSubsurfaceScattering": closure("subsurface_scattering", {"Color": "color", "Normal": "normal"}, "BSSRDF",
                                              said="shown as diffuse"),
    "ShaderNodeEmission": closure("emission", {"Color": "color", "Strength": "strength"}, "Emission"),
    "ShaderNodeBackground": closure("background", {"Color": "color", "Strength": "strength"}, "Background"),
    "ShaderNodeHoldout": closure("holdout", {}, "Holdout"),
    "ShaderNodeMixShader": mix_shader_node,
    "ShaderNodeAddShader": add_shader_node,
}
