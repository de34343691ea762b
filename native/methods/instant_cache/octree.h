// SPDX-License-Identifier: GPL-3.0-or-later
// Where records are found (Ward, Rubinstein and Clear 1988): an octree whose nodes hold the records that reach into
// them, each at the level whose nodes are about as large as the record's reach, so that all records that may answer a
// point stand on one way from the root down.
#pragma once

#include <span>

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
  void insert(uint32_t index, const Record&);
  /// A record's radius became another; its reach stays.
  void set_radius(uint32_t index, const Record&);

  /// Calls visit(const Entry&) for all records that may reach the position; it returns false to end the search.
  template <class Visit>
  void find(const Vec3& position, const Visit& visit) const {
    uint32_t node = 0;
    Vec3 center = center_;
    for (float half = half_; node != kNone;) {
      for (const Entry& entry : nodes_[node].entries)
        if (!visit(entry)) return;
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
  size_t bytes() const;

 private:
  struct Node {
    uint32_t children[8] = {kNone, kNone, kNone, kNone, kNone, kNone, kNone, kNone};
    std::vector<Entry> entries;
  };
  template <class Visit>
  void visit_nodes(const Record&, const Visit&);
  template <class Visit>
  void descend(uint32_t node, const Vec3& center, float half, const Record&, const Visit&);

  std::vector<Node> nodes_;
  Vec3 center_{0.0f};
  float half_ = 1.0f;
};

}  // namespace afterglow::instant_cache
