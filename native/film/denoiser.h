// SPDX-License-Identifier: GPL-3.0-or-later
// Filters of finished images behind one interface: OpenImageDenoise, found at run time in whatever copy the host has
// mapped or the package brings, and the engine's own filters to come.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "base/math.h"

namespace afterglow {

struct DenoiserInfo {
  std::string id, label, reason, path, version;  // reason: why it is not available
  bool available = false;
};

/// Interleaved float RGB images of one size, row order as the caller's; albedo and normal may be null.
struct DenoiseInput {
  const float* color = nullptr;
  const float* albedo = nullptr;
  const float* normal = nullptr;
  uint32_t width = 0, height = 0;
  bool hdr = true, fast = false, clean_auxiliary = false;
};

class Denoiser {
 public:
  virtual ~Denoiser() = default;
  virtual void filter(const DenoiseInput&, float* output) = 0;  // throws Error with the library's own text
};

std::vector<DenoiserInfo> list_denoisers(const std::vector<std::string>& search);
std::unique_ptr<Denoiser> make_denoiser(const std::string& id, const std::vector<std::string>& search);  // Unsupported

}  // namespace afterglow
