// SPDX-License-Identifier: GPL-3.0-or-later
// The octree of records: see octree.h.
#include "methods/instant_cache/octree.h"

#include <algorithm>

namespace afterglow::instant_cache {

namespace {

constexpr float kFar = 1e18f;  // where unused lanes stand: its square is a number

}  // namespace

void Octree::clear(const Vec3& center, float half_size) {
  nodes_.assign(1, Node{});
  blocks_.clear(), unused_ = kNone;
  entries_.clear(), within_.clear();
  center_ = center;
  half_ = std::max(half_size, 1e-30f);
  rounding_ = 1e-6f * (half_ + max_component(glm::abs(center_)));
}

/// The smallest node that holds the place and reaches as far beyond its own sides as the record; what stands outside of
/// everything or reaches too far belongs to the root.
uint32_t Octree::node_of(const Vec3& position, float within) {
  const Vec3 off = glm::abs(position - center_);
  if (!(std::max(off.x, std::max(off.y, off.z)) <= half_)) return 0;
  Vec3 center = center_;
  uint32_t node = 0;
  float half = 0.5f * half_;
  for (uint32_t level = 0; level < kLevels && within <= half; ++level, half *= 0.5f) {
    uint32_t child = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const bool upper = position[axis] >= center[axis];
      child |= uint32_t(upper) << axis;
      center[axis] += upper ? half : -half;
    }
    if (nodes_[node].children[child] == kNone) {
      nodes_[node].children[child] = uint32_t(nodes_.size());
      make_room(nodes_, nodes_.size() + 1), nodes_.emplace_back();
    }
    node = nodes_[node].children[child];
  }
  return node;
}

void Octree::place(Block& block, uint32_t lane, uint32_t index) const {
  const bool none = index == kNone;
  const Vec3 position = none ? Vec3(kFar) : entries_[index].position;
  block.x[lane] = position.x, block.y[lane] = position.y, block.z[lane] = position.z;
  block.inverse_radius[lane] = none ? 1.0f : entries_[index].inverse_radius;
  block.record[lane] = index;
}

void Octree::put(Node& node, uint32_t index) {
  if (node.count % kLanes == 0) {
    uint32_t block = unused_;
    if (block == kNone)
      block = uint32_t(blocks_.size()), make_room(blocks_, block + 1), blocks_.emplace_back();
    else
      unused_ = blocks_[block].next;
    for (uint32_t i = 0; i < kLanes; ++i) place(blocks_[block], i, kNone);
    blocks_[block].next = node.first;
    node.first = block;
  }
  place(blocks_[node.first], node.count++ % kLanes, index);
}

/// The last one of the first block takes its place.
void Octree::take(Node& node, uint32_t index) {
  for (uint32_t b = node.first; b != kNone; b = blocks_[b].next)
    for (uint32_t i = 0; i < kLanes; ++i) {
      if (blocks_[b].record[i] != index) continue;
      Block& first = blocks_[node.first];
      const uint32_t last = --node.count % kLanes;
      place(blocks_[b], i, first.record[last]);
      place(first, last, kNone);
      if (!last) {
        const uint32_t emptied = node.first;
        node.first = first.next;
        first.next = unused_, unused_ = emptied;
      }
      return;
    }
}

void Octree::insert(uint32_t index, const Record& record, float within) {
  if (index >= entries_.size()) {
    make_room(entries_, index + 1), make_room(within_, index + 1);
    entries_.resize(index + 1), within_.resize(index + 1, 0.0f);
  }
  entries_[index] = {record.position, 1.0f / std::max(record.radius, 1e-30f), record.normal, record.place.instance};
  within_[index] = within;
  const uint32_t node = node_of(record.position, kWider * within);
  put(nodes_[node], index);
}

void Octree::set_radius(uint32_t index, const Record& record) {
  if (within_[index] != record.radius) move(index, record);
}

void Octree::move(uint32_t index, const Record& record) {
  const uint32_t node = node_of(entries_[index].position, kWider * within_[index]);
  take(nodes_[node], index);
  insert(index, record, record.radius);
}

void Octree::find_near(const Box& box, float inverse_limit, uint32_t instance, std::vector<uint32_t>& found) const {
  found.clear();
  visit_near(box, inverse_limit, [&](uint32_t record) {
    if (entries_[record].instance == instance) found.push_back(record);
    return true;
  });
  std::sort(found.begin(), found.end());
}

size_t Octree::bytes() const {
  return nodes_.capacity() * sizeof(Node) + blocks_.capacity() * sizeof(Block) + entries_.capacity() * sizeof(Entry) +
         within_.capacity() * sizeof(float);
}

}  // namespace afterglow::instant_cache
