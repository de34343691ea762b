// SPDX-License-Identifier: GPL-3.0-or-later
// Settings that all methods share: see walk_settings.h.
#include "methods/walk_settings.h"

namespace afterglow {

int64_t integer_of(const SettingValue& value) {
  if (const auto* i = std::get_if<int64_t>(&value)) return *i;
  if (const auto* d = std::get_if<double>(&value)) return int64_t(*d);
  if (const auto* b = std::get_if<bool>(&value)) return *b;
  return 0;
}

double number_of(const SettingValue& value) {
  if (const auto* d = std::get_if<double>(&value)) return *d;
  return double(integer_of(value));
}

void WalkSettings::configure(const Settings& settings) {
  *this = {};
  for (const auto& [name, value] : settings) {
    const auto limit = [&] { return uint32_t(std::max<int64_t>(0, integer_of(value))); };
    const auto clamp = [&] { return number_of(value) > 0.0 ? 3.0f * float(number_of(value)) : kInfinity; };
    if (name == "max_bounces") limits.max_bounces = limit();
    if (name == "diffuse_bounces") limits.diffuse = limit();
    if (name == "glossy_bounces") limits.glossy = limit();
    if (name == "transmission_bounces") limits.transmission = limit();
    if (name == "transparent_max_bounces") limits.transparent = limit();
    if (name == "caustics_reflective") limits.caustics_reflective = integer_of(value) != 0;
    if (name == "caustics_refractive") limits.caustics_refractive = integer_of(value) != 0;
    if (name == "sample_clamp_direct") clamp_direct = clamp();
    if (name == "sample_clamp_indirect") clamp_indirect = clamp();
  }
}

}  // namespace afterglow
