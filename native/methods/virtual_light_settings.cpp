// SPDX-License-Identifier: GPL-3.0-or-later
// Settings of virtual point lights: see virtual_light_settings.h.
#include "methods/virtual_light_settings.h"

#include <algorithm>

#include "methods/walk_settings.h"

namespace afterglow {

namespace {

constexpr float kMostReaches = 4.0f;  // rooms, halls and gardens have balls of 1.5 to 3 reaches

float middle(std::vector<float>& values, float share) {
  const auto at = values.begin() + std::ptrdiff_t(share * float(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// Within which three of four lights stand around the middle of all.
float reach_of(const std::vector<VirtualLight>& lights) {
  std::vector<float> values;
  Vec3 center(0.0f);
  for (int axis = 0; axis < 3; ++axis) {
    values.clear();
    for (const VirtualLight& light : lights)
      if (light.alive) values.push_back(light.position[axis]);
    if (values.empty()) return 0.0f;
    center[axis] = middle(values, 0.5f);
  }
  values.clear();
  for (const VirtualLight& light : lights)
    if (light.alive) values.push_back(glm::distance(light.position, center));
  return middle(values, 0.75f);
}

}  // namespace

void VirtualLightSettings::configure(const Settings& settings) {
  *this = {};
  for (const auto& [name, value] : settings) {
    if (name == "virtual_lights") count = uint32_t(std::clamp<int64_t>(integer_of(value), 1, 1 << 20));
    if (name == "light_pattern") pattern = uint32_t(integer_of(value));
    if (name == "light_bound") bound = std::max(float(number_of(value)), 0.0f);
    if (name == "light_compensation") short_rays = uint32_t(std::clamp<int64_t>(integer_of(value), 0, kMostShortRays));
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

float VirtualLightSettings::bound_length(const Box& bounds, const std::vector<VirtualLight>& lights) const {
  Vec3 center;
  float radius;
  LightEmission::surrounding_ball(bounds, center, radius);
  const float reach = kMostReaches * reach_of(lights);
  // In steps, so that a light that moves a little moves no bound.
  if (reach > 0.0f && reach < radius) radius = std::min(radius, std::exp2(std::ceil(4.0f * std::log2(reach)) * 0.25f));
  return bound * radius / std::sqrt(float(count));
}

}  // namespace afterglow
