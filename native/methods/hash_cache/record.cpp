// SPDX-License-Identifier: GPL-3.0-or-later
// Packing and the running mean: see record.h.
#include "methods/hash_cache/record.h"

#include <algorithm>
#include <cmath>

#include "methods/hash_cache/cells.h"

namespace afterglow::hash_cache {

void Record::set(const double light[3], uint32_t count, uint32_t stamp, uint64_t random) {
  const double most = std::max({light[0], light[1], light[2]});
  packed = 0;
  word = count << 13 | (stamp & (kStamps - 1)) << 1;
  if (!(most >= std::ldexp(1.0, kDarkest))) return;
  int exponent = std::min(std::ilogb(most) + 1, kBrightest);
  uint64_t mantissas[3];
  for (bool fits = false; !fits; ++exponent) {
    const double scale = std::ldexp(1.0, kMantissa - exponent);
    fits = true;
    for (int c = 0; c < 3; ++c) {
      const double lot = double(random >> 21 * c & 0x1fffffu) * 0x1p-21;
      mantissas[c] = uint64_t(light[c] * scale + lot);
      if (mantissas[c] >> kMantissa) {
        fits = exponent == kBrightest;
        mantissas[c] = (uint64_t(1) << kMantissa) - 1;
      }
    }
    if (fits) break;
  }
  const uint32_t unit = uint32_t(exponent - kMantissa + 127);
  packed = mantissas[0] | mantissas[1] << kMantissa | mantissas[2] << 2 * kMantissa | uint64_t(unit >> 1) << 57;
  word |= unit & 1u;
}

void Record::add(const Rgb& sum, uint32_t n, uint32_t stamp, uint32_t salt) {
  const uint32_t all = std::min(count() + n, kMostSamples);
  // Doubles: half a million samples' mean must feel one of them.
  const double share = 1.0 / double(std::max(all, n)), left = std::max(0.0, 1.0 - share * double(n));
  const Rgb before = light();
  double mean[3];
  for (int c = 0; c < 3; ++c) mean[c] = std::max(0.0, left * double(before[c]) + share * double(sum[c]));
  const uint64_t random = mix((uint64_t(salt) << 32 | tag) ^ packed * 0x9e3779b97f4a7c15u ^ uint64_t(word) << 20);
  set(mean, all, stamp, random);
}

}  // namespace afterglow::hash_cache
