// SPDX-License-Identifier: GPL-3.0-or-later
// The rays that a render would trace, for benchmarks of the ray caster: replayed there, they have the directions,
// lengths and order that count in practice.
#pragma once

#include "render/settings.h"
#include "transport/committed_scene.h"

namespace afterglow {

struct RecordedRays {
  std::vector<Ray> closest, occlusion;  // relative to the scene's origin; occlusion rays end at t_max
};

/// Walks the paths of the settings' image on one thread, at most `most` rays of each kind, spread over the image.
RecordedRays record_rays(const CommittedScene&, const RenderSettings&, size_t most);

}  // namespace afterglow
