// SPDX-License-Identifier: GPL-3.0-or-later
// What a cell of the paper's own structure keeps, in 15 bytes instead of 24 (Roth et al. 2020, 3.1): light and count of
// both sides, a normal, the frame of its last reset. Light has mantissas as long as a half's under one exponent of
// eight bits, so that nothing ends at 65504; counts are floating (Morris 1978; Csűrös 2010); all are rounded by lot, so
// that means neither stall nor drift.
#pragma once

#include <cstdint>

#include "base/math.h"

namespace afterglow::hash_cache {

/// The front is where the normal's largest component is positive: geometry decides, not who came first.
inline bool faces_front(const Vec3& normal) {
  const Vec3 a = glm::abs(normal);
  return (a.x >= a.y && a.x >= a.z ? normal.x : a.y >= a.z ? normal.y : normal.z) >= 0.0f;
}

/// The same with numbers to calculate with.
struct BothSides {
  Rgb light[2]{};        // front and back: mean of irradiance / pi
  uint64_t count[2]{};   // samples of each, right on average: codes of 5 bits and 4 after the point, up to 31 × 2^30
  Vec3 normal{0, 0, 1};  // of the front, to four degrees a rounding
  uint32_t frame = 0;    // of the last reset, modulo kFrames
};

class BothSidesRecord {
 public:
  static constexpr uint32_t kFrames = 256;
  static constexpr uint32_t kWindow = 2048;  // samples that a mean remembers: rounding's noise stays near the samples'
  BothSides unpack() const;
  /// Rounded by what `random` decides.
  void pack(const BothSides&, uint64_t random);
  /// `n` samples with this sum arrive at the side that the normal faces, in a frame. What was kept before the frame
  /// `changed`, at most 127 frames ago, is forgotten first.
  void add(const Vec3& normal, const Rgb& sum, uint32_t n, uint32_t frame, uint32_t changed, uint32_t salt);

 private:
  uint8_t bytes_[15]{};
};
static_assert(sizeof(BothSidesRecord) == 15);

}  // namespace afterglow::hash_cache
