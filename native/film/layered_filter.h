// SPDX-License-Identifier: GPL-3.0-or-later
// A cross-bilateral filter for one layer of a picture: the diffuse surfaces that paths met at the same number of
// surfaces from the camera (Roth et al. 2020, 3.4). It filters irradiance before albedo and throughput are applied,
// each layer by itself, so that what a mirror shows keeps its own edges and is never tinted by the mirror's other
// lobes.
#pragma once

#include <vector>

#include "base/cancel.h"
#include "base/math.h"

namespace afterglow {

struct LayerPixel {
  Vec3 position{0.0f}, normal{0.0f};
  float footprint = 0.0f;  // of a pixel on the surface
  float segment = 0.0f;    // length of the last ray
  float error = 0.0f;      // relative, as whoever answered believes; 0: exact, to be left alone
  Rgb light{0.0f};
  bool hole = false;  // nothing answered for it
};

/// Passes of a 5 × 5 kernel whose taps spread by 1, 2, 4, … pixels (Dammertz et al. 2010). Holes take the mean of
/// what surrounds them on their surface. Pixels that are exact stay as they are. The same on any number of threads.
/// One layer after another: begin(), set() for each pixel that has a surface there, run(), light() of each.
class LayeredFilter {
 public:
  /// An empty layer. Keeps its memory from layer to layer.
  void begin(uint32_t width, uint32_t height);
  /// Pixels may be set from several threads, each once.
  void set(size_t pixel, const LayerPixel&);
  void run(unsigned threads = 0, StopToken stop = {}, int passes = 3);
  Rgb light(size_t pixel) const;

 private:
  void block(int x, int y, int step);

  uint32_t width_ = 0, height_ = 0;
  std::vector<float> x_, y_, z_, nx_, ny_, nz_, footprint_, segment_, red_, green_, blue_, luminance_;
  std::vector<float> spread_;                // how far luminances may differ, relative
  std::vector<float> known_;                 // 1: light stands there, 0: none
  std::vector<float> next_[3], next_known_;  // of the pass that runs
  std::vector<uint8_t> todo_;                // to be filtered
};

}  // namespace afterglow
