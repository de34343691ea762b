// SPDX-License-Identifier: GPL-3.0-or-later
// Eight numbers in a register; the compiler splits it where registers are narrower.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>

namespace afterglow {

using Eight = float __attribute__((vector_size(32)));
using EightBits = int32_t __attribute__((vector_size(32)));

inline Eight load_eight(const float* from) {
  Eight v;
  std::memcpy(&v, from, sizeof(v));
  return v;
}

inline Eight square_root(const Eight& v) {
  float values[8];
  std::memcpy(values, &v, sizeof(v));
  for (float& value : values) value = std::sqrt(value);
  return load_eight(values);
}

inline Eight larger(const Eight& a, const Eight& b) { return a > b ? a : b; }
inline Eight smaller(const Eight& a, const Eight& b) { return a < b ? a : b; }

}  // namespace afterglow
