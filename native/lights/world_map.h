// SPDX-License-Identifier: GPL-3.0-or-later
// Where a world shines: a latitude-longitude table of mean luminance from which directions are drawn by inverting the
// marginal and the conditional distribution, which keeps the stratification of the points that come in (Pharr,
// Jakob and Humphreys, "Physically Based Rendering", 2D piecewise-constant distributions).
#pragma once

#include <functional>
#include <vector>

#include "base/math.h"

namespace afterglow {

class WorldMap {
 public:
  using Radiance = std::function<Rgb(const Vec3& direction)>;
  /// Refines from a coarse grid until a finer one tells nothing new; resolution: width, 0: chosen. Runs in parallel.
  void build(const Radiance&, uint32_t resolution);
  void clear();
  bool empty() const { return row_.empty(); }
  /// Mean luminance over the sphere.
  float mean() const { return mean_; }
  uint32_t width() const { return width_; }
  size_t bytes() const { return 4 * (row_.capacity() + column_.capacity()); }

  Vec3 sample(const Vec2& u, float& density) const;
  float density(const Vec3& direction) const;

 private:
  uint32_t width_ = 0, height_ = 0;
  float mean_ = 0.0f;
  std::vector<float> row_;     // height + 1 cumulative shares of rows
  std::vector<float> column_;  // for each row width + 1 cumulative shares
};

}  // namespace afterglow
