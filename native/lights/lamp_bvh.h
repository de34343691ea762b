// SPDX-License-Identifier: GPL-3.0-or-later
// Which lamps a ray may run into: a binary tree of boxes over the lamps that have a shape, so that a ray meets few of
// ten thousand. Boxes are split in the middle of their lamps (Kay and Kajiya 1986); a few lamps are one leaf.
#pragma once

#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include "lights/lamp.h"
#include "rays/ray_caster.h"

namespace afterglow {

class LampBvh {
 public:
  /// Over the hittable ones; indices are those of the span.
  void build(std::span<const Lamp> lamps);
  bool empty() const { return nodes_.empty(); }
  size_t bytes() const { return nodes_.capacity() * sizeof(Node) + order_.capacity() * 4; }

  /// Calls visit(lamp) for each lamp whose box the ray meets between its t_min and `t_max`, in an order that depends on
  /// nothing but the ray and the lamps. visit returns the distance up to which lamps are still asked for.
  template <class Visit>
  void meet(const Ray& ray, float t_max, const Visit& visit) const {
    if (nodes_.empty()) return;
    const auto reciprocal = [](float d) { return 1.0f / (std::fabs(d) > 1e-20f ? d : std::copysign(1e-20f, d)); };
    const Vec3 inverse(reciprocal(ray.direction.x), reciprocal(ray.direction.y), reciprocal(ray.direction.z));
    std::array<uint32_t, kMostDepth> stack;
    uint32_t waiting = 0, node = 0;
    while (true) {
      const Node& n = nodes_[node];
      const Vec3 a = (n.box.lower - ray.origin) * inverse, b = (n.box.upper - ray.origin) * inverse;
      const Vec3 in = glm::min(a, b), out = glm::max(a, b);
      const float enter = std::max(std::max(in.x, in.y), std::max(in.z, ray.t_min));
      const float leave = std::min(std::min(out.x, out.y), std::min(out.z, t_max));
      if (enter <= leave * kWider) {
        if (!n.count) {
          stack[waiting++] = n.first + 1;
          node = n.first;
          continue;
        }
        for (uint32_t i = n.first; i < n.first + n.count; ++i) t_max = visit(order_[i]);
      }
      if (!waiting) return;
      node = stack[--waiting];
    }
  }

 private:
  static constexpr uint32_t kLeafSize = 4, kMostDepth = 40;
  static constexpr float kWider = 1.0f + 0x1p-20f;  // what the slabs' arithmetic may have rounded away
  /// Children stand side by side: first, first + 1. A leaf (count > 0) holds order_[first, first + count).
  struct Node {
    Box box;
    uint32_t first = 0, count = 0;
  };
  std::vector<Node> nodes_;
  std::vector<uint32_t> order_;  // place → lamp
};

}  // namespace afterglow
