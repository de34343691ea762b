// SPDX-License-Identifier: GPL-3.0-or-later
// The octree of records: see octree.h.
#include "methods/instant_cache/octree.h"

#include <algorithm>

namespace afterglow::instant_cache {

namespace {

constexpr float kFar = 1e18f;                       // where unused lanes stand: its square is a number
constexpr uint32_t kUpper[3] = {0xaa, 0xcc, 0xf0};  // children on the upper side of each axis
constexpr float kWider = 1.0001f;                   // of a radius: against rounding

}  // namespace

void Octree::clear(const Vec3& center, float half_size) {
  nodes_.assign(1, Node{});
  entries_.clear(), within_.clear();
  center_ = center;
  half_ = std::max(half_size, 1e-30f);
}

template <class Visit>
void Octree::descend(uint32_t node, const Vec3& center, float half, const Vec3& position, float within,
                     const Visit& visit) {
  // Nodes from one to two radii wide: on a surface a record reaches into some ten of them.
  if (half < within || half < half_ * 0x1p-20f) return visit(nodes_[node]);
  uint32_t touched = 0xff;
  for (int axis = 0; axis < 3; ++axis) {
    if (position[axis] - within > center[axis]) touched &= kUpper[axis];
    if (position[axis] + within < center[axis]) touched &= ~kUpper[axis];
  }
  half *= 0.5f;
  for (; touched; touched &= touched - 1) {
    const uint32_t child = uint32_t(std::countr_zero(touched));
    const Vec3 at = center + half * Vec3(child & 1 ? 1.0f : -1.0f, child & 2 ? 1.0f : -1.0f, child & 4 ? 1.0f : -1.0f);
    if (nodes_[node].children[child] == kNone) {
      nodes_[node].children[child] = uint32_t(nodes_.size());
      nodes_.emplace_back();
    }
    descend(nodes_[node].children[child], at, half, position, within, visit);
  }
}

void Octree::place(Node& node, uint32_t at, uint32_t index) const {
  Block& block = node.blocks[at / kLanes];
  const uint32_t lane = at % kLanes;
  const bool none = index == kNone;
  const Vec3 position = none ? Vec3(kFar) : entries_[index].position;
  block.x[lane] = position.x, block.y[lane] = position.y, block.z[lane] = position.z;
  block.inverse_radius[lane] = none ? 1.0f : entries_[index].inverse_radius;
  block.record[lane] = index;
}

void Octree::put(Node& node, uint32_t index) const {
  if (node.count == node.blocks.size() * kLanes) {
    node.blocks.emplace_back();
    for (uint32_t i = 0; i < kLanes; ++i) place(node, node.count + i, kNone);
  }
  uint32_t at = node.count++;
  for (; at > 0; --at) {  // mostly the last
    const uint32_t before = node.blocks[(at - 1) / kLanes].record[(at - 1) % kLanes];
    if (before < index) break;
    place(node, at, before);
  }
  place(node, at, index);
}

void Octree::take(Node& node, uint32_t index) const {
  bool found = false;
  for (uint32_t at = 0; at < node.count; ++at) {
    const uint32_t here = node.blocks[at / kLanes].record[at % kLanes];
    if (found) place(node, at - 1, here);
    found |= here == index;
  }
  if (found) place(node, --node.count, kNone);
}

void Octree::insert(uint32_t index, const Record& record, float within) {
  if (index >= entries_.size()) entries_.resize(index + 1), within_.resize(index + 1, 0.0f);
  entries_[index] = {record.position, 1.0f / std::max(record.radius, 1e-30f), record.normal, index,
                     record.place.instance};
  within_[index] = within;
  descend(0, center_, half_, record.position, kWider * within, [&](Node& node) { put(node, index); });
}

void Octree::set_radius(uint32_t index, const Record& record) {
  if (within_[index] == record.radius) return;
  descend(0, center_, half_, record.position, kWider * within_[index], [&](Node& node) { take(node, index); });
  insert(index, record, record.radius);
}

void Octree::move(uint32_t index, const Record& record) {
  const Vec3 before = entries_[index].position;
  descend(0, center_, half_, before, kWider * within_[index], [&](Node& node) { take(node, index); });
  insert(index, record, record.radius);
}

void Octree::find_near(const Box& box, float inverse_limit, uint32_t instance, std::vector<uint32_t>& found) const {
  struct Visit {
    uint32_t node;
    float center[3], half;
  };
  found.clear();
  Visit stack[8 * 24];
  uint32_t waiting = 0;
  stack[waiting++] = {0, {center_.x, center_.y, center_.z}, half_};
  while (waiting) {
    const Visit v = stack[--waiting];
    const Node& node = nodes_[v.node];
    for (const Block& block : node.blocks) {
      uint8_t inside[kLanes];
      for (uint32_t i = 0; i < kLanes; ++i) {
        const float dx = std::max(std::max(box.lower.x - block.x[i], block.x[i] - box.upper.x), 0.0f);
        const float dy = std::max(std::max(box.lower.y - block.y[i], block.y[i] - box.upper.y), 0.0f);
        const float dz = std::max(std::max(box.lower.z - block.z[i], block.z[i] - box.upper.z), 0.0f);
        const float inverse = std::max(block.inverse_radius[i], inverse_limit);
        inside[i] = (dx * dx + dy * dy + dz * dz) * (inverse * inverse) < kWider;
      }
      uint64_t bytes;
      std::memcpy(&bytes, inside, sizeof(bytes));
      for (; bytes; bytes &= bytes - 1) {
        const uint32_t record = block.record[std::countr_zero(bytes) / 8];
        if (entries_[record].instance == instance) found.push_back(record);
      }
    }
    uint32_t touched = 0xff;
    for (int axis = 0; axis < 3; ++axis) {
      if (!(box.upper[axis] >= v.center[axis])) touched &= ~kUpper[axis];
      if (!(box.lower[axis] < v.center[axis])) touched &= kUpper[axis];
    }
    const float half = 0.5f * v.half;
    for (; touched; touched &= touched - 1) {
      const uint32_t child = uint32_t(std::countr_zero(touched));
      if (node.children[child] == kNone) continue;
      stack[waiting] = {node.children[child], {v.center[0], v.center[1], v.center[2]}, half};
      for (int axis = 0; axis < 3; ++axis) stack[waiting].center[axis] += child >> axis & 1 ? half : -half;
      waiting++;
    }
  }
  std::sort(found.begin(), found.end());
  found.erase(std::unique(found.begin(), found.end()), found.end());
}

size_t Octree::bytes() const {
  size_t sum = nodes_.capacity() * sizeof(Node) + entries_.capacity() * (sizeof(Entry) + sizeof(float));
  for (const Node& node : nodes_) sum += node.blocks.capacity() * sizeof(Block);
  return sum;
}

}  // namespace afterglow::instant_cache
