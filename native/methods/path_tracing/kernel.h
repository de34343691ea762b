// SPDX-License-Identifier: GPL-3.0-or-later
// One compiled kernel of the path tracer for each set of features; kernels_*.cpp hold four of the sixteen each, so that
// a clean build is spread over the processors.
#pragma once

#include "base/cancel.h"
#include "film/film.h"
#include "lights/camera.h"
#include "transport/path_walker.h"

namespace afterglow::path_tracing {

struct KernelInput {
  WalkScene walk;
  const CameraRays& camera;
  Film& film;
  float clamp_direct = kInfinity, clamp_indirect = kInfinity;  // on the sum of the channels
  uint32_t seed = 0;
  StopToken stop;
};

using Kernel = void (*)(const KernelInput&, const PixelRequest&, RayCounts&);

/// The kernel that holds no more than what these effects and passes need.
Kernel choose_kernel(uint32_t features);
uint32_t kernel_features(const Effects&, PassSet passes, bool local_view);

template <uint32_t kFeatures>
void render_request(const KernelInput&, const PixelRequest&, RayCounts&);

}  // namespace afterglow::path_tracing
