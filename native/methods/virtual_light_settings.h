// SPDX-License-Identifier: GPL-3.0-or-later
// Settings of the methods that shine with virtual point lights, and what lengths they mean in a scene.
#pragma once

#include "methods/method.h"
#include "transport/virtual_lights.h"

namespace afterglow {

struct VirtualLightSettings {
  static constexpr uint32_t kMostShortRays = 1024;
  uint32_t count = 256, pattern = 0;
  float bound = 2.0f;
  bool interleave = true;
  uint32_t short_rays = 0;  // that gather what the bound cuts away

  void configure(const Settings&);
  static void describe(std::vector<SettingDescription>&);
  VirtualLightOptions options(const WalkLimits&, uint32_t threads) const;
  /// The bounding distance of (2): `bound` times the scene's radius over the square root of the number of lights, so
  /// that more lights lose less light. The radius is at most four times that of the lights: a wide ground or a thing
  /// far away takes no light from a room.
  float bound_length(const Box& bounds, const std::vector<VirtualLight>& lights) const;
};

}  // namespace afterglow
