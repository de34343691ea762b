// SPDX-License-Identifier: GPL-3.0-or-later
// Builds the inverted cumulative table of a pixel filter.
#include "film/pixel_filter.h"

#include <algorithm>

namespace afterglow {

float filter_radius(PixelFilterKind kind, float width) {
  if (kind == PixelFilterKind::kBox) return 0.5f;
  return kind == PixelFilterKind::kGaussian ? 1.5f * width : width;
}

float filter_value(PixelFilterKind kind, float width, float x) {
  const float radius = filter_radius(kind, width);
  if (std::fabs(x) > radius) return 0.0f;
  if (kind == PixelFilterKind::kBox) return 1.0f;
  if (kind == PixelFilterKind::kGaussian) {
    const float v = 3.0f * x / radius;
    return std::exp(-2.0f * v * v);
  }
  const float v = kPi * (x / radius + 1.0f);  // Harris 1978, four terms
  return 0.35875f - 0.48829f * std::cos(v) + 0.14128f * std::cos(2.0f * v) - 0.01168f * std::cos(3.0f * v);
}

PixelFilter::PixelFilter(PixelFilterKind kind, float width) : table_(kSize + 1) {
  width = std::max(width, 1e-3f);
  const float half = filter_radius(kind, width);
  constexpr int kSteps = 16 * kSize;
  std::vector<double> cumulative(kSteps + 1, 0.0);
  for (int i = 0; i < kSteps; ++i) {
    const float x = half * (2.0f * (float(i) + 0.5f) / kSteps - 1.0f);
    cumulative[size_t(i) + 1] = cumulative[size_t(i)] + std::max(0.0f, filter_value(kind, width, x));
  }
  size_t at = 0;
  for (int i = 0; i <= kSize; ++i) {
    const double wanted = cumulative.back() * i / kSize;
    while (at + 1 < kSteps && cumulative[at + 1] < wanted) ++at;
    const double step = cumulative[at + 1] - cumulative[at];
    const double inside = step > 0.0 ? std::clamp((wanted - cumulative[at]) / step, 0.0, 1.0) : 0.5;
    table_[size_t(i)] = float(half * (2.0 * (double(at) + inside) / kSteps - 1.0));
  }
}

}  // namespace afterglow
