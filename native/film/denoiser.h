// SPDX-License-Identifier: GPL-3.0-or-later
// Filters of finished images behind one interface: OpenImageDenoise, found at run time in whatever copy the host has
// mapped or the package brings, and the engine's own filters to come.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "base/cancel.h"
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
  bool prefilter = false;  // albedo and normal are filtered by themselves first, then taken as clean
  StopToken stop{};        // asked between the filter's layers: Cancelled
};

class Denoiser {
 public:
  virtual ~Denoiser() = default;
  /// output may be color. Non-finite values are replaced by their neighbours' mean first; returns how many there were.
  /// Throws Error with the library's own text. Keep the Denoiser between frames: its first call sets up the filter.
  virtual uint64_t filter(const DenoiseInput&, float* output) = 0;
  /// Gives memory back that only another image of the same size would need, where it is much.
  virtual void rest() {}
};

/// search: folders or files to look at after what the process has mapped already and before the system's libraries.
std::vector<DenoiserInfo> list_denoisers(const std::vector<std::string>& search);
/// id "AUTO": the first that is available. Throws Unsupported with the reason.
std::unique_ptr<Denoiser> make_denoiser(const std::string& id, const std::vector<std::string>& search);
/// The same, but one that an earlier borrower set up and gave back where there is one; for one borrower at a time.
std::shared_ptr<Denoiser> borrow_denoiser(const std::string& id, const std::vector<std::string>& search);

}  // namespace afterglow
