// SPDX-License-Identifier: GPL-3.0-or-later
// Points that ask, taken together where they stand close on one object: the octree is descended once for all of them,
// and each record that it finds is compared in vector registers with those rows of eight points that it may reach. The
// same tests and weights as in interpolation.h, a column for each number.
#pragma once

#include <span>

#include "base/lanes.h"
#include "methods/instant_cache/interpolation.h"

namespace afterglow::instant_cache {

/// A row of points in a register.
using Lanes = Eight;
/// A place in a register, its last lane 0.
using Four = float __attribute__((vector_size(16)));

/// A box in registers.
struct LaneBox {
  static constexpr float kFar = 1e30f;  // the middle of nothing is a number
  Four lower{kFar, kFar, kFar, 0.0f}, upper{-kFar, -kFar, -kFar, 0.0f};
  LaneBox with(const Four& p) const {
    LaneBox wider;
    wider.lower = p < lower ? p : lower, wider.upper = p > upper ? p : upper;
    return wider;
  }
  bool wider_than(float size) const {
    const auto over = upper - lower > size;
    uint64_t words[2];
    std::memcpy(words, &over, sizeof(words));
    return (words[0] | words[1]) != 0;
  }
  Box box() const { return {{lower[0], lower[1], lower[2]}, {upper[0], upper[1], upper[2]}}; }
};
inline Four lanes_of(const CachePoint& p) { return Four{p.position.x, p.position.y, p.position.z, 0.0f}; }

struct PointGroup {
  static constexpr uint32_t kMost = 256, kLanes = 8, kRows = kMost / kLanes;
  uint32_t instance = kNone, count = 0;
  LaneBox taken, row;  // around all points so far, and around those of the last row
  Box around;          // all, once pad() was called
  float limit = 0.0f;  // the largest radius that any point allows
  float x[kMost], y[kMost], z[kMost], nx[kMost], ny[kMost], nz[kMost], inverse_limit[kMost];
  bool bumped = false;                                 // any lobe's normal differs; else the next columns are not set
  float bx[kMost], by[kMost], bz[kMost], bend[kMost];  // by which they differ; and their cosine, less 1
  uint32_t point[kMost];
  float lower[3][kRows], upper[3][kRows];  // boxes around rows of kLanes points each

