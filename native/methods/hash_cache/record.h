// SPDX-License-Identifier: GPL-3.0-or-later
// One cell's light in 16 bytes: three mantissas of 19 bits under one exponent (Ward 1991, with more bits), a count, an
// age and a tag. Means are rounded up or down by lot, in proportion (Forsythe 1950), so that a running mean never
// stalls however small a sample's share in it: what is kept is right on average, and its noise stays below the samples'
// own.
#pragma once

#include <bit>
#include <cstdint>

#include "base/math.h"

namespace afterglow::hash_cache {

/// Mantissas of one exponent: the brightest channel lies between 2^(kMantissa - 1) and 2^kMantissa.
inline constexpr int kMantissa = 19;
/// Light below 2^-107 is black, above 2^127 as bright as that; samples of more than 1e30 never come here.
inline constexpr int kDarkest = -107, kBrightest = 127;

struct Record {
  static constexpr uint32_t kMostSamples = (1u << 19) - 1, kStamps = 1u << 12;
  static constexpr uint32_t kOld = 1u << 11;  // passes; what is older is kept at this age, so that ages never wrap
  uint32_t tag = 0;                           // half of the cell's key; 0: empty
  uint32_t word = 0;                          // count: 19 bits; stamp: 12; one of the exponent
  uint64_t packed = 0;

  uint32_t count() const { return word >> 13; }
  uint32_t stamp() const { return word >> 1 & (kStamps - 1); }  // when samples last came, modulo kStamps
  /// Passes since samples last came; `now` and stamps are known modulo kStamps.
  uint32_t age(uint32_t now) const { return (now - stamp()) & (kStamps - 1); }
  void set_age(uint32_t passes, uint32_t now) {
    word = (word & ~((kStamps - 1) << 1)) | ((now - passes) & (kStamps - 1)) << 1;
  }
  /// Mean of irradiance / pi.
  Rgb light() const {
    const float unit = std::bit_cast<float>((uint32_t(packed >> 57) << 1 | (word & 1u)) << 23);
    constexpr uint32_t kMask = (1u << kMantissa) - 1;
    return Rgb(float(int32_t(uint32_t(packed) & kMask)), float(int32_t(uint32_t(packed >> kMantissa) & kMask)),
               float(int32_t(uint32_t(packed >> 2 * kMantissa) & kMask))) *
           unit;
  }
  void set_count(uint32_t count) { word = count << 13 | (word & 0x1fffu); }
  /// Rounded by what `random` says: 21 of its bits for each channel.
  void set(const double light[3], uint32_t count, uint32_t stamp, uint64_t random);
  /// `n` samples with this sum join the mean. `salt` tells apart updates of the same cell, for the rounding. The count
  /// stops at kMostSamples: from then on the mean forgets what is older than half a million samples.
  void add(const Rgb& sum, uint32_t n, uint32_t stamp, uint32_t salt);
};
static_assert(sizeof(Record) == 16);

}  // namespace afterglow::hash_cache
