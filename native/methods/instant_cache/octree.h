// SPDX-License-Identifier: GPL-3.0-or-later
// Where records are found (Ward, Rubinstein and Clear 1988): a loose octree (Ulrich 2000). Each record stands once, in
// the node that holds its place, at the level whose nodes are two to four of its radii wide; who looks for records asks
// all nodes that, taken twice as wide, touch the place asked for. Records stand in blocks of eight, which one vector
// instruction compares, and blocks in one pool, so that a record takes some 60 bytes here and is moved at once.
#pragma once

#include <bit>
#include <cstring>

#include "methods/instant_cache/records.h"

namespace afterglow::instant_cache {

/// What decides whether a record may be used, packed for the look-up.
struct Entry {
  Vec3 position;
  float inverse_radius;
  Vec3 normal;
  uint32_t instance;
};

class Octree {
 public:
  void clear(const Vec3& center, float half_size);
  /// Within `within` of its place the record may be found.
  void insert(uint32_t index, const Record&, float within);
  /// A record's radius became another, and it is to be found within that.
  void set_radius(uint32_t index, const Record&);
  /// A record stands elsewhere.
  void move(uint32_t index, const Record&);

  /// Calls visit(uint32_t record) for the records whose radius, at most 1 / inverse_limit, holds any point of the box,
  /// and maybe for some that miss it by a rounding; in no order. It returns false to end the search.
  template <class Visit>
  void visit_near(const Box& box, float inverse_limit, const Visit& visit) const;
  /// Those of one object, in the order of their numbers.
  void find_near(const Box& box, float inverse_limit, uint32_t instance, std::vector<uint32_t>& found) const;
  const Entry& entry(uint32_t record) const { return entries_[record]; }
  size_t bytes() const;

 private:
  static constexpr uint32_t kLanes = 8, kLevels = 20;
  static constexpr float kWider = 1.0001f;  // of a radius: against rounding
  struct Block {
    float x[kLanes], y[kLanes], z[kLanes], inverse_radius[kLanes];
    uint32_t record[kLanes];
    uint32_t next;  // of the same node; all blocks of a node but the first are full
  };
  struct Node {
    uint32_t children[8] = {kNone, kNone, kNone, kNone, kNone, kNone, kNone, kNone};
    uint32_t first = kNone, count = 0;
  };
  uint32_t node_of(const Vec3& position, float within);
  void put(Node&, uint32_t index);
  void take(Node&, uint32_t index);
  void place(Block&, uint32_t lane, uint32_t index) const;

  std::vector<Node> nodes_;
  std::vector<Block> blocks_;
  uint32_t unused_ = kNone;     // the first of the blocks that no node holds
  std::vector<Entry> entries_;  // by record
  std::vector<float> within_;
  Vec3 center_{0.0f};
  float half_ = 1.0f;
  float rounding_ = 0.0f;  // of places
};

template <class Visit>
void Octree::visit_near(const Box& box, float inverse_limit, const Visit& visit) const {
  struct Step {
    uint32_t node;
    float center[3], half;
  };
  Step stack[8 * (kLevels + 2)];
  uint32_t waiting = 0;
  stack[waiting++] = {0, {center_.x, center_.y, center_.z}, half_};
  while (waiting) {
    const Step step = stack[--waiting];
    const Node& node = nodes_[step.node];
    for (uint32_t b = node.first; b != kNone; b = blocks_[b].next) {
      const Block& block = blocks_[b];
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
      for (; bytes; bytes &= bytes - 1)
        if (!visit(block.record[std::countr_zero(bytes) / 8])) return;
    }
    // A child's records reach half as far again as its own sides are away; below it no farther.
    const float half = 0.5f * step.half, reach = kWider * 2.0f * half + rounding_;
    for (uint32_t child = 0; child < 8; ++child) {
      if (node.children[child] == kNone) continue;
      Step next{node.children[child], {}, half};
      bool touched = true;
      for (int axis = 0; axis < 3; ++axis) {
        const float middle = step.center[axis] + (child >> axis & 1 ? half : -half);
        next.center[axis] = middle;
        touched &= (box.lower[axis] - middle <= reach) & (middle - box.upper[axis] <= reach);
      }
      if (touched) stack[waiting++] = next;
    }
  }
}

}  // namespace afterglow::instant_cache
