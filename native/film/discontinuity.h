// SPDX-License-Identifier: GPL-3.0-or-later
// The discontinuity buffer (Wald et al. 2002, "Interactive Global Illumination using Fast Ray Tracing"): pixels that
// asked different parts of the lights share their answers with neighbours that lie on the same smooth surface.
// Irradiance is shared, not light: textures stay sharp.
#pragma once

#include <span>

#include "base/cancel.h"
#include "base/math.h"

namespace afterglow {

struct SharedIrradiance {
  Vec3 position{0.0f}, normal{0.0f};
  float footprint = 0.0f;  // of a pixel on the surface
  Rgb irradiance{0.0f};
  bool present = false;
};

/// Whether two neighbours lie on the same surface: normals within some 25 degrees, positions near each other's planes.
bool same_surface(const SharedIrradiance&, const SharedIrradiance&);

/// Means over the (2 radius + 1)² neighbours of each pixel of a width × height grid; out has the same size.
void filter_discontinuities(std::span<const SharedIrradiance>, uint32_t width, uint32_t height, int radius,
                            std::span<Rgb> out, unsigned threads, StopToken stop);

}  // namespace afterglow
