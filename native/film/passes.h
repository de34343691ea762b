// SPDX-License-Identifier: GPL-3.0-or-later
// The passes that a film can keep: names, channels, and how each is accumulated. The meaning of every pass follows
// Blender's own renderer, so that a compositor set-up gives the same picture.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace afterglow {

enum class Pass : uint8_t {
  kCombined,
  kDepth,
  kMist,
  kPosition,
  kNormal,
  kUv,
  kObjectIndex,
  kMaterialIndex,
  kDiffuseDirect,
  kDiffuseIndirect,
  kDiffuseColor,
  kGlossyDirect,
  kGlossyIndirect,
  kGlossyColor,
  kTransmissionDirect,
  kTransmissionIndirect,
  kTransmissionColor,
  kEmission,
  kEnvironment,
  kAlbedo,
  kDenoiseNormal,
  kDenoiseSurface,
  kSampleCount,
  kError,
  kBatches,
};
inline constexpr int kPassCount = 25;
inline constexpr int kBatchCount = 16;

using PassSet = uint32_t;
constexpr PassSet bit(Pass p) { return 1u << uint32_t(p); }
constexpr PassSet bits(Pass first, Pass last) { return (bit(last) << 1) - bit(first); }

/// What every film keeps without being asked.
inline constexpr PassSet kAlwaysKept =
    bit(Pass::kCombined) | bit(Pass::kSampleCount) | bit(Pass::kError) | bit(Pass::kBatches);
inline constexpr PassSet kLightPasses = bits(Pass::kDiffuseDirect, Pass::kEnvironment);
inline constexpr PassSet kColorPasses =
    bit(Pass::kDiffuseColor) | bit(Pass::kGlossyColor) | bit(Pass::kTransmissionColor);
inline constexpr PassSet kDenoisePasses = bit(Pass::kAlbedo) | bit(Pass::kDenoiseNormal);
/// Of denoise_surface, sums over the samples: of the first surface that is neither mirror nor glass, and light that was
/// met at emitters and in the sky behind mirrors and glass, before or on it.
inline constexpr int kSurfacePosition = 0, kSurfaceFootprint = 3, kSurfaceSegment = 4, kSurfaceMet = 5,
                     kSurfaceAlbedo = 6, kSurfaceMirrored = 9, kSurfaceFloats = 12;
/// Taken at the first surface, from the first sample alone or as a mean.
inline constexpr PassSet kDataPasses = bits(Pass::kDepth, Pass::kMaterialIndex);

struct PassInfo {
  const char* name;
  uint8_t channels;  // as read; Combined holds alpha, UV a third channel that is 1 on surfaces
};
const PassInfo& pass_info(Pass);
Pass pass_by_name(const std::string&);  // throws InvalidInput with the list of names
std::vector<std::string> pass_names(PassSet);

}  // namespace afterglow
