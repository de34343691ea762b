// SPDX-License-Identifier: GPL-3.0-or-later
// Owen-scrambled Sobol points for pixels, padded over dimensions (Burley 2020, "Practical Hash-based Owen Scrambling"),
// and integer hashes. A sample is a pure function of (seed, index, dimension): no state that threads could share.
#pragma once

#include "base/math.h"

namespace afterglow {

uint32_t hash(uint32_t);  // a full avalanche (lowbias32 style)
uint32_t hash(uint32_t a, uint32_t b);
uint32_t hash(uint32_t a, uint32_t b, uint32_t c);

/// One path's stream of sample points. next2() consumes a pair whose four neighbours are stratified together.
class Sampler {
 public:
  Sampler(uint32_t seed, uint32_t index) : seed_(seed), index_(index) {}
  float next1();
  Vec2 next2();
  void set_dimension(uint32_t dimension) { dimension_ = dimension; }
  uint32_t dimension() const { return dimension_; }

 private:
  uint32_t seed_, index_, dimension_ = 0;
};

}  // namespace afterglow
