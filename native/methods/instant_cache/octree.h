// SPDX-License-Identifier: GPL-3.0-or-later
// Where records are found (Ward, Rubinstein and Clear 1988): an octree whose nodes hold the records that reach into
// them, each at the level whose nodes are about as large as the record, so that all records that may answer a point
// stand on one way from the root down. Places stand in blocks of eight, which one vector instruction compares.
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
  uint32_t record;
  uint32_t instance;
};

class Octree {
 public:
  void clear(const Vec3& center, float half_size);
  /// Within `within` of its place the record may be found. Records are visited in the order of their numbers, node
  /// after node, whatever the order of insertion.
  void insert(uint32_t index, const Record&, float within);
  /// A record's radius became another, and it is to be found within that.
  void set_radius(uint32_t index, const Record&);
  /// A record stands elsewhere.
  void move(uint32_t index, const Record&);

  /// Calls visit(const Entry&) for the records whose radius, at most 1 / inverse_limit, holds the position; it returns
  /// false to end the search.
  template <class Visit>
  void find(const Vec3& position, float inverse_limit, const Visit& visit) const {
    uint32_t node = 0;
    Vec3 center = center_;
    for (float half = half_; node != kNone;) {
      for (const Block& block : nodes_[node].blocks) {
        uint8_t inside[kLanes];
        for (uint32_t i = 0; i < kLanes; ++i) {
          const float dx = position.x - block.x[i], dy = position.y - block.y[i], dz = position.z - block.z[i];
          const float inverse = std::max(block.inverse_radius[i], inverse_limit);
          inside[i] = (dx * dx + dy * dy + dz * dz) * (inverse * inverse) < 1.0f;
        }
        uint64_t bytes;
        std::memcpy(&bytes, inside, sizeof(bytes));
        for (uint32_t near = uint32_t(bytes * 0x0102040810204080ull >> 56); near; near &= near - 1)  // a bit a byte
          if (!visit(entries_[block.record[std::countr_zero(near)]])) return;
      }
      uint32_t child = 0;
      half *= 0.5f;
      for (int axis = 0; axis < 3; ++axis) {
        const bool upper = position[axis] >= center[axis];
        child |= uint32_t(upper) << axis;
        center[axis] += upper ? half : -half;
      }
      node = nodes_[node].children[child];
    }
  }
  /// The records of one object whose radius, at most 1 / inverse_limit, holds any point of the box: in the order of
  /// their numbers.
  void find_near(const Box& box, float inverse_limit, uint32_t instance, std::vector<uint32_t>& found) const;
  const Entry& entry(uint32_t record) const { return entries_[record]; }
  size_t bytes() const;

 private:
  static constexpr uint32_t kLanes = 8;
  struct Block {
    float x[kLanes], y[kLanes], z[kLanes], inverse_radius[kLanes];
    uint32_t record[kLanes];
  };
  struct Node {
    uint32_t children[8] = {kNone, kNone, kNone, kNone, kNone, kNone, kNone, kNone};
    std::vector<Block> blocks;
    uint32_t count = 0;
  };
  template <class Visit>
  void descend(uint32_t node, const Vec3& center, float half, const Vec3& position, float within, const Visit& visit);
  void put(Node&, uint32_t index) const;
  void take(Node&, uint32_t index) const;
  void place(Node&, uint32_t at, uint32_t index) const;

  std::vector<Node> nodes_;
  std::vector<Entry> entries_;  // by record
  std::vector<float> within_;
  Vec3 center_{0.0f};
  float half_ = 1.0f;
};

}  // namespace afterglow::instant_cache
