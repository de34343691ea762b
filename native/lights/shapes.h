// SPDX-License-Identifier: GPL-3.0-or-later
// Ways to choose a direction towards a simple shape and the solid-angle density of each way: cones (a sphere seen from
// outside), disks, rectangles (Ureña, Fajardo and King 2013, "An Area-Preserving Parametrization for Spherical
// Rectangles"), triangles (Arvo 1995, "Stratified Sampling of Spherical Triangles"). Pure functions; no light, no
// scene.
#pragma once

#include "base/math.h"

namespace afterglow {

/// Concentric map of [0,1)² to the unit disk (Shirley and Chiu 1997).
Vec2 square_to_disk(const Vec2& u);
Vec3 square_to_sphere(const Vec2& u);
Vec3 square_to_cosine_hemisphere(const Vec2& u);  // around +z
/// A cone around +z, by 1 − cos of its half angle, so that tiny cones keep their precision.
Vec3 square_to_cone(const Vec2& u, float one_minus_cos);
/// 1 − cos of the half angle whose squared sine is given.
inline float one_minus_cos_of(float sine_squared) { return sine_squared / (1.0f + std::sqrt(1.0f - sine_squared)); }
inline float cone_density(float one_minus_cos) { return 1.0f / (2.0f * kPi * one_minus_cos); }

/// Solid angle over area at distance d along `direction` (unit) to a surface with unit normal `normal`; infinite edge
/// on.
inline float area_to_solid_angle(float area_density, float distance_squared, float abs_cosine) {
  return area_density * distance_squared / abs_cosine;
}

/// A point on a shape and the density of the direction to it; density 0: nothing to be seen from here.
struct ShapeSample {
  Vec3 point{0.0f};
  float density = 0.0f;
  Vec2 parameter{0.0f};  // rectangle: in its edges; triangle: barycentric
};

/// Spherical rectangle over corner, corner + edge_u, … (edges at right angles), as seen from `from`.
class RectangleView {
 public:
  RectangleView(const Vec3& from, const Vec3& corner, const Vec3& edge_u, const Vec3& edge_v);
  float solid_angle() const { return solid_angle_; }
  /// Too small or too flat a view for the formulas in single precision: sample the area instead.
  bool usable() const { return usable_; }
  Vec2 sample(const Vec2& u) const;  // in units of the edges
  Vec2 invert(const Vec2& point) const;

 private:
  float length_u_, length_v_, x0_, x1_, y0_, y1_, z0_, b0_, b1_, k_, solid_angle_ = 0.0f;
  bool usable_ = false;
};

/// A density over the unit square that is bilinear between its corners' weights, for cosines that vary over a shape.
class CosineWarp {
 public:
  CosineWarp() = default;
  /// Weights at (0,0), (1,0), (0,1), (1,1). Raised above zero, so that no part of the square is lost.
  CosineWarp(float w00, float w10, float w01, float w11);
  bool flat() const { return flat_; }
  Vec2 sample(const Vec2& u, float& density) const;
  float density(const Vec2& point) const;

 private:
  float w_[4] = {1, 1, 1, 1};
  bool flat_ = true;
};

/// Solid angle of a triangle seen from the origin (van Oosterom and Strackee 1983).
float triangle_solid_angle(const Vec3& a, const Vec3& b, const Vec3& c);

/// Triangles between these solid angles are sampled by solid angle, others by area: below, single precision fails and
/// nothing is gained; above, the point lies in the triangle's plane.
inline constexpr float kMinTriangleAngle = 3e-4f, kMaxTriangleAngle = 6.22f;

/// Barycentric weights of the second and third corner of a direction that is uniform over the spherical triangle.
Vec2 sample_spherical_triangle(const Vec3& a, const Vec3& b, const Vec3& c, const Vec2& u);

/// Nearest intersection in (t_min, t_max) with a sphere; 0: none. Steady for spheres that are far and small.
float intersect_sphere(const Vec3& origin, const Vec3& direction, const Vec3& center, float radius, float t_min,
                       float t_max);

}  // namespace afterglow
