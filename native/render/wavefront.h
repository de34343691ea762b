// SPDX-License-Identifier: GPL-3.0-or-later
// Rendering with a method that answers for diffuse lobes alone: camera paths are walked for direct light, mirrors,
// gloss and glass; every diffuse lobe that they meet becomes a question, the method answers a whole wavefront of them
// at once, and the answers join the film. Blocks and their order are those of the requests, whatever the number of
// threads.
#pragma once

#include "film/layered_filter.h"
#include "methods/path_tracing/kernel.h"
#include "methods/walk_settings.h"

namespace afterglow {

/// What an answer is multiplied with on its way into the picture.
struct Question {
  Rgb weight{0.0f};                                     // throughput × albedo / pi: times irradiance is light
  Rgb diffuse{0.0f}, glossy{0.0f}, transmission{0.0f};  // the passes' shares, where the first surface sent the path on
  uint32_t pixel = 0;                                   // of the wavefront
  uint32_t sample = 0;
  uint32_t path = 0;    // of the request
  bool direct = false;  // the first surface asks
};

/// One request's walks: sums of its pixels as the film wants them, without the answers.
struct WalkedRequest {
  std::vector<float> sums;
  std::vector<float> luminances;  // of each path, in the order of pixels and samples
  std::vector<CachePoint> points;
  std::vector<Question> questions;  // one a point
  RayCounts counts;
  uint32_t lights = 1;               // samples of the light sources at a first surface
  bool noise = false, done = false;  // luminances are wanted; it was not stopped
  /// Empty again, with the memory that it has.
  void clear(uint32_t wanted_lights, bool wanted_noise) {
    sums.clear(), luminances.clear(), points.clear(), questions.clear();
    counts = RayCounts{}, lights = wanted_lights, noise = wanted_noise, done = false;
  }
};

using WalkKernel = void (*)(const path_tracing::KernelInput&, const PixelRequest&, WalkedRequest&);
WalkKernel choose_walk_kernel(const Effects&, PassSet passes, bool local_view);

struct WavefrontTimes {
  double walk = 0.0, gather = 0.0, prepare = 0.0, filter = 0.0, film = 0.0, look = 0.0;
  uint64_t looks = 0, points = 0, holes = 0, dropped = 0;
  RayCounts counts;
};

/// All questions of a wavefront in the order of its requests.
struct Wavefront {
  std::vector<WalkedRequest> requests;
  std::vector<CachePoint> points;
  std::vector<Answer> answers;
  std::vector<uint32_t> unanswered;  // points without an answer, in each block of them
  std::vector<CachePoint> hole_points;
  std::vector<size_t> first;  // of each request's points
  LayeredFilter filter;
  std::vector<uint8_t> layers;  // of each point
};

/// Renders the requests; adds to `times` what each stage took. Memory of the wavefront is used again from call to call.
void render_wavefronts(IndirectMethod&, const CommittedScene&, std::span<const PixelRequest>, Film&, Work&,
                       const WalkSettings&, WavefrontTimes& times, Wavefront& memory);

}  // namespace afterglow
