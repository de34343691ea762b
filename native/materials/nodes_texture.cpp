// SPDX-License-Identifier: GPL-3.0-or-later
// Texture nodes: images and the checker as instructions.
#include "materials/emitter.h"

namespace afterglow {

Operand texture_coordinates(Emitter& e, bool uv) {
  Operand at = e.linked_input("vector", Type::kVector);
  if (at.none() && e.node().inputs.count("vector")) at = e.input("vector", Type::kVector, 0.0f);
  if (at.none()) at = uv ? e.emit(Op::kUv, {}, {e.offset()}) : e.emit(Op::kTexCoord, {}, {0, e.offset()});
  const std::vector<float>* m = e.table("mapping");
  if (!m || m->size() < 12) return at;
  std::vector<uint32_t> params;
  for (size_t k = 0; k < 12; ++k) params.push_back(Emitter::bits((*m)[k]));
  return e.emit(Op::kMatrix, {at}, std::move(params));
}

namespace {

uint32_t interpolation(Emitter& e) {
  const std::string name = e.text("interpolation", "linear");
  return name == "closest" ? 1u : name == "cubic" || name == "smart" ? 2u : 0u;
}

bool output_linked(Emitter& e, const char* name) {
  for (const Node& node : e.graph.nodes) {
    for (const auto& [input, value] : node.inputs) {
      const Link* link = std::get_if<Link>(&value);
      if (link && link->node == e.current && link->output == name) return true;
    }
  }
  return false;
}

uint32_t image_number(Emitter& e) {
  const auto found = e.node().params.find("image");
  const int64_t* handle = found == e.node().params.end() ? nullptr : std::get_if<int64_t>(&found->second);
  if (!handle || *handle <= 0 || !e.host.image) {
    e.warn("node \"" + e.node().name + "\" has no image: shown magenta");
    return kNone;
  }
  return e.host.image(*handle);
}

void image_texture(Emitter& e) {
  const std::string projection = e.text("projection", "flat"), extension = e.text("extension", "repeat");
  const uint32_t how = projection == "box" ? 1u : projection == "sphere" ? 2u : projection == "tube" ? 3u : 0u;
  const uint32_t outside = extension == "extend" ? 1u : extension == "clip" ? 2u : extension == "mirror" ? 3u : 0u;
  const auto [color, alpha] =
      e.emit2(Op::kImage, {texture_coordinates(e, how == 0)},
              {image_number(e), interpolation(e), outside, how, Emitter::bits(float(e.number("projection_blend", 0.0))),
               e.flag("unassociate", output_linked(e, "alpha"))});
  e.output("color", Type::kColor, color);
  e.output("alpha", Type::kFloat, alpha);
}

void environment_texture(Emitter& e) {
  e.output("color", Type::kColor,
           e.emit(Op::kEnvironment, {texture_coordinates(e, false)},
                  {image_number(e), interpolation(e), e.text("projection", "equirectangular") == "mirror_ball"}));
}

void checker(Emitter& e) {
  const auto [color, fac] =
      e.emit2(Op::kChecker, {texture_coordinates(e, false), e.input("color1", Type::kColor, 0.8f),
                             e.input("color2", Type::kColor, 0.2f), e.input("scale", Type::kFloat, 5.0f)});
  e.output("color", Type::kColor, color);
  e.output("fac", Type::kFloat, fac);
}

}  // namespace

void register_texture_nodes(std::unordered_map<std::string, Handler>& all) {
  all["image_texture"] = image_texture;
  all["environment_texture"] = environment_texture;
  all["checker_texture"] = checker;
  register_pattern_nodes(all);
}

}  // namespace afterglow
