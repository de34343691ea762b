// SPDX-License-Identifier: GPL-3.0-or-later
// Camera rays: see camera.h.
#include "lights/camera.h"

#include <algorithm>

namespace afterglow {

namespace {

/// The camera's axes are directions: a scaled camera object sees the same picture.
Affine rigid(const DMat4& m, const DVec3& origin) {
  const auto axis = [&](int column, const DVec3& otherwise) {
    const DVec3 v(m[column]);
    const double length = glm::length(v);
    return Vec3(length > 0.0 && std::isfinite(length) ? v / length : otherwise);
  };
  return {axis(0, {1, 0, 0}), axis(1, {0, 1, 0}), axis(2, {0, 0, 1}), Vec3(DVec3(m[3]) - origin)};
}

/// Area-preserving map of the square to the disk (Shirley and Chiu 1997).
Vec2 to_disk(const Vec2& u) {
  const Vec2 p = 2.0f * u - 1.0f;
  if (p.x == 0.0f && p.y == 0.0f) return p;
  const bool wide = std::fabs(p.x) > std::fabs(p.y);
  const float radius = wide ? p.x : p.y;
  const float angle = wide ? 0.25f * kPi * p.y / p.x : 0.5f * kPi - 0.25f * kPi * p.x / p.y;
  return radius * Vec2(std::cos(angle), std::sin(angle));
}

/// Uniform over a regular polygon with its corners on the unit circle: one of its triangles, then a point of that.
Vec2 to_polygon(Vec2 u, int corners, float rotation) {
  const float scaled = u.x * float(corners);
  const float wedge = std::min(std::floor(scaled), float(corners - 1));
  const float a = std::sqrt(scaled - wedge);
  const float step = 2.0f * kPi / float(corners), first = rotation + step * wedge;
  const Vec2 p(std::cos(first), std::sin(first)), q(std::cos(first + step), std::sin(first + step));
  return a * ((1.0f - u.y) * p + u.y * q);
}

Vec2 lens_point(const Camera& camera, const Vec2& u) {
  Vec2 p = camera.aperture_blades >= 3 ? to_polygon(u, camera.aperture_blades, camera.aperture_rotation) : to_disk(u);
  p.x /= camera.aperture_ratio;
  return camera.aperture_radius * p;
}

/// Longitude grows to the right, 0 is straight ahead; latitude grows upwards.
Vec3 panorama_direction(const Vec4& range, const Vec2& at) {
  const float longitude = range.x + at.x * (range.y - range.x), latitude = range.z + at.y * (range.w - range.z);
  return {std::cos(latitude) * std::sin(longitude), std::sin(latitude), -std::cos(latitude) * std::cos(longitude)};
}

/// Derivative of v / |v| when v changes by dv, for unit n = v / |v|.
Vec3 unit_derivative(const Vec3& n, float length, const Vec3& dv) { return (dv - n * glm::dot(n, dv)) / length; }

}  // namespace

CameraRays::CameraRays(const Camera& camera, const DVec3& origin, uint32_t width, uint32_t height)
    : camera_(camera),
      to_world_(rigid(camera.transform, origin)),
      size_(float(std::max(width, 1u)), float(std::max(height, 1u))) {
  if (!(camera_.aperture_ratio > 0.0f)) camera_.aperture_ratio = 1.0f;
  if (!(camera_.aperture_radius > 0.0f) || !(camera_.focus_distance > 0.0f)) camera_.aperture_radius = 0.0f;
  extent_ = Vec2(camera_.window.y - camera_.window.x, camera_.window.w - camera_.window.z);
  lens_ = camera_.aperture_radius > 0.0f && camera_.kind != CameraKind::kPanorama;
  pinhole_ = !lens_ && camera_.kind == CameraKind::kPerspective;
}

CameraRay CameraRays::ray(const Vec2& pixel, const Vec2& lens) const {
  const Vec2 at = pixel / size_;
  const Vec4& window = camera_.window;
  const Vec2 step = extent_ / size_;
  CameraRay out;
  Vec3 position(0.0f), direction(0, 0, -1), dx(0.0f), dy(0.0f);
  float along_axis = 1.0f;  // cosine between ray and view axis: clipping is a pair of planes
  if (camera_.kind == CameraKind::kPanorama) {
    direction = panorama_direction(camera_.panorama, at);
    dx = panorama_direction(camera_.panorama, at + Vec2(1.0f / size_.x, 0.0f)) - direction;
    dy = panorama_direction(camera_.panorama, at + Vec2(0.0f, 1.0f / size_.y)) - direction;
  } else {
    const Vec2 on_window = Vec2(window.x, window.z) + extent_ * at;
    const bool orthographic = camera_.kind == CameraKind::kOrthographic;
    if (orthographic) {
      position = Vec3(on_window, 0.0f);
      out.origin_dx = to_world_.x * step.x;
      out.origin_dy = to_world_.y * step.y;
    } else {
      const Vec3 v(on_window, -1.0f);
      const float length = glm::length(v);
      direction = v / length;
      dx = unit_derivative(direction, length, {step.x, 0, 0});
      dy = unit_derivative(direction, length, {0, step.y, 0});
    }
    if (lens_) {
      const Vec3 focus = position + direction * (camera_.focus_distance / -direction.z);
      position += Vec3(lens_point(camera_, lens), 0.0f);
      direction = glm::normalize(focus - position);
    }
    along_axis = -direction.z;
  }
  out.ray.origin = to_world_.point(position);
  out.ray.direction = glm::normalize(to_world_.vector(direction));
  out.ray.t_min = camera_.clip.x / along_axis;
  out.ray.t_max = camera_.clip.y / along_axis;
  out.ray.mask = kVisibleCamera;
  out.direction_dx = to_world_.vector(dx);
  out.direction_dy = to_world_.vector(dy);
  return out;
}

float CameraRays::depth(const Vec3& position) const {
  const Vec3 way = position - to_world_.p;
  return camera_.kind == CameraKind::kPanorama ? glm::length(way) : -glm::dot(way, to_world_.z);
}

}  // namespace afterglow
