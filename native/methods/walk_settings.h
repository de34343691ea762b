// SPDX-License-Identifier: GPL-3.0-or-later
// What all methods read from the settings in the same way: bounce limits as Blender's users know them, clamping.
#pragma once

#include "methods/method.h"
#include "transport/path_state.h"

namespace afterglow {

int64_t integer_of(const SettingValue&);
double number_of(const SettingValue&);

struct WalkSettings {
  WalkLimits limits;
  float clamp_direct = kInfinity, clamp_indirect = kInfinity;  // on the sum of the channels
  /// Takes what it knows; what is not named is as it is by default.
  void configure(const Settings&);
};

}  // namespace afterglow
