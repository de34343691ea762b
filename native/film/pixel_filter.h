// SPDX-License-Identifier: GPL-3.0-or-later
// Reconstruction filters of the pixel, sampled by importance: every sample then counts the same and the film needs no
// weights (Ernst et al. 2006, "Filter importance sampling"). Filters are separable; one inverted table serves both
// axes.
#pragma once

#include <vector>

#include "base/math.h"

namespace afterglow {

enum class PixelFilterKind : uint8_t { kBox, kGaussian, kBlackmanHarris };

/// How far a filter of Blender's setting `filter_width` reaches from the centre, in pixels: the setting is about the
/// width at half height. The box is always one pixel wide.
float filter_radius(PixelFilterKind, float width);
/// The unnormalised filter at x pixels from the centre.
float filter_value(PixelFilterKind, float width, float x);

class PixelFilter {
 public:
  PixelFilter(PixelFilterKind, float width);
  /// Offset from the pixel's centre, in pixels.
  Vec2 offset(const Vec2& u) const { return {invert(u.x), invert(u.y)}; }

 private:
  static constexpr int kSize = 1024;
  float invert(float u) const {
    const float x = u * kSize;
    const int i = x < float(kSize) ? int(x) : kSize - 1;
    return table_[size_t(i)] + (x - float(i)) * (table_[size_t(i) + 1] - table_[size_t(i)]);
  }
  std::vector<float> table_;
};

}  // namespace afterglow
