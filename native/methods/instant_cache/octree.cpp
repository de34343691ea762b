// SPDX-License-Identifier: GPL-3.0-or-later
// The octree of records: see octree.h.
#include "methods/instant_cache/octree.h"

#include <algorithm>

namespace afterglow::instant_cache {

void Octree::clear(const Vec3& center, float half_size) {
  nodes_.assign(1, Node{});
  center_ = center;
  half_ = std::max(half_size, 1e-30f);
}

template <class Visit>
void Octree::descend(uint32_t node, const Vec3& center, float half, const Record& record, const Visit& visit) {
  // As small as a node can be whose neighbours, but no others, the record reaches into: eight nodes at most.
  if (half < 2.0f * record.reach || half < half_ * 0x1p-20f) return visit(nodes_[node]);
  half *= 0.5f;
  for (uint32_t child = 0; child < 8; ++child) {
    const Vec3 at = center + half * Vec3(child & 1 ? 1.0f : -1.0f, child & 2 ? 1.0f : -1.0f, child & 4 ? 1.0f : -1.0f);
    const Vec3 outside = glm::max(glm::abs(record.position - at) - half, Vec3(0.0f));
    if (glm::dot(outside, outside) > record.reach * record.reach * 1.0001f) continue;
    if (nodes_[node].children[child] == kNone) {
      nodes_[node].children[child] = uint32_t(nodes_.size());
      nodes_.emplace_back();
    }
    descend(nodes_[node].children[child], at, half, record, visit);
  }
}

template <class Visit>
void Octree::visit_nodes(const Record& record, const Visit& visit) {
  descend(0, center_, half_, record, visit);
}

void Octree::insert(uint32_t index, const Record& record) {
  const Entry entry{record.position, 1.0f / std::max(record.radius, 1e-30f), record.normal, index,
                    record.place.instance};
  visit_nodes(record, [&](Node& node) { node.entries.push_back(entry); });
}

void Octree::set_radius(uint32_t index, const Record& record) {
  const float inverse = 1.0f / std::max(record.radius, 1e-30f);
  visit_nodes(record, [&](Node& node) {
    for (Entry& entry : node.entries)
      if (entry.record == index) entry.inverse_radius = inverse;
  });
}

size_t Octree::bytes() const {
  size_t sum = nodes_.capacity() * sizeof(Node);
  for (const Node& node : nodes_) sum += node.entries.capacity() * sizeof(Entry);
  return sum;
}

}  // namespace afterglow::instant_cache
