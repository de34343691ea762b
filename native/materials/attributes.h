// SPDX-License-Identifier: GPL-3.0-or-later
// Mesh attributes by number, resolved once a commit, so that programs never look up a name at a hit.
#pragma once

#include <string>
#include <unordered_map>
#include <vector>

#include "rays/surface_point.h"

namespace afterglow {

struct AttributeSlot {
  const float* values = nullptr;  // null: this mesh has no such attribute
  uint8_t width = 0;
  Domain domain = Domain::kCorner;
};

struct AttributeTables {
  std::vector<std::string> names;    // by number
  std::vector<AttributeSlot> slots;  // names.size() for each distinct mesh
  std::vector<uint32_t> first;       // by instance: its mesh's first slot
  uint32_t generated = kNone;        // number of the attribute "generated", when a program wants it

  uint32_t number(const std::string& name);
  void resolve(const Scene&);
  const AttributeSlot* find(uint32_t instance, uint32_t number) const {
    if (instance >= first.size() || number >= names.size() || first[instance] == kNone) return nullptr;
    const AttributeSlot& slot = slots[first[instance] + number];
    return slot.values ? &slot : nullptr;
  }
};

/// Before the name of a UV map: the corners' tangents in object space and, fourth, the sign of the bitangent.
inline const std::string kTangents = "tangents of ";
inline constexpr const char* kActiveColor = "\001active color";

/// Interpolated at the hit; missing components are 0, a missing alpha 1.
Vec4 interpolate(const AttributeSlot&, const Mesh&, const SurfacePoint&);
/// The three corners' values of an attribute (width 2 or more).
void corner_values(const AttributeSlot&, const Mesh&, uint32_t triangle, Vec2 out[3]);

}  // namespace afterglow
