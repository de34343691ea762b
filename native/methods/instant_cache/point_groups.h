// SPDX-License-Identifier: GPL-3.0-or-later
// Points that ask, taken together where they stand close on one object: the octree is descended once for all of them,
// and each record that it finds is compared with all of them in vector registers. The same tests and weights as in
// interpolation.h, a column for each number.
#pragma once

#include <span>

#include "methods/instant_cache/interpolation.h"

namespace afterglow::instant_cache {

struct PointGroup {
  static constexpr uint32_t kMost = 64, kLanes = 16;
  uint32_t instance = kNone, count = 0;
  Box around;
  float limit = 0.0f;  // the largest radius that any point allows
  float x[kMost], y[kMost], z[kMost], nx[kMost], ny[kMost], nz[kMost], inverse_limit[kMost];
  bool bumped = false;                                 // any lobe's normal differs; else the next columns are not set
  float bx[kMost], by[kMost], bz[kMost], bend[kMost];  // by which they differ; and their cosine, less 1
  uint32_t point[kMost];

  /// Whether the point may join without making the group much wider than records are.
  bool takes(const CachePoint& p) const {
    if (p.instance != instance) return false;
    Box wider = around;
    wider.extend(p.position);
    return max_component(wider.size()) <= 3.0f * limit;
  }
  void begin(uint32_t of_instance) {
    instance = of_instance, count = 0, bumped = false;
    around = Box{};
    limit = 0.0f;
  }
  void add(uint32_t index, const CachePoint& p, float most_pixels) {
    const float reach = most_pixels * p.footprint;
    around.extend(p.position);
    limit = std::max(limit, reach);
    x[count] = p.position.x, y[count] = p.position.y, z[count] = p.position.z;
    nx[count] = p.normal.x, ny[count] = p.normal.y, nz[count] = p.normal.z;
    if (p.bent != p.normal) bump(p);
    inverse_limit[count] = 1.0f / reach;
    point[count++] = index;
  }
  void bump(const CachePoint& p) {
    if (!bumped)
      for (float* column : {bx, by, bz, bend}) std::fill_n(column, kMost, 0.0f);
    bumped = true;
    const Vec3 by_bump = p.bent - p.normal;
    bx[count] = by_bump.x, by[count] = by_bump.y, bz[count] = by_bump.z;
    bend[count] = glm::dot(p.bent, p.normal) - 1.0f;
  }
  uint32_t padded() const { return (count + kLanes - 1) / kLanes * kLanes; }
  /// Lanes without a point stand where nothing is.
  void pad() {
    const uint32_t end = std::min(padded(), kMost);  // said to the compiler, which cannot know that count is
    for (uint32_t i = count; i < end; ++i) {
      x[i] = y[i] = z[i] = 1e18f;
      nx[i] = ny[i] = nz[i] = inverse_limit[i] = 0.0f;
    }
  }
};

/// Calls visit(const PointGroup&) until all points that are wanted were in a group; at(i): the point, wants(i):
/// whether.
template <class At, class Wants, class Visit>
void in_groups(uint32_t count, float most_pixels, const At& at, const Wants& wants, const Visit& visit) {
  constexpr uint32_t kOpen = 4;
  PointGroup open[kOpen];
  uint32_t next = 0;
  const auto close = [&](PointGroup& group) {
    if (group.count) group.pad(), visit(static_cast<const PointGroup&>(group));
    group.count = 0;
  };
  for (uint32_t i = 0; i < count; ++i) {
    if (!wants(i)) continue;
    const CachePoint& p = at(i);
    PointGroup* group = nullptr;
    for (PointGroup& g : open)
      if (g.count && g.takes(p)) {
        group = &g;
        break;
      }
    if (!group) {
      group = &open[next++ % kOpen];
      close(*group);
      group->begin(p.instance);
    }
    group->add(i, p, most_pixels);
    if (group->count == PointGroup::kMost) close(*group);
  }
  for (PointGroup& g : open) close(g);
}

/// How much a record counts at each point of the group, [padded()]. False: nowhere.
inline bool record_weights(const Entry& e, const PointGroup& g, float angle_scale, float* weights) {
  const Vec3 at = e.position, n = e.normal;
  const uint32_t size = g.padded();
  const float own = e.inverse_radius;
  for (uint32_t i = 0; i < size; ++i) {
    const float dx = g.x[i] - at.x, dy = g.y[i] - at.y, dz = g.z[i] - at.z;
    const float inverse = own > g.inverse_limit[i] ? own : g.inverse_limit[i];
    const float d2 = (dx * dx + dy * dy + dz * dz) * (inverse * inverse);
    const float turn = 1.0f - (n.x * g.nx[i] + n.y * g.ny[i] + n.z * g.nz[i]);
    const float left = 1.0f - std::sqrt(d2) - angle_scale * std::sqrt(turn > 0.0f ? turn : 0.0f);
    const float off = (dx * (n.x + g.nx[i]) + dy * (n.y + g.ny[i]) + dz * (n.z + g.nz[i])) * (0.5f * inverse);
    const float inside = left > 0.0f ? left : 0.0f;
    weights[i] = inside * (std::fabs(off) < 0.1f ? inside : 0.0f);
  }
  uint32_t any = 0;
  for (uint32_t i = 0; i < size; ++i) any |= std::bit_cast<uint32_t>(weights[i]);
  return any != 0;
}

/// Weights times the record's light at each point (light_at()), added up.
inline void add_light(const Record& r, const PointGroup& g, const float* weights, float* sum_r, float* sum_g,
                      float* sum_b) {
  const uint32_t size = g.padded();
  float* sums[3] = {sum_r, sum_g, sum_b};
  const Vec3 at = r.position, n = r.normal;
  for (int c = 0; c < 3; ++c) {
    const float here = r.irradiance[c], low = 0.5f * here, high = 2.0f * here;
    const float sx = r.by_step[0][c], sy = r.by_step[1][c], sz = r.by_step[2][c];
    const float tx = r.by_turn[0][c], ty = r.by_turn[1][c], tz = r.by_turn[2][c];
    float* sum = sums[c];
    if (g.bumped) {
      for (uint32_t i = 0; i < size; ++i) {
        const float line = here + sx * (g.x[i] - at.x) + sy * (g.y[i] - at.y) + sz * (g.z[i] - at.z) +
                           tx * (g.nx[i] - n.x) + ty * (g.ny[i] - n.y) + tz * (g.nz[i] - n.z);
        const float light = std::min(std::max(line, low), high);
        const float turned = light + here * g.bend[i] + tx * g.bx[i] + ty * g.by[i] + tz * g.bz[i];
        const float bounded = std::min(std::max(turned, 0.0f), 2.0f * light);
        sum[i] += weights[i] * (g.bend[i] != 0.0f ? bounded : light);
      }
      continue;
    }
    for (uint32_t i = 0; i < size; ++i) {
      const float line = here + sx * (g.x[i] - at.x) + sy * (g.y[i] - at.y) + sz * (g.z[i] - at.z) +
                         tx * (g.nx[i] - n.x) + ty * (g.ny[i] - n.y) + tz * (g.nz[i] - n.z);
      const float above = line > low ? line : low;
      sum[i] += weights[i] * (above < high ? above : high);
    }
  }
}

}  // namespace afterglow::instant_cache
