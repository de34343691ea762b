// SPDX-License-Identifier: GPL-3.0-or-later
// Shader nodes as instructions: which inputs they take, their defaults, and which effects they can bring.
#include <set>

#include "materials/closures.h"
#include "materials/emitter.h"
#include "scene/effects.h"

namespace afterglow {

bool is_closure(const std::string& type) {
  static const std::set<std::string> types{
      "principled",    "diffuse_bsdf",      "glossy_bsdf",      "glass_bsdf",           "refraction_bsdf",
      "metallic_bsdf", "translucent_bsdf",  "transparent_bsdf", "sheen_bsdf",           "subsurface_scattering",
      "emission",      "background",        "holdout",          "mix_shader",           "add_shader",
      "velvet_bsdf",   "toon_bsdf",         "hair_bsdf",        "principled_hair_bsdf", "ray_portal_bsdf",
      "no_shader",     "volume_absorption", "volume_scatter",   "principled_volume",    "volume_coefficients"};
  return types.count(type) != 0;
}

void Emitter::closure(Op op, std::vector<Operand> inputs, std::vector<uint32_t> params) {
  inputs.insert(inputs.begin(), 3, Operand{});  // closures take all their operands from the pool
  drafts.push_back({op, {kNone, kNone}, std::move(inputs), std::move(params)});
}

/// 0: plain GGX, 1: with compensation, 2: a mirror, 3: Beckmann.
uint32_t Emitter::distribution(const char* missing) const {
  const std::string name = text("distribution", missing);
  if (name == "multi_ggx" || name == "multiscatter_ggx") return 1;
  if (name == "sharp") return 2;
  if (name == "beckmann") return 3;
  if (name == "ashikhmin_shirley") warn("distribution \"" + name + "\" is rendered as GGX");
  return 0;
}

void Emitter::write_principled(Operand weight) {
  const uint32_t old = version() == 1 ? 1u : 0u;
  const auto is = [&](Operand o, float v) { return o.constant() && value_of(o).x == v; };
  const Operand alpha = input("alpha", Type::kFloat, 1.0f);
  const bool see_through = !(alpha.constant() && value_of(alpha).x >= 1.0f);
  const Operand color = input("emission_color", Type::kColor, old ? 0.0f : 1.0f);
  const Operand strength = input("emission_strength", Type::kFloat, old ? 1.0f : 0.0f);
  const bool emits = !is(strength, 0.0f) && !(color.constant() && is_black(value_of(color)));
  const Operand coat = input("coat_weight", Type::kFloat, 0.0f), sheen = input("sheen_weight", Type::kFloat, 0.0f);
  if (see_through) closure_effects |= kTransparency;
  if (emits) closure_effects |= kEmissiveMesh;
  if (kind == ProgramKind::kTransparency) {
    if (!see_through) return;
    const Operand rest = emit(Op::kOneMinus, {emit(Op::kClamp, {alpha, constant(0.0f), constant(1.0f)}, {0})});
    closure(Op::kTransparent, {emit(Op::kMath, {weight, rest, constant(0.0f)}, {2, 0}), constant(1.0f)});
    return;
  }
  if (kind == ProgramKind::kEmission) {
    if (!emits) return;
    if (old || (is(coat, 0.0f) && is(sheen, 0.0f))) {
      const Operand solid = emit(Op::kClamp, {alpha, constant(0.0f), constant(1.0f)}, {0});
      closure(Op::kEmission, {emit(Op::kMath, {weight, solid, constant(0.0f)}, {2, 0}), color, strength});
      return;
    }
  }
  const Operand transmission = input("transmission_weight", Type::kFloat, 0.0f);
  const Operand normal = linked_input("normal", Type::kVector);
  closure_effects |= kGlossy;
  if (!is(transmission, 0.0f)) closure_effects |= kTransmission;
  const Type tint = old ? Type::kFloat : Type::kColor;
  const float tint_default = old ? 0.0f : 1.0f;
  closure(Op::kPrincipled,
          {weight,
           input("base_color", Type::kColor, 0.8f),
           input("metallic", Type::kFloat, 0.0f),
           input("roughness", Type::kFloat, 0.5f),
           input("ior", Type::kFloat, old ? 1.45f : 1.5f),
           alpha,
           normal,
           input("diffuse_roughness", Type::kFloat, 0.0f),
           input("specular_ior_level", Type::kFloat, 0.5f),
           input("specular_tint", tint, tint_default),
           input("anisotropic", Type::kFloat, 0.0f),
           input("anisotropic_rotation", Type::kFloat, 0.0f),
           linked_input("tangent", Type::kVector),
           transmission,
           input("transmission_roughness", Type::kFloat, 0.0f),
           coat,
           input("coat_roughness", Type::kFloat, 0.03f),
           input("coat_ior", Type::kFloat, 1.5f),
           input("coat_tint", Type::kColor, 1.0f),
           linked_input("coat_normal", Type::kVector),
           sheen,
           input("sheen_roughness", Type::kFloat, 0.5f),
           input("sheen_tint", tint, old ? 0.5f : 1.0f),
           color,
           strength},
          {distribution(old ? "ggx" : "multi_ggx") == 1 ? 1u : 0u, version()});
}

void Emitter::write_closure(Operand weight) {
  const std::string& type = node().type;
  const bool surface = kind == ProgramKind::kSurface;
  const auto color = [&](float missing) { return input("color", Type::kColor, missing); };
  const auto normal = [&] { return linked_input("normal", Type::kVector); };
  const auto number = [&](const char* name, float missing) { return input(name, Type::kFloat, missing); };
  if (type == "principled") return write_principled(weight);
  if (type == "transparent_bsdf" || type == "holdout" || type == "ray_portal_bsdf") {
    if (type == "ray_portal_bsdf") warn("\"" + node().name + "\": ray portals are shown transparent");
    closure_effects |= kTransparency;
    if (type == "holdout") {
      if (surface) closure(Op::kHoldout, {weight});
    } else if (kind != ProgramKind::kEmission) {
      closure(Op::kTransparent, {weight, color(1.0f)});
    }
    return;
  }
  if (type == "emission" || type == "background") {
    const Operand c = color(1.0f), s = number("strength", 1.0f);
    if ((c.constant() && is_black(value_of(c))) || (s.constant() && !(value_of(s).x > 0.0f))) return;
    closure_effects |= kEmissiveMesh;
    if (kind != ProgramKind::kTransparency) closure(Op::kEmission, {weight, c, s});
    return;
  }
  if (!surface) return;
  if (type == "diffuse_bsdf") {
    const Operand roughness = number("roughness", 0.0f), n = normal();
    const bool smooth = roughness.constant() && value_of(roughness).x <= 1e-5f;
    if (!smooth || !n.none()) closure_effects |= kGlossy;  // more than one Lambert lobe
    closure(Op::kDiffuse, {weight, color(0.8f), n, smooth ? Operand{} : roughness}, {version()});
    return;
  }
  closure_effects |= kGlossy;
  if (type == "glossy_bsdf") {
    closure(Op::kGlossy,
            {weight, color(0.8f), normal(), number("roughness", 0.5f), number("anisotropy", 0.0f),
             number("rotation", 0.0f), linked_input("tangent", Type::kVector)},
            {distribution("multi_ggx"), version()});
  } else if (type == "glass_bsdf" || type == "refraction_bsdf") {
    closure_effects |= kTransmission;
    const bool glass = type == "glass_bsdf";
    closure(glass ? Op::kGlass : Op::kRefraction,
            {weight, color(1.0f), normal(), number("roughness", 0.0f), number("ior", glass ? 1.5f : 1.45f)},
            {distribution(glass ? "multi_ggx" : "ggx"), version()});
  } else if (type == "metallic_bsdf") {
    const bool physical = text("fresnel", "f82").find("physical") != std::string::npos ||
                          text("fresnel_type", "f82").find("physical") != std::string::npos;
    const Operand tint = input("edge_tint", Type::kColor, Vec3(0.695f, 0.726f, 0.770f));
    closure(Op::kMetallic,
            {weight, input("base_color", Type::kColor, Vec3(0.617f, 0.577f, 0.540f)), normal(),
             number("roughness", 0.5f), number("anisotropy", 0.0f), number("rotation", 0.0f),
             linked_input("tangent", Type::kVector), tint, input("ior", Type::kVector, Vec3(2.757f, 2.513f, 2.231f)),
             input("extinction", Type::kVector, Vec3(3.867f, 3.404f, 3.009f))},
            {distribution("multi_ggx"), physical ? 1u : 0u});
  } else if (type == "translucent_bsdf") {
    closure_effects |= kTransmission;
    closure(Op::kTranslucent, {weight, color(0.8f), normal()});
  } else if (type == "sheen_bsdf" || type == "velvet_bsdf") {
    if (type == "velvet_bsdf") warn("\"" + node().name + "\": velvet is shown as sheen");
    closure(Op::kSheenLobe, {weight, color(0.8f), normal(), number("roughness", 0.5f)});
  } else {
    const bool volume = type.find("volume") != std::string::npos;
    if (type != "no_shader") {
      warn("\"" + node().name + "\": " + type + (volume ? " is left out" : " is shown as diffuse"));
    }
    if (!volume && type != "no_shader") closure(Op::kDiffuse, {weight, color(0.8f), normal(), Operand{}}, {version()});
  }
}

}  // namespace afterglow
