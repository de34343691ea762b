// SPDX-License-Identifier: GPL-3.0-or-later
// Settings of virtual point lights: see virtual_light_settings.h.
#include "methods/virtual_light_settings.h"

#include <algorithm>

#include "methods/walk_settings.h"

namespace afterglow {

void VirtualLightSettings::configure(const Settings& settings) {
  for (const auto& [name, value] : settings) {
    if (name == "virtual_lights") count = uint32_t(std::clamp<int64_t>(integer_of(value), 1, 1 << 20));
    if (name == "light_pattern") pattern = uint32_t(integer_of(value));
    if (name == "light_bound") bound = std::max(float(number_of(value)), 0.0f);
    if (name == "light_compensation") short_rays = uint32_t(std::clamp<int64_t>(integer_of(value), 0, 1024));
    if (name == "interleave") interleave = integer_of(value) != 0;
  }
}

void VirtualLightSettings::describe(std::vector<SettingDescription>& settings) {
  settings.push_back({"virtual_lights", "Virtual Lights", "Lights that stand for bounced light, all bounces together",
                      "", int64_t(256), 1.0, 65536.0});
  settings.push_back(
      {"light_bound", "Bound",
       "How far around a virtual light its light is faded out, against bright spots in corners: 1 is the "
       "mean distance of virtual lights; 0: not at all",
       "", 2.0, 0.0, 16.0});
  settings.push_back({"light_compensation", "Short Rays",
                      "Rays that look for the light that the bound takes away, at each record or pixel (16 to 64 for "
                      "dark corners and thin things); 0: it is left out",
                      "", int64_t(0), 0.0, 1024.0});
  settings.push_back({"light_pattern", "Pattern",
                      "Which points the light paths take; another number, another set of lights", "", int64_t(0), 0.0,
                      2147483647.0});
}

VirtualLightOptions VirtualLightSettings::options(const WalkLimits& limits, uint32_t threads) const {
  return {.count = count,
          .bounces = std::min({limits.diffuse, limits.max_bounces, 64u}),
          .pattern = pattern,
          .threads = threads};
}

float VirtualLightSettings::bound_length(const Box& bounds) const {
  Vec3 center;
  float radius;
  LightEmission::surrounding_ball(bounds, center, radius);
  return bound * radius / std::sqrt(float(count));
}

}  // namespace afterglow
