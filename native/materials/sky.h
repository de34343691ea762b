// SPDX-License-Identifier: GPL-3.0-or-later
// Clear skies over a direction: the analytic daylight of Preetham, Shirley and Smits 1999, and an atmosphere in which
// light scatters once (Nishita et al. 1993), tabulated when the program is made.
#pragma once

#include <vector>

#include "materials/program.h"

namespace afterglow {

/// Parameters of a Preetham sky: sun's polar angles, then three sets of zenith value and five coefficients (20
/// numbers).
std::vector<float> preetham_parameters(const Vec3& sun, float turbidity);

struct Atmosphere {
  float sun_elevation = 0.26f, sun_rotation = 0.0f, sun_size = 0.0095f, sun_intensity = 1.0f, altitude = 0.0f;
  float air = 1.0f, dust = 1.0f, ozone = 1.0f;
  bool disc = true;
};
/// A table of scattered light by elevation and azimuth, the sun's own radiance, and what is needed to look them up.
std::vector<float> atmosphere_parameters(const Atmosphere&);

/// in: kind (0 Preetham, 1 atmosphere), then its parameters.
Vec3 run_sky(const Vec3& direction, const Operands& in);

}  // namespace afterglow
