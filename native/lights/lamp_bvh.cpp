// SPDX-License-Identifier: GPL-3.0-or-later
// Building the tree of lamp_bvh.h: top down, halves of equal count along the longest side of the lamps' centres.
#include "lights/lamp_bvh.h"

namespace afterglow {

namespace {

/// All places where the lamp can be met, with room for rounding. A disk may face any way.
Box box_of(const Lamp& lamp) {
  Vec3 reach(lamp.radius);
  if (lamp.shape == LampShape::kRectangle || lamp.shape == LampShape::kEllipse)
    reach = 0.5f * (glm::abs(lamp.edge_u) + glm::abs(lamp.edge_v));
  reach += Vec3(1e-5f * max_component(reach) + 4e-6f * max_component(glm::abs(lamp.position)));
  return {lamp.position - reach, lamp.position + reach};
}

}  // namespace

void LampBvh::build(std::span<const Lamp> lamps) {
  nodes_.clear(), order_.clear();
  std::vector<Box> boxes(lamps.size());
  for (uint32_t i = 0; i < lamps.size(); ++i)
    if (lamps[i].hittable) order_.push_back(i), boxes[i] = box_of(lamps[i]);
  if (order_.empty()) return;
  nodes_.push_back({{}, 0, uint32_t(order_.size())});
  for (size_t at = 0; at < nodes_.size(); ++at) {  // nodes that are split append their children
    const uint32_t begin = nodes_[at].first, count = nodes_[at].count;
    Box box, centers;
    for (uint32_t i = begin; i < begin + count; ++i)
      box.extend(boxes[order_[i]]), centers.extend(boxes[order_[i]].center());
    nodes_[at].box = box;
    if (count <= kLeafSize) continue;
    const Vec3 size = centers.size();
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const uint32_t half = count / 2;
    std::nth_element(order_.begin() + begin, order_.begin() + begin + half, order_.begin() + begin + count,
                     [&](uint32_t a, uint32_t b) {
                       const float x = boxes[a].center()[axis], y = boxes[b].center()[axis];
                       return x != y ? x < y : a < b;
                     });
    nodes_[at].first = uint32_t(nodes_.size()), nodes_[at].count = 0;
    nodes_.push_back({{}, begin, half});
    nodes_.push_back({{}, begin + half, count - half});
  }
}

}  // namespace afterglow
