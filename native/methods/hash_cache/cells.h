// SPDX-License-Identifier: GPL-3.0-or-later
// Which cell of which level a surface point belongs to: a cubic grid whose cells double in size from level to level
// (Roth et al. 2020, 3.1), and within each cell one entry for every object and side, so that the two sides of a sheet
// and two objects in the same cell are never mixed and no side depends on who came first. Pure functions.
#pragma once

#include <algorithm>

#include "base/math.h"

namespace afterglow::hash_cache {

inline constexpr int kRadiusLevel = 21;             // cells as large as the scene's radius
inline constexpr int kTopLevel = kRadiusLevel - 2;  // the largest that are filled

struct Cell {
  int32_t x = 0, y = 0, z = 0;
  uint32_t owner = 0;  // object and side
  uint32_t level = 0;
  bool operator==(const Cell&) const = default;
};

/// Six sides by the largest component of the geometric normal, which faces the side that is lit.
inline uint32_t side_of(const Vec3& n) {
  const Vec3 a = glm::abs(n);
  const uint32_t axis = a.x >= a.y && a.x >= a.z ? 0u : a.y >= a.z ? 1u : 2u;
  return 2 * axis + (n[int(axis)] < 0.0f ? 1u : 0u);
}
/// Beside its own cells, every owner has those that were filled by paths on their way: their light has been reflected
/// once less, so that a path which ends in them has been reflected as often as any other.
inline constexpr uint32_t kOnTheWay = 0x80000000u;
inline uint32_t owner_of(uint32_t instance, const Vec3& face_normal) { return instance * 8u + side_of(face_normal); }

inline Cell parent(const Cell& c) { return {c.x >> 1, c.y >> 1, c.z >> 1, c.owner, c.level + 1}; }

/// Full avalanche of 64 bits (Stafford 2011, variant 13).
inline uint64_t mix(uint64_t x) {
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

/// Both halves of a product of 128 bits depend on all bits of both words (Yi 2019, "wyhash").
inline uint64_t fold(uint64_t a, uint64_t b) {
  const unsigned __int128 product = (unsigned __int128)a * b;
  return uint64_t(product) ^ uint64_t(product >> 64);
}

/// 64 bits that stand for the whole cell: with 10^8 cells, two of them share a key with a chance of 3e-4 in all.
/// Its lower half is never 0, which means an empty slot.
inline uint64_t key_of(const Cell& c) {
  const uint64_t place = uint64_t(uint32_t(c.x)) | uint64_t(uint32_t(c.y)) << 32;
  const uint64_t rest = (uint64_t(uint32_t(c.z)) | uint64_t(c.owner) << 32) + c.level * 0x9e3779b97f4a7c15u;
  const uint64_t h = fold(fold(place ^ 0xa0761d6478bd642fu, rest ^ 0xe7037ed1a0b428dbu) ^ place, 0x8ebc6af09c88c6e3u);
  return uint32_t(h) ? h : h + 1;
}

/// The grid of one scene. It reaches 2^9 radii beyond the centre it was made for; what is farther shares the outermost
/// cells.
class Grid {
 public:
  Grid() = default;
  explicit Grid(const Box& bounds) {
    const float radius = bounds.empty() ? 1.0f : 0.5f * glm::length(bounds.size());
    finest_ = std::ldexp(std::exp2(std::ceil(std::log2(radius > 0.0f ? radius : 1.0f))), -kRadiusLevel);
    // Walls like to stand at round numbers: borders of cells stand elsewhere on every level.
    corner_ = (bounds.empty() ? Vec3(0.0f) : bounds.center()) -
              std::ldexp(finest_, kRadiusLevel) * Vec3(0.3137f, 0.2741f, 0.3459f);
  }
  Grid(float finest, const Vec3& corner) : finest_(finest), corner_(corner) {}
  /// Whether cells that were made for a scene serve it with other bounds as well: within reach, and neither the largest
  /// far too small nor the finest far too large.
  bool serves(const Box& bounds) const {
    if (bounds.empty()) return true;
    const float scale = Grid(bounds).finest_ / finest_, reach = std::ldexp(finest_, 30);
    const Vec3 farthest = glm::max(glm::abs(bounds.lower - corner_), glm::abs(bounds.upper - corner_));
    return scale <= 8.0f && scale >= 1.0f / 64.0f && glm::max(farthest.x, glm::max(farthest.y, farthest.z)) < reach;
  }
  float finest() const { return finest_; }
  const Vec3& corner() const { return corner_; }
  float size(int level) const { return finest_ * float(1u << level); }
  /// The level, with its fraction, whose cells have this size.
  float level(float size) const {
    if (!(size > finest_)) return 0.0f;  // no number, too
    return std::min(std::log2(size / finest_), float(kTopLevel));
  }
  Cell cell(const Vec3& position, uint32_t owner, int level) const {
    const Vec3 at = (position - corner_) * (1.0f / finest_);  // a power of two: exact
    const auto index = [&](float v) {
      return int32_t(std::floor(std::clamp(v, -0x1p30f, 0x1p30f))) >> level;  // nests: a parent is its children halved
    };
    return {index(at.x), index(at.y), index(at.z), owner, uint32_t(level)};
  }

 private:
  float finest_ = 1.0f;
  Vec3 corner_{0.0f};
};

/// Cells that hold more than `enough` samples get paths more rarely, down to one where eight would be sent.
inline float share_of_paths(uint32_t count, float enough) {
  return std::clamp(enough / float(count + 1), 0.125f, 1.0f);
}

/// How much of a level's light is taken when `count` samples stand in its cell and `wanted` are trusted fully.
inline float trust(uint32_t count, float wanted) { return std::min(1.0f, float(count) / wanted); }

}  // namespace afterglow::hash_cache
