// SPDX-License-Identifier: GPL-3.0-or-later
// Directions and colours in four bytes each: directions on an unfolded octahedron (Meyer et al. 2010), colours with an
// exponent that all three share (Ward 1991); transmittance in two.
#pragma once

#include <algorithm>
#include <cmath>

#include "base/math.h"

namespace afterglow {

inline uint32_t pack_direction(const Vec3& d) {
  const Vec3 a = glm::abs(d);
  const float scale = 1.0f / std::max(a.x + a.y + a.z, 1e-30f);
  Vec2 at(d.x * scale, d.y * scale);
  if (d.z < 0.0f) at = Vec2(std::copysign(1.0f - std::fabs(at.y), at.x), std::copysign(1.0f - std::fabs(at.x), at.y));
  const auto part = [](float x) { return uint32_t(std::clamp(x * 32767.0f + 32768.5f, 1.0f, 65535.0f)); };
  return part(at.x) | part(at.y) << 16;
}

inline Vec3 unpack_direction(uint32_t packed) {
  const auto part = [](uint32_t x) { return (float(x) - 32768.0f) / 32767.0f; };
  Vec3 d(part(packed & 0xffff), part(packed >> 16), 0.0f);
  d.z = 1.0f - std::fabs(d.x) - std::fabs(d.y);
  if (d.z < 0.0f) {
    const float x = d.x;
    d.x = std::copysign(1.0f - std::fabs(d.y), d.x), d.y = std::copysign(1.0f - std::fabs(x), d.y);
  }
  return glm::normalize(d);
}

/// To a 512th of the brightest channel; what is negative or no number is black.
inline uint32_t pack_color(const Rgb& c) {
  const float most = std::max(std::max(c.x, c.y), c.z);
  if (!(most > 1e-30f) || !std::isfinite(most)) return 0;
  int exponent;
  std::frexp(most * (256.0f / 255.5f), &exponent);
  const float scale = std::ldexp(1.0f, 8 - exponent);
  const auto part = [&](float x) { return uint32_t(std::clamp(x * scale + 0.5f, 0.0f, 255.0f)); };
  return part(c.x) | part(c.y) << 8 | part(c.z) << 16 | uint32_t(exponent + 128) << 24;
}

inline Rgb unpack_color(uint32_t packed) {
  const float scale = std::ldexp(1.0f, int(packed >> 24) - 136);
  return Rgb(float(packed & 255), float(packed >> 8 & 255), float(packed >> 16 & 255)) * (packed ? scale : 0.0f);
}

/// To three small numbers; 0 and 1 are kept exactly.
inline uint16_t pack_transmittance(const Rgb& t) {
  const auto part = [](float x, float steps) { return uint16_t(std::clamp(x, 0.0f, 1.0f) * steps + 0.5f); };
  return uint16_t(part(t.x, 31.0f) << 11 | part(t.y, 63.0f) << 5 | part(t.z, 31.0f));
}

inline Rgb unpack_transmittance(uint16_t packed) {
  return {float(packed >> 11) / 31.0f, float(packed >> 5 & 63) / 63.0f, float(packed & 31) / 31.0f};
}

}  // namespace afterglow
