// SPDX-License-Identifier: GPL-3.0-or-later
// What a render does next, decided by pure functions: how many samples each pass takes, which pixels a viewport pass
// adds, when to stop. Time decides only how many whole passes run, never what a pass contains.
#pragma once

#include <cstdint>
#include <vector>

#include "film/film.h"

namespace afterglow {

struct PassPlan {
  uint32_t first = 0, count = 0;  // samples; count 0: nothing is left
  uint32_t step = 1;              // pixels: every step-th, those of the pass before left out
  uint32_t skip = 0;
};

struct ScheduleOptions {
  uint32_t samples = 128;
  bool viewport = false;
  bool timed = false;     // small passes, so that a time limit is met closely
  uint32_t coarsest = 8;  // pixels: grid of a viewport's first pass, a power of two
};

/// Pass number `index` of a render, when `done` samples stand in every pixel.
PassPlan plan_pass(const ScheduleOptions&, uint32_t index, uint32_t done);

/// Grid of a viewport's first pass: the finest that is rendered within kFirstPassSeconds where a sample takes
/// `sample_seconds` (0: not known). The grid decides when a pixel gets its first sample and never what that sample is.
uint32_t coarsest_step(uint64_t pixels, double sample_seconds);
inline constexpr double kFirstPassSeconds = 0.02;
inline constexpr uint32_t kCoarsestStep = 32;

/// Share of its paths that a pass sends into a cache which many pixels fill (the square of the caching resolution
/// factor of Roth et al. 2020, 3.2). While the view moves, coarse pictures come and go: what they cost is mostly such
/// paths, and whoever walks on will not see what these would have bettered. The pass of all pixels, which a view gets
/// when it rests, sends them all. Of the view and the pass alone, never of a clock.
inline float caching_share(bool view_moved, uint32_t step) { return view_moved && step > 1 ? 0.25f : 1.0f; }

/// How a picture is denoised: whether albedo and normal are filtered by themselves first, and by the small network.
struct DenoisePlan {
  bool prefilter = false, fast = false;
};
/// samples: that every pixel has, those where noise is left out; kept: that the film's typical pixel has where samples
/// outlive frames, else 0. Prefiltered guides take a tenth to an eighth off the error at 4 and 16 samples. At one
/// sample and six where noise is those six bring the same for a third less processor time. Where frames of an animation
/// share theirs, they cost more than all else, and with some twenty samples neither they nor the large network better
/// the picture by more than a hundredth (Country Kitchen). exact: samples are a path tracer's. Where a cache answers,
/// one sample of each pixel is clean enough for the small network: 3 per cent more error by HashCache, none by the
/// instant cache, 8 by path tracing, for a tenth of the whole time.
DenoisePlan denoise_plan(bool viewport, uint32_t samples, uint32_t kept, bool exact);
inline constexpr uint32_t kQuickTo = 1;
inline constexpr uint32_t kPrefilterFrom = 4;
inline constexpr uint32_t kPrefilterTo = 12;

/// The pass as requests over a region, in an order that keeps neighbours together.
std::vector<PixelRequest> pass_requests(const PassPlan&, uint32_t x0, uint32_t y0, uint32_t x1, uint32_t y1);

/// The next sample for the pixels of a carried film that have fewest: those that an edit left without samples catch up
/// first, half as many again as the least at a time. None for pixels that have `enough`.
std::vector<PixelRequest> catch_up_requests(Film&, uint32_t enough);
uint32_t least_samples(const Film&);
/// The median.
uint32_t typical_samples(const Film&);
/// The asked sample of the pixels that were left for later.
std::vector<PixelRequest> waiting_requests(const Film&);

/// Whether a believed error is to be looked at after this many samples: when those batches that have begun are full.
inline bool error_is_due(uint32_t samples) { return samples >= 16 && samples % 16 == 0; }
/// Whether it may end the render: when all batches have samples.
inline bool error_may_stop(uint32_t samples) { return error_is_due(samples) && samples >= kAllBatches; }

/// Whether the next pass would end after the limit, if its samples take as long as those before.
inline bool limit_reached(double elapsed, double limit, uint32_t samples, uint32_t next) {
  return limit > 0.0 && samples > 0 && (elapsed >= limit || elapsed + elapsed * next / samples > 1.02 * limit);
}

}  // namespace afterglow
