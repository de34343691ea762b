// SPDX-License-Identifier: GPL-3.0-or-later
// Texture nodes: images and procedural patterns as instructions.
#include "materials/emitter.h"

namespace afterglow {
namespace {

/// Where a texture looks when nothing is linked: generated coordinates, or the UV map for images.
Operand coordinates(Emitter& e, bool uv) {
  const Operand linked = e.linked_input("vector", Type::kVector);
  if (!linked.none()) return linked;
  return uv ? e.emit(Op::kUv, {}, {e.offset()}) : e.emit(Op::kTexCoord, {}, {0, e.offset()});
}

void checker(Emitter& e) {
  const auto [color, fac] = e.emit2(Op::kChecker, {coordinates(e, false), e.input("color1", Type::kColor, 0.8f),
                                                   e.input("color2", Type::kColor, 0.2f), e.input("scale", Type::kFloat, 5.0f)});
  e.output("color", Type::kColor, color);
  e.output("fac", Type::kFloat, fac);
}

}  // namespace

void register_texture_nodes(std::unordered_map<std::string, Handler>& all) { all["checker_texture"] = checker; }

}  // namespace afterglow
