// SPDX-License-Identifier: GPL-3.0-or-later
// Rendering with a method that answers for diffuse lobes alone: camera paths are walked for direct light, mirrors,
// gloss and glass; every diffuse lobe that they meet becomes a question, the method answers a whole wavefront of them
// at once, and the answers join the film. Blocks and their order are those of the requests, whatever the number of
// threads.
#pragma once

#include "methods/path_tracing/kernel.h"
#include "methods/walk_settings.h"

namespace afterglow {

/// What an answer is multiplied with on its way into the picture.
struct Question {
  Rgb weight{0.0f};                                     // throughput × albedo / pi: times irradiance is light
  Rgb diffuse{0.0f}, glossy{0.0f}, transmission{0.0f};  // the passes' shares, where the first surface sent the path on
  uint32_t pixel = 0;                                   // of the wavefront
  uint32_t sample = 0;
  bool direct = false;  // the first surface asks
};

/// One request's walks: sums of its pixels as the film wants them, without the answers.
struct WalkedRequest {
  std::vector<float> sums;
  std::vector<CachePoint> points;
  std::vector<Question> questions;  // one a point
  RayCounts counts;
  uint32_t lights = 1;  // samples of the light sources at a first surface
  bool done = false;
};

using WalkKernel = void (*)(const path_tracing::KernelInput&, const PixelRequest&, WalkedRequest&);
WalkKernel choose_walk_kernel(const Effects&, PassSet passes, bool local_view);

struct WavefrontTimes {
  double walk = 0.0, gather = 0.0, prepare = 0.0, filter = 0.0, film = 0.0;
  uint64_t points = 0, holes = 0, dropped = 0;
  RayCounts counts;
};

/// Renders the requests; adds to `times` what each stage took.
void render_wavefronts(IndirectMethod&, const CommittedScene&, std::span<const PixelRequest>, Film&, Work&,
                       const WalkSettings&, WavefrontTimes& times);

}  // namespace afterglow
