// SPDX-License-Identifier: GPL-3.0-or-later
// Where camera samples beyond every pixel's own bring most: edges, gloss and small bright things hold nearly all of the
// noise that a cache leaves, on a few per cent of the pixels. Samples in proportion to the deviation of a pixel's
// samples (Neyman 1934) make the error of the displayed picture smallest. Pure functions.
#pragma once

#include <cstdint>
#include <vector>

#include "film/film.h"

namespace afterglow {

/// Deviation of one sample of each pixel, in units of
enum class DeviationUnit {
  kLight,    // luminance itself
  kShown,    // the displayed value (its slope is 1 / √light) of a picture whose median of what is lit is 0.18
  kRelative  // the relative error
};
/// Of a mean m kShown divides by (m² + 0.01 · (2 · image mean)²)^(1/4), kRelative by the square of that. Variances and
/// means are shared by 3 × 3 neighbours; where pixels have one sample, it is the neighbours' spread that counts. Not to
/// be used once it was stopped.
std::vector<float> deviations(const std::vector<PixelNoise>&, uint32_t width, uint32_t height, DeviationUnit,
                              StopToken stop = {});

/// How many samples each pixel gets, `budget` in all at most: those that bring it nearest to a number in proportion to
/// its noise, which is `worth` times it at most: beyond, the next sample of n takes less than 1 / worth² from the square
/// of an error. No pixel gets more than `most` for each that it has. `seed` decides what fractions are rounded to.
std::vector<uint32_t> share_out(const std::vector<float>& noise, const std::vector<PixelNoise>&, uint64_t budget,
                                float worth, uint32_t most, uint32_t seed);

/// Requests for the film's noisy pixels, so that its extra samples are `extra` times its others, or fewer where little is
/// noisy: none where one sample's deviation, as shown, is below 1 / (5 extra).
std::vector<PixelRequest> extra_requests(const Film&, float extra);

}  // namespace afterglow