  /// Whether the point may join without making the group much wider than records are.
  bool takes(uint32_t of_instance, const Four& at) const {
    return count && of_instance == instance && !taken.with(at).wider_than(3.0f * limit);
  }
  void begin(uint32_t of_instance) {
    instance = of_instance, count = 0, bumped = false;
    taken = row = LaneBox{};
    limit = 0.0f;
  }
  void add(uint32_t index, const CachePoint& p, const Four& at, float most_pixels) {
    const float reach = most_pixels * p.footprint;
    taken = taken.with(at), row = row.with(at);
    limit = std::max(limit, reach);
    x[count] = p.position.x, y[count] = p.position.y, z[count] = p.position.z;
    nx[count] = p.normal.x, ny[count] = p.normal.y, nz[count] = p.normal.z;
    if (p.bent != p.normal) bump(p);
    inverse_limit[count] = 1.0f / reach;
    point[count++] = index;
    if (count % kLanes == 0) end_row();
  }
  void end_row() {
    for (int axis = 0; axis < 3; ++axis) {
      lower[axis][(count - 1) / kLanes] = row.lower[axis];
      upper[axis][(count - 1) / kLanes] = row.upper[axis];
    }
    row = LaneBox{};
  }
  void bump(const CachePoint& p) {
    if (!bumped)
      for (float* column : {bx, by, bz, bend}) std::fill_n(column, kMost, 0.0f);
    bumped = true;
    const Vec3 by_bump = p.bent - p.normal;
    bx[count] = by_bump.x, by[count] = by_bump.y, bz[count] = by_bump.z;
    bend[count] = glm::dot(p.bent, p.normal) - 1.0f;
  }
  uint32_t rows() const { return (count + kLanes - 1) / kLanes; }
  uint32_t all_rows() const { return uint32_t((uint64_t(1) << rows()) - 1); }
  /// Lanes without a point stand where nothing is; rows without one, too.
  void pad() {
    if (count % kLanes) end_row();
    around = taken.box();
    for (int axis = 0; axis < 3; ++axis)
      for (uint32_t row = rows(); row < kRows; ++row) lower[axis][row] = upper[axis][row] = 1e18f;
    const uint32_t end = std::min(rows() * kLanes, kMost);  // said to the compiler, which cannot know that count is
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
  constexpr uint32_t kOpen = 4, kAhead = 16;
  PointGroup open[kOpen];
  uint32_t next = 0;
  const auto close = [&](PointGroup& group) {
    if (group.count) group.pad(), visit(static_cast<const PointGroup&>(group));
    group.count = 0;
  };
  for (uint32_t i = 0; i < count; ++i) {
    // Rounds of filling take points from here and there: memory would be waited for at each.
    const char* ahead = reinterpret_cast<const char*>(&at(std::min(i + kAhead, count - 1)));
    __builtin_prefetch(ahead), __builtin_prefetch(ahead + 64);
    if (!wants(i)) continue;
    const CachePoint& p = at(i);
    const Four place = lanes_of(p);
    PointGroup* group = nullptr;
    for (PointGroup& g : open)
      if (g.takes(p.instance, place)) {
        group = &g;
        break;
      }
    if (!group) {
      group = &open[next++ % kOpen];
      close(*group);
      group->begin(p.instance);
    }
    group->add(i, p, place, most_pixels);
    if (group->count == PointGroup::kMost) close(*group);
  }
  for (PointGroup& g : open) close(g);
}

/// Bits of the group's rows that the record may reach.
inline uint32_t rows_near(const Entry& e, const PointGroup& g) {
  const float inverse = std::max(e.inverse_radius, 1.0f / g.limit);
  uint8_t near[PointGroup::kRows];
  for (uint32_t i = 0; i < PointGroup::kRows; ++i) {
    const float dx = std::max(std::max(g.lower[0][i] - e.position.x, e.position.x - g.upper[0][i]), 0.0f);
    const float dy = std::max(std::max(g.lower[1][i] - e.position.y, e.position.y - g.upper[1][i]), 0.0f);
    const float dz = std::max(std::max(g.lower[2][i] - e.position.z, e.position.z - g.upper[2][i]), 0.0f);
    near[i] = (dx * dx + dy * dy + dz * dz) * (inverse * inverse) < 1.0001f;
  }
  uint32_t bits = 0;
  for (uint32_t i = 0; i < PointGroup::kRows; i += 8) {
    uint64_t bytes;
    std::memcpy(&bytes, near + i, sizeof(bytes));
    bits |= uint32_t(bytes * 0x0102040810204080ull >> 56) << i;
  }
  return bits;
}

inline bool any_above(const Lanes& v, const Lanes& bound) {
  const auto above = v > bound;
  uint64_t words[sizeof(v) / 8], any = 0;
  std::memcpy(words, &above, sizeof(above));
  for (const uint64_t w : words) any |= w;
  return any != 0;
}
inline bool all_above(const Lanes& v, const Lanes& bound) {
  const auto above = v > bound;
  uint64_t words[sizeof(v) / 8], all = ~uint64_t(0);
  std::memcpy(words, &above, sizeof(above));
  for (const uint64_t w : words) all &= w;
  return all == ~uint64_t(0);
}

/// A record seen from a row of points: the way to each point from it, and how much it counts there.
struct RowOfPoints {
  Lanes dx, dy, dz, weight;
};
inline RowOfPoints compare(const Entry& e, const PointGroup& g, uint32_t row, float angle_scale) {
  const uint32_t first = row * PointGroup::kLanes;
  const Vec3 at = e.position, n = e.normal;
  const Lanes dx = load_eight(g.x + first) - at.x, dy = load_eight(g.y + first) - at.y,
              dz = load_eight(g.z + first) - at.z;
  const Lanes nx = load_eight(g.nx + first), ny = load_eight(g.ny + first), nz = load_eight(g.nz + first), none = {};
  const Lanes inverse = larger(none + e.inverse_radius, load_eight(g.inverse_limit + first));
  const Lanes d2 = (dx * dx + dy * dy + dz * dz) * (inverse * inverse);
  const Lanes turn = 1.0f - (n.x * nx + n.y * ny + n.z * nz);
  const Lanes left = 1.0f - square_root(d2) - angle_scale * square_root(larger(turn, none));
  const Lanes off = (dx * (n.x + nx) + dy * (n.y + ny) + dz * (n.z + nz)) * (0.5f * inverse);
  const Lanes inside = larger(left, none);
  return {dx, dy, dz, inside * ((off < 0.1f) & (off > -0.1f) ? inside : none)};
}

/// The record's light at each point of the row (light_at()), in one colour.
inline Lanes light_at(const Record& r, int c, const PointGroup& g, uint32_t row, const RowOfPoints& p) {
  const uint32_t first = row * PointGroup::kLanes;
  const float here = r.irradiance[c];
  const Vec3 n = r.normal;
  const float sx = r.by_step[0][c], sy = r.by_step[1][c], sz = r.by_step[2][c];
  const float tx = r.by_turn[0][c], ty = r.by_turn[1][c], tz = r.by_turn[2][c];
  const Lanes none = {};
  const Lanes line = here + sx * p.dx + sy * p.dy + sz * p.dz + tx * (load_eight(g.nx + first) - n.x) +
                     ty * (load_eight(g.ny + first) - n.y) + tz * (load_eight(g.nz + first) - n.z);
  const Lanes light = smaller(larger(line, none + 0.5f * here), none + 2.0f * here);
  if (!g.bumped) return light;
  const Lanes bend = load_eight(g.bend + first);
  const Lanes turned = light + here * bend + tx * load_eight(g.bx + first) + ty * load_eight(g.by + first) +
                       tz * load_eight(g.bz + first);
  return bend != 0.0f ? smaller(larger(turned, none), 2.0f * light) : light;
}

}  // namespace afterglow::instant_cache
