// SPDX-License-Identifier: GPL-3.0-or-later
// The maps of shapes.h. Rectangles follow the geometry of Ureña et al. 2013 (angles of the spherical quadrilateral,
// then one inversion an axis), triangles that of Arvo 1995 with the vertex formulation of Shirley et al.'s later notes.
#include "lights/shapes.h"

#include <algorithm>

#include "materials/microfacet.h"

namespace afterglow {

namespace {

float safe_sqrt(float x) { return std::sqrt(std::max(x, 0.0f)); }

Vec3 normalized_cross(const Vec3& a, const Vec3& b) {
  const Vec3 c = glm::cross(a, b);
  const float length = glm::length(c);
  return length > 0.0f ? c / length : Vec3(0.0f);
}

/// Angle between unit vectors, exact near 0 and π.
float angle_between(const Vec3& a, const Vec3& b) {
  if (glm::dot(a, b) < 0.0f) return kPi - 2.0f * std::asin(std::min(1.0f, 0.5f * glm::length(a + b)));
  return 2.0f * std::asin(std::min(1.0f, 0.5f * glm::length(a - b)));
}

}  // namespace

Vec2 square_to_disk(const Vec2& u) {
  const float x = 2.0f * u.x - 1.0f, y = 2.0f * u.y - 1.0f;
  if (x == 0.0f && y == 0.0f) return Vec2(0.0f);
  const bool wide = std::fabs(x) > std::fabs(y);
  const float r = wide ? x : y;
  const float angle = wide ? 0.25f * kPi * (y / x) : 0.5f * kPi - 0.25f * kPi * (x / y);
  return r * Vec2(std::cos(angle), std::sin(angle));
}

Vec3 square_to_sphere(const Vec2& u) {
  const float z = 1.0f - 2.0f * u.x, r = safe_sqrt(1.0f - z * z), angle = 2.0f * kPi * u.y;
  return {r * std::cos(angle), r * std::sin(angle), z};
}

Vec3 square_to_cosine_hemisphere(const Vec2& u) {
  const Vec2 d = square_to_disk(u);
  return {d.x, d.y, safe_sqrt(1.0f - d.x * d.x - d.y * d.y)};
}

Vec3 square_to_cone(const Vec2& u, float one_minus_cos) {
  const Vec2 d = square_to_disk(u);
  const float r2 = d.x * d.x + d.y * d.y, h = one_minus_cos * r2;  // 1 − cos θ, uniform in [0, one_minus_cos)
  const float scale = safe_sqrt(one_minus_cos * (2.0f - h));       // sin θ / r
  return {d.x * scale, d.y * scale, 1.0f - h};
}

namespace {

using Four = float __attribute__((vector_size(16)));
using FourBits = int32_t __attribute__((vector_size(16)));

Four root(Four v) {
  for (int i = 0; i < 4; ++i) v[i] = std::sqrt(v[i]);
  return v;
}

/// Arc cosines of four values within 1e-7: √(1 − x) times a polynomial (Hastings 1955).
Four arc_cosine(Four x) {
  const Four zero = {}, one = zero + 1.0f;
  const FourBits negative = x < zero;
  const Four m = negative ? -x : x, y = m < one ? m : one;
  Four p = zero - 0.0012624911f;
  for (const float c :
       {0.0066700901f, -0.0170881256f, 0.0308918810f, -0.0501743046f, 0.0889789874f, -0.2145988016f, 1.5707963050f})
    p = p * y + c;
  p *= root(one - y);
  return negative ? kPi - p : p;
}

}  // namespace

RectangleView::RectangleView(const Vec3& from, const Vec3& corner, const Vec3& edge_u, const Vec3& edge_v)
    : length_u_(glm::length(edge_u)), length_v_(glm::length(edge_v)) {
  const Vec3 x = edge_u / length_u_, y = edge_v / length_v_, z = glm::cross(x, y), d = corner - from;
  x0_ = glm::dot(d, x), y0_ = glm::dot(d, y);
  x1_ = x0_ + length_u_, y1_ = y0_ + length_v_;
  z0_ = -std::fabs(glm::dot(d, z));
  const float size2 = length_u_ * length_u_ + length_v_ * length_v_;
  const float middle_x = 0.5f * (x0_ + x1_), middle_y = 0.5f * (y0_ + y1_);
  // Far rectangles are sampled by area: nearly as even there, and cheaper.
  if (8.0f * size2 < middle_x * middle_x + middle_y * middle_y + z0_ * z0_) return;
  // Normals of the four planes through the point and an edge; only their z matters for the angles.
  const Four at = {y0_, x1_, y1_, x0_}, n = Four{-y0_, x1_, y1_, -x0_} / root(z0_ * z0_ + at * at);
  const Four g = arc_cosine(-n * __builtin_shuffle(n, FourBits{1, 2, 3, 0}));
  b0_ = n[0], b1_ = n[2];
  k_ = 2.0f * kPi - g[2] - g[3];
  solid_angle_ = g[0] + g[1] - k_;
  usable_ = solid_angle_ > 1e-3f && z0_ * z0_ > 1e-6f * size2 && std::isfinite(solid_angle_);
}

Vec2 RectangleView::sample(const Vec2& u) const {
  const Vec2 around = sincos_turns((u.x * solid_angle_ + k_) * (0.5f * kInvPi));
  const float sine = around.x;
  const float fu = (around.y * b0_ - b1_) / (std::fabs(sine) > 1e-12f ? sine : 1e-12f);
  const float cu = std::clamp(std::copysign(1.0f / std::sqrt(fu * fu + b0_ * b0_), fu), -1.0f, 1.0f);
  const float xu = std::clamp(-(cu * z0_) / std::max(safe_sqrt(1.0f - cu * cu), 1e-7f), x0_, x1_);
  const float d = std::sqrt(xu * xu + z0_ * z0_);
  const float h0 = y0_ / std::sqrt(d * d + y0_ * y0_), h1 = y1_ / std::sqrt(d * d + y1_ * y1_);
  const float hv = h0 + u.y * (h1 - h0), hv2 = hv * hv;
  const float yv = hv2 < 1.0f - 1e-6f ? hv * d / std::sqrt(1.0f - hv2) : y1_;
  return glm::clamp(Vec2((xu - x0_) / length_u_, (yv - y0_) / length_v_), Vec2(0.0f), Vec2(1.0f));
}

Vec2 RectangleView::invert(const Vec2& point) const {
  // Along u: the share of the solid angle that lies before this line. Its part of the angles changes in one normal
  // only.
  const float xu = x0_ + std::clamp(point.x, 0.0f, 1.0f) * length_u_,
              yv = y0_ + std::clamp(point.y, 0.0f, 1.0f) * length_v_;
  const float n1 = xu / std::sqrt(z0_ * z0_ + xu * xu);
  const Four angles = arc_cosine(Four{-b0_ * n1, -n1 * b1_, 0.0f, 0.0f});
  const float before = angles[0] + angles[1] - k_;
  const float d2 = xu * xu + z0_ * z0_;
  const float h0 = y0_ / std::sqrt(d2 + y0_ * y0_), h1 = y1_ / std::sqrt(d2 + y1_ * y1_);
  const float hv = yv / std::sqrt(d2 + yv * yv);
  return glm::clamp(Vec2(before / solid_angle_, (hv - h0) / (h1 - h0)), Vec2(0.0f), Vec2(1.0f));
}

CosineWarp::CosineWarp(float w00, float w10, float w01, float w11) {
  const float most = std::max({w00, w10, w01, w11});
  if (!(most > 0.0f)) return;
  const float least = 0.05f * most;
  const float w[4] = {std::max(w00, least), std::max(w10, least), std::max(w01, least), std::max(w11, least)};
  const float mean = 0.25f * (w[0] + w[1] + w[2] + w[3]);
  for (int i = 0; i < 4; ++i) w_[i] = w[i] / mean;
  flat_ = false;
}

namespace {

/// Inverse of the distribution of a density that is linear from a to b.
float sample_linear(float u, float a, float b) {
  if (std::fabs(a - b) < 1e-4f * (a + b)) return u;
  const float x = u * (a + b) / (a + std::sqrt(a * a + u * (b * b - a * a)));
  return std::min(x, 0x1.fffffep-1f);
}

}  // namespace

Vec2 CosineWarp::sample(const Vec2& u, float& density_at) const {
  density_at = 1.0f;
  if (flat_) return u;
  const float y = sample_linear(u.y, w_[0] + w_[1], w_[2] + w_[3]);
  const float x = sample_linear(u.x, w_[0] + y * (w_[2] - w_[0]), w_[1] + y * (w_[3] - w_[1]));
  const Vec2 p(x, y);
  density_at = density(p);
  return p;
}

float CosineWarp::density(const Vec2& p) const {
  return (1.0f - p.y) * ((1.0f - p.x) * w_[0] + p.x * w_[1]) + p.y * ((1.0f - p.x) * w_[2] + p.x * w_[3]);
}

float triangle_solid_angle(const Vec3& a, const Vec3& b, const Vec3& c) {
  const float la = glm::length(a), lb = glm::length(b), lc = glm::length(c);
  const float numerator = std::fabs(glm::dot(a, glm::cross(b - a, c - a)));
  const float denominator = la * lb * lc + glm::dot(a, b) * lc + glm::dot(a, c) * lb + glm::dot(b, c) * la;
  return 2.0f * std::atan2(numerator, denominator);
}

Vec2 sample_spherical_triangle(const Vec3& va, const Vec3& vb, const Vec3& vc, const Vec2& u) {
  const Vec3 a = glm::normalize(va), b = glm::normalize(vb), c = glm::normalize(vc);
  const Vec3 n_ab = normalized_cross(a, b), n_bc = normalized_cross(b, c), n_ca = normalized_cross(c, a);
  const float alpha = angle_between(n_ab, -n_ca), beta = angle_between(n_bc, -n_ab), gamma = angle_between(n_ca, -n_bc);
  const float sub_area = u.x * (alpha + beta + gamma - kPi);  // of the triangle a, b, c' to be cut off
  // The cut triangle's third corner c' lies on the arc from a to c.
  const float s = std::sin(sub_area - alpha), t = std::cos(sub_area - alpha);
  const float cos_alpha = std::cos(alpha), sin_alpha = std::sin(alpha), cos_c = glm::dot(a, b);
  const float uu = t - cos_alpha, vv = s + sin_alpha * cos_c;
  const float denominator = (vv * s + uu * t) * sin_alpha;
  const float q =
      std::clamp(((vv * t - uu * s) * cos_alpha - vv) / (denominator != 0.0f ? denominator : 1e-20f), -1.0f, 1.0f);
  const Vec3 to_c = c - glm::dot(c, a) * a;
  const float to_c_length = glm::length(to_c);
  const Vec3 cut = q * a + safe_sqrt(1.0f - q * q) * (to_c_length > 0.0f ? to_c / to_c_length : Vec3(0.0f));
  // Then a point on the arc from b to c', uniform in the cosine.
  const float one_minus = u.y * (1.0f - glm::dot(cut, b)), z = 1.0f - one_minus;
  const Vec3 to_cut = cut - glm::dot(cut, b) * b;
  const float to_cut_length = glm::length(to_cut);
  const Vec3 w =
      z * b + safe_sqrt(one_minus * (1.0f + z)) * (to_cut_length > 0.0f ? to_cut / to_cut_length : Vec3(0.0f));
  // Where the ray along w meets the triangle.
  const Vec3 e1 = vb - va, e2 = vc - va, p = glm::cross(w, e2);
  const float determinant = glm::dot(e1, p);
  const float inverse = determinant != 0.0f ? 1.0f / determinant : 0.0f;
  float b1 = glm::dot(-va, p) * inverse, b2 = glm::dot(w, glm::cross(-va, e1)) * inverse;
  if (!std::isfinite(b1) || !std::isfinite(b2)) b1 = b2 = 1.0f / 3.0f;
  b1 = std::clamp(b1, 0.0f, 1.0f), b2 = std::clamp(b2, 0.0f, 1.0f);
  if (b1 + b2 > 1.0f) {
    const float sum = b1 + b2;
    b1 /= sum, b2 /= sum;
  }
  return {b1, b2};
}

float intersect_sphere(const Vec3& origin, const Vec3& direction, const Vec3& center, float radius, float t_min,
                       float t_max) {
  const Vec3 to_center = center - origin;
  const float along = glm::dot(to_center, direction);
  const Vec3 across = to_center - along * direction;
  const float half2 = radius * radius - glm::dot(across, across);
  if (!(half2 >= 0.0f)) return 0.0f;
  const float half = std::sqrt(half2);
  // The root of larger magnitude first, the other by Vieta's product: no cancellation.
  const float far_root = along + std::copysign(half, along);
  const float product = glm::dot(to_center, to_center) - radius * radius;
  const float near_root = far_root != 0.0f ? product / far_root : 0.0f;
  const float first = std::min(far_root, near_root), second = std::max(far_root, near_root);
  if (first > t_min && first < t_max) return first;
  if (second > t_min && second < t_max) return second;
  return 0.0f;
}

}  // namespace afterglow
