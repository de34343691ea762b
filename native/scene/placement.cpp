// SPDX-License-Identifier: GPL-3.0-or-later
// Transforms and the scene's origin: see placement.h.
#include "scene/placement.h"

#include <glm/matrix.hpp>

namespace afterglow {

namespace {

bool finite(const DMat4& m) {
  for (int column = 0; column < 4; ++column)
    for (int row = 0; row < 3; ++row)
      if (!std::isfinite(m[column][row])) return false;
  return true;
}

Affine narrow(const glm::dmat3& linear, const DVec3& p) { return {linear[0], linear[1], linear[2], p}; }

bool finite(const Affine& a) { return is_finite(a.x) && is_finite(a.y) && is_finite(a.z) && is_finite(a.p); }

}  // namespace

bool usable_transform(const DMat4& m) {
  if (!finite(m)) return false;
  const glm::dmat3 linear(m);
  const double volume = std::abs(glm::determinant(linear));
  const double box = glm::length(linear[0]) * glm::length(linear[1]) * glm::length(linear[2]);
  if (!(box > 0.0) || !std::isfinite(box) || !(volume > 1e-9 * box)) return false;
  const glm::dmat3 inverse = glm::inverse(linear);
  constexpr double largest = 1e18, smallest = 1e-18;  // lengths whose squares single precision still holds
  for (int column = 0; column < 3; ++column) {
    const double length = glm::length(linear[column]), back = glm::length(inverse[column]);
    if (!(length > smallest && length < largest && back > smallest && back < largest)) return false;
  }
  return finite(narrow(linear, DVec3(m[3]))) && finite(narrow(inverse, DVec3(0.0)));
}

Affine relative_to(const DMat4& m, const DVec3& origin) { return narrow(glm::dmat3(m), DVec3(m[3]) - origin); }

Affine relative_from(const DMat4& m, const DVec3& origin) {
  const glm::dmat3 inverse = glm::inverse(glm::dmat3(m));
  return narrow(inverse, inverse * (origin - DVec3(m[3])));
}

bool is_mirrored(const DMat4& m) { return glm::determinant(glm::dmat3(m)) < 0.0; }

DBox transformed(const Box& box, const DMat4& m) {
  DBox out;
  if (box.empty()) return out;
  // Arvo 1990: each entry of the matrix adds its smaller or larger product to either end.
  out.lower = out.upper = DVec3(m[3]);
  for (int column = 0; column < 3; ++column)
    for (int row = 0; row < 3; ++row) {
      const double a = m[column][row] * double(box.lower[column]), b = m[column][row] * double(box.upper[column]);
      out.lower[row] += std::fmin(a, b);
      out.upper[row] += std::fmax(a, b);
    }
  return out;
}

DVec3 choose_origin(const DBox& bounds) {
  if (bounds.empty()) return DVec3(0.0);
  const DVec3 center = 0.5 * (bounds.lower + bounds.upper);
  const double radius = std::fmax(0.5 * glm::length(bounds.upper - bounds.lower), 1e-12 * glm::length(center));
  if (!(glm::length(center) > 16.0 * radius)) return DVec3(0.0);
  const double cell = std::exp2(std::ceil(std::log2(radius)) + 2.0);
  return cell * glm::round(center / cell);
}

}  // namespace afterglow
