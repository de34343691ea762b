// SPDX-License-Identifier: GPL-3.0-or-later
// One image through a denoiser without waiting for it to the end: a library asks whether it may go on between its
// layers only, which take a third of a second each for large images, and a cancel must be obeyed sooner than that.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "film/denoiser.h"

namespace afterglow {

/// Interleaved RGB images that the task owns.
struct DenoiseImages {
  uint32_t width = 0, height = 0;
  std::vector<float> color, albedo, normal, surface, error, seen;
  bool fast = false, prefilter = false;
  unsigned threads = 0;
};

using DenoiserMaker = std::function<std::shared_ptr<Denoiser>()>;

/// Filters the colour in place, on a thread of its own, where a missing denoiser is made as well. Throws Cancelled a
/// few milliseconds after `stop`: the library then ends its layer in the background, and the denoiser is taken away
/// from the caller.
void run_denoise_task(std::shared_ptr<Denoiser>& denoiser, DenoiserMaker make,
                      const std::shared_ptr<DenoiseImages>& images, StopToken stop);

}  // namespace afterglow
