// SPDX-License-Identifier: GPL-3.0-or-later
// Attributes of meshes by number: see attributes.h.
#include "materials/attributes.h"

#include <algorithm>

namespace afterglow {
namespace {

AttributeSlot find_in(const Mesh& mesh, const std::string& name) {
  if (name == kActiveColor) {
    if (mesh.active_color >= mesh.attributes.size()) return {};
    const Attribute& a = mesh.attributes[mesh.active_color];
    return {a.values.data(), a.width, a.domain};
  }
  for (const UvMap& map : mesh.uvs) {
    if (map.name == name && !map.values.empty()) return {&map.values.front().x, 2, Domain::kCorner};
  }
  for (const Attribute& a : mesh.attributes) {
    if (a.name == name && !a.values.empty()) return {a.values.data(), a.width, a.domain};
  }
  return {};
}

uint32_t element(const AttributeSlot& slot, const Mesh& mesh, uint32_t triangle, uint32_t k) {
  switch (slot.domain) {
    case Domain::kVertex:
      return mesh.triangles[3 * triangle + k];
    case Domain::kCorner:
      return mesh.corners.empty() ? 3 * triangle + k : mesh.corners[3 * triangle + k];
    case Domain::kFace:
      return mesh.faces.empty() ? triangle : mesh.faces[triangle];
    case Domain::kMesh:
      return 0;
  }
  return 0;
}

}  // namespace

uint32_t AttributeTables::number(const std::string& name) {
  const auto found = std::find(names.begin(), names.end(), name);
  if (found != names.end()) return uint32_t(found - names.begin());
  names.push_back(name);
  return uint32_t(names.size() - 1);
}

void AttributeTables::resolve(const Scene& scene) {
  slots.clear(), first.clear();
  if (names.empty()) return;
  std::unordered_map<const Mesh*, uint32_t> known;
  for (const InstanceRecord& record : scene.instances()) {
    if (!record.mesh) {
      first.push_back(kNone);
      continue;
    }
    const auto [place, fresh] = known.try_emplace(record.mesh, uint32_t(slots.size()));
    if (fresh) {
      for (const std::string& name : names) slots.push_back(find_in(*record.mesh, name));
    }
    first.push_back(place->second);
  }
}

Vec4 interpolate(const AttributeSlot& slot, const Mesh& mesh, const SurfacePoint& point) {
  const float weights[3] = {1.0f - point.u - point.v, point.u, point.v};
  const int width = std::min<int>(slot.width, 4), corners = slot.domain >= Domain::kFace ? 1 : 3;
  Vec4 result(0.0f, 0.0f, 0.0f, width < 4 ? 1.0f : 0.0f);
  for (int k = 0; k < corners; ++k) {
    const float* value = slot.values + size_t(element(slot, mesh, point.triangle, uint32_t(k))) * slot.width;
    for (int c = 0; c < width; ++c) result[c] += value[c] * (corners == 1 ? 1.0f : weights[k]);
  }
  if (width == 1) result = Vec4(result.x, result.x, result.x, 1.0f);
  return result;
}

void corner_values(const AttributeSlot& slot, const Mesh& mesh, uint32_t triangle, Vec2 out[3]) {
  for (uint32_t k = 0; k < 3; ++k) {
    const float* value = slot.values + size_t(element(slot, mesh, triangle, k)) * slot.width;
    out[k] = {value[0], slot.width > 1 ? value[1] : 0.0f};
  }
}

}  // namespace afterglow
