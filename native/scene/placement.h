// SPDX-License-Identifier: GPL-3.0-or-later
// Pure functions about where things are: whether a transform can be used, its 32-bit form relative to an origin, and
// which origin a scene takes so that single precision is enough at any place and size.
#pragma once

#include "base/math.h"

namespace afterglow {

/// A box in 64-bit world space.
struct DBox {
  DVec3 lower{std::numeric_limits<double>::infinity()}, upper{-std::numeric_limits<double>::infinity()};
  void extend(const DBox& b) { lower = glm::min(lower, b.lower), upper = glm::max(upper, b.upper); }
  bool empty() const { return !(lower.x <= upper.x); }
};

/// Finite, invertible, and so in single precision too. Unequal scale (1, 1, 1e-6) is fine, (1, 1, 0) is not.
bool usable_transform(const DMat4&);
/// The 32-bit transform to coordinates relative to `origin`, and its inverse, both computed in 64 bits.
Affine relative_to(const DMat4&, const DVec3& origin);
Affine relative_from(const DMat4&, const DVec3& origin);
bool is_mirrored(const DMat4&);
/// The box around the transformed box; empty for an empty one.
DBox transformed(const Box&, const DMat4&);

/// 0 while the bounds' centre is within 16 radii of it; else the centre, snapped to a grid of a power of two near the
/// radius, so that small edits seldom change it. A function of the bounds alone: history does not matter.
DVec3 choose_origin(const DBox& bounds);

}  // namespace afterglow
