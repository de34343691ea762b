// SPDX-License-Identifier: GPL-3.0-or-later
// Colour models as Blender's nodes have them: HSV and HSL of scene-linear values, hue in turns.
#pragma once

#include "base/math.h"

namespace afterglow {

Vec3 rgb_to_hsv(const Rgb&);
Rgb hsv_to_rgb(const Vec3&);
Vec3 rgb_to_hsl(const Rgb&);
Rgb hsl_to_rgb(const Vec3&);
/// X, Y and Z of one watt at a wavelength in nanometres (Y peaks at 1).
Vec3 observer(float nanometres);
/// A black body's colour of about unit luminance; kelvin.
Rgb blackbody(float kelvin);
/// The colour of light of one wavelength, in nanometres.
Rgb wavelength(float nanometres);

}  // namespace afterglow
