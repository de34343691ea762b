// SPDX-License-Identifier: GPL-3.0-or-later
// Filters of finished images behind one interface: OpenImageDenoise, found at run time in whatever copy the host has
// mapped or the package brings, and the engine's own layered filter, which is always there.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "base/cancel.h"
#include "base/math.h"
#include "film/passes.h"

namespace afterglow {

struct DenoiserInfo {
  std::string id, label, reason, path, version;  // reason: why it is not available
  bool available = false;
};

/// Interleaved float RGB images of one size, row order as the caller's; all but color may be null where the denoiser
/// does without.
struct DenoiseInput {
  const float* color = nullptr;
  const float* albedo = nullptr;
  const float* normal = nullptr;
  // For the layered filter: the pass denoise_surface (kSurfaceFloats a pixel), how far each pixel may be off, relative
  // (one float), and light that no surface scatters, which stays as it is (null: none).
  const float* surface = nullptr;
  const float* error = nullptr;
  const float* seen = nullptr;
  uint32_t width = 0, height = 0;
  bool hdr = true, fast = false, clean_auxiliary = false;
  bool prefilter = false;  // albedo and normal are filtered by themselves first, then taken as clean
  StopToken stop{};        // asked between the filter's layers: Cancelled
  unsigned threads = 0;    // 0: all
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
inline constexpr const char* kLayeredId = "LAYERED";
/// What "AUTO" stands for here: the first that is available. Any other id stays.
std::string chosen_denoiser(const std::string& id, const std::vector<std::string>& search);
/// The passes that a film must keep for a chosen denoiser.
PassSet denoise_passes(const std::string& chosen);
/// Throws Unsupported with the reason.
std::unique_ptr<Denoiser> make_denoiser(const std::string& id, const std::vector<std::string>& search);
/// The same, but one that an earlier borrower set up and gave back where there is one; for one borrower at a time.
std::shared_ptr<Denoiser> borrow_denoiser(const std::string& id, const std::vector<std::string>& search);

}  // namespace afterglow
