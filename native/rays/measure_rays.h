// SPDX-License-Identifier: GPL-3.0-or-later
// What the wrapper costs over bare Embree calls, for benchmarks.
#pragma once

#include <span>
#include <vector>

#include "rays/ray_caster.h"

namespace afterglow {

struct RayTimings {
  std::vector<double> wrapped, bare;  // seconds for all rays on this thread, one entry a round
  uint64_t hits_wrapped = 0, hits_bare = 0;
};

/// Traces the same rays both ways, in turns, so that the machine's moods meet both.
RayTimings measure_rays(const RayCaster&, std::span<const Ray>, bool occlusion, int rounds);

}  // namespace afterglow
