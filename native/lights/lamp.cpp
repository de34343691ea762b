// SPDX-License-Identifier: GPL-3.0-or-later
// Light objects: their units, shapes and attenuations follow what Blender's users see in Cycles (measured there), the
// sampling is by solid angle wherever a closed form exists (shapes.h).
#include "lights/lamp.h"

#include <algorithm>

namespace afterglow {

namespace {

bool finite(const DMat4& m) {
  for (int c = 0; c < 4; ++c)
    for (int r = 0; r < 4; ++r)
      if (!std::isfinite(m[c][r])) return false;
  return true;
}

Vec3 normalized_or(const DVec3& v, const Vec3& otherwise) {
  const double length = glm::length(v);
  return length > 0.0 ? Vec3(v / length) : otherwise;
}

/// Share of the light that a spot sends this way: a smooth step in the cosine to its axis, in the object's own space,
/// so that an uneven scale makes the cone elliptic.
float spot_attenuation(const Lamp& lamp, const Vec3& from_lamp) {
  if (lamp.legacy) {
    const float cosine = glm::dot(from_lamp, lamp.axis);
    const float t = std::clamp((cosine - lamp.cos_spot) * lamp.inverse_blend, 0.0f, 1.0f);
    return std::max(cosine, 0.0f) * t * t * (3.0f - 2.0f * t);
  }
  const Vec3 local = lamp_local(lamp, from_lamp);
  const float x = std::clamp((-local.z - lamp.cos_spot) * lamp.inverse_blend, 0.0f, 1.0f);
  return x * x * (3.0f - 2.0f * x);
}

/// What a grid of slats before an area light lets through: falls linearly in the tangent, keeps the whole power.
float spread_attenuation(const Lamp& lamp, const Vec3& direction, float cosine) {
  const float tangent = glm::length(glm::cross(direction, lamp.axis)) / cosine;
  return std::max(lamp.tan_half_spread - tangent, 0.0f) * lamp.spread_scale;
}

Rgb attenuated(const Lamp& lamp, const Vec3& from_lamp, bool inside) {
  return lamp.spot && !inside ? lamp.radiance * spot_attenuation(lamp, from_lamp) : lamp.radiance;
}

bool make_point(const Light& light, bool spot, Lamp& lamp) {
  const double radius = light.radius;
  const double intensity = light.power / (4.0 * M_PI);
  lamp.radius = light.radius;
  if (radius > 0.0) {
    lamp.shape = light.soft_falloff ? LampShape::kDisk : LampShape::kSphere;
    lamp.area = float(M_PI * radius * radius);
    lamp.radiance = light.color * float(intensity / (M_PI * radius * radius));
    lamp.hittable = light.multiple_importance;
  } else {
    lamp.shape = LampShape::kPoint;
    lamp.radiance = light.color * float(intensity);
  }
  if (!spot) return true;
  lamp.spot = true;
  const double half = 0.5 * std::clamp(double(light.spot_size), 0.0, 2.0 * M_PI);
  const double open = (1.0 - std::cos(half)) * std::clamp(double(light.spot_blend), 0.0, 1.0);
  lamp.cos_spot = float(std::cos(half));
  lamp.inverse_blend = float(1.0 / std::max(open, 1e-7));
  return half > 0.0;
}

bool make_area(const Light& light, const DMat4& m, Lamp& lamp) {
  const bool round = light.shape == AreaShape::kDisk || light.shape == AreaShape::kEllipse;
  const bool even = light.shape == AreaShape::kDisk || light.shape == AreaShape::kSquare;
  const DVec3 u = DVec3(m[0]) * double(light.size.x), v = DVec3(m[1]) * double(even ? light.size.x : light.size.y);
  const double area = glm::length(glm::cross(u, v)) * (round ? 0.25 * M_PI : 1.0);
  if (!(area > 0.0)) return false;
  lamp.shape = round ? LampShape::kEllipse : LampShape::kRectangle;
  lamp.edge_u = Vec3(u), lamp.edge_v = Vec3(v);
  lamp.orthogonal = std::fabs(glm::dot(u, v)) < 1e-6 * glm::length(u) * glm::length(v);
  const DVec3 plane = glm::normalize(glm::cross(u, v));
  lamp.axis = Vec3(glm::dot(plane, DVec3(m[2])) < 0.0 ? plane : -plane);  // exact normal of the two edges
  lamp.area = float(area);
  lamp.radiance = light.color * float(light.power / (M_PI * area));
  lamp.hittable = light.multiple_importance;
  const double half = 0.5 * std::clamp(double(light.spread), 0.0, M_PI);
  if (half < 0.5 * M_PI - 1e-4) {
    // Below half a degree the beam is as good as parallel; a true delta beam could not be sampled.
    const double angle = std::max(half, 0.004);
    lamp.spread = true;
    lamp.tan_half_spread = float(std::tan(angle));
    lamp.spread_scale = float(angle > 0.05 ? 1.0 / (std::tan(angle) - angle)
                                           : 3.0 / (angle * angle * angle * (1.0 + 0.4 * angle * angle)));
  }
  return lamp.area > 0.0f && std::isfinite(lamp.area);
}

bool make_sun(const Light& light, Lamp& lamp) {
  const double half = 0.5 * std::clamp(double(light.angle), 0.0, M_PI), sine = std::sin(half);
  lamp.one_minus_cos = float(2.0 * std::pow(std::sin(0.5 * half), 2.0));
  lamp.shape = lamp.one_minus_cos > 1e-12f ? LampShape::kCone : LampShape::kDirection;
  const bool cone = lamp.shape == LampShape::kCone;
  // The share of a unit disk's irradiance, or the flat disk's area.
  const double share = light.version == 1 ? std::pow(std::tan(std::min(half, 1.5706)), 2.0) : sine * sine;
  lamp.radiance = light.color * float(cone ? light.power / (M_PI * share) : double(light.power));
  lamp.hittable = cone && light.multiple_importance;
  return true;
}

float hit_uv(const Vec3& offset, const Vec3& edge) { return glm::dot(offset, edge) / glm::dot(edge, edge); }

/// A point of the light's plane, relative to its centre, in units of its edges.
Vec2 in_edges(const Lamp& lamp, const Vec3& offset) {
  if (lamp.orthogonal) return {hit_uv(offset, lamp.edge_u), hit_uv(offset, lamp.edge_v)};
  const Vec3 n = glm::cross(lamp.edge_u, lamp.edge_v);  // sheared: solve for both edges together
  const float inverse = 1.0f / glm::dot(n, n);
  return {glm::dot(glm::cross(offset, lamp.edge_v), n) * inverse,
          glm::dot(glm::cross(lamp.edge_u, offset), n) * inverse};
}

/// The part of an area light that can send light here, as a share of its edges (0: its centre). A narrow spread leaves
/// only what lies within height · tan of the point's foot; an ellipse is then replaced by that disk, if it is smaller.
struct Window {
  Vec2 lower{-0.5f}, upper{0.5f};
  bool disk = false;
  Vec3 foot{0.0f};  // of the point in the light's plane, relative to the light's centre
  float disk_radius = 0.0f;
  float area = 0.0f;
};

bool visible_window(const Lamp& lamp, const Vec3& to_center, float height, Window& w) {
  w.area = lamp.area;
  if (!lamp.spread) return true;
  const float reach = height * lamp.tan_half_spread;
  w.foot = -to_center - lamp.axis * height;
  if (lamp.shape == LampShape::kEllipse) {
    const float disk_area = kPi * reach * reach;
    if (disk_area < lamp.area) w.disk = true, w.disk_radius = reach, w.area = disk_area;
    return true;
  }
  if (!lamp.orthogonal) return true;
  const Vec2 foot(hit_uv(w.foot, lamp.edge_u), hit_uv(w.foot, lamp.edge_v));
  const Vec2 extent(reach / glm::length(lamp.edge_u), reach / glm::length(lamp.edge_v));
  w.lower = glm::max(Vec2(-0.5f), foot - extent), w.upper = glm::min(Vec2(0.5f), foot + extent);
  const Vec2 size = w.upper - w.lower;
  w.area = lamp.area * size.x * size.y;
  return size.x > 0.0f && size.y > 0.0f && w.area > 0.0f;
}

RectangleView rectangle_view(const Lamp& lamp, const Vec3& position, const Window& w) {
  const Vec3 corner = lamp.position + w.lower.x * lamp.edge_u + w.lower.y * lamp.edge_v;
  const Vec2 size = w.upper - w.lower;
  return {position, corner, size.x * lamp.edge_u, size.y * lamp.edge_v};
}

bool sample_area(const Lamp& lamp, const Vec3& position, const Vec2& u, LampSample& out) {
  const Vec3 to_center = lamp.position - position;
  const float height = -glm::dot(to_center, lamp.axis);  // one-sided
  Window window;
  if (!(height > 0.0f) || !visible_window(lamp, to_center, height, window)) return false;
  Vec3 to_point;
  if (lamp.shape == LampShape::kEllipse) {
    const Vec2 d = square_to_disk(u);
    if (window.disk) {
      const Frame frame(lamp.axis);
      const Vec3 offset = window.foot + (d.x * frame.t + d.y * frame.b) * window.disk_radius;
      const Vec2 p = in_edges(lamp, offset);
      if (glm::dot(p, p) > 0.25f) return false;
      to_point = to_center + offset, out.uv = p + 0.5f;
    } else {
      to_point = to_center + 0.5f * (d.x * lamp.edge_u + d.y * lamp.edge_v), out.uv = 0.5f * d + 0.5f;
    }
  } else {
    Vec2 q = u;
    if (lamp.orthogonal) {
      const RectangleView view = rectangle_view(lamp, position, window);
      if (view.usable()) q = view.sample(u), out.density = 1.0f / view.solid_angle();
    }
    const Vec2 p = window.lower + q * (window.upper - window.lower);
    to_point = to_center + p.x * lamp.edge_u + p.y * lamp.edge_v, out.uv = p + 0.5f;
  }
  const float d2 = glm::dot(to_point, to_point);
  if (!(d2 > 0.0f)) return false;
  out.distance = std::sqrt(d2);
  out.direction = to_point / out.distance;
  const float cosine = -glm::dot(out.direction, lamp.axis);
  if (!(cosine > 0.0f)) return false;
  if (out.density == 0.0f) out.density = area_to_solid_angle(1.0f / window.area, d2, cosine);
  out.radiance = lamp.spread ? lamp.radiance * spread_attenuation(lamp, out.direction, cosine) : lamp.radiance;
  return true;
}

float area_density(const Lamp& lamp, const Vec3& position, const Vec3& direction, float t) {
  const Vec3 to_center = lamp.position - position;
  const float height = -glm::dot(to_center, lamp.axis), cosine = -glm::dot(direction, lamp.axis);
  Window window;
  if (!(height > 0.0f) || !(cosine > 0.0f) || !visible_window(lamp, to_center, height, window)) return 0.0f;
  if (lamp.shape == LampShape::kRectangle && lamp.orthogonal) {
    const RectangleView view = rectangle_view(lamp, position, window);
    if (view.usable()) return 1.0f / view.solid_angle();
  }
  return area_to_solid_angle(1.0f / window.area, t * t, cosine);
}

bool sample_round(const Lamp& lamp, const Vec3& position, const Vec3& normal, const Vec2& u, LampSample& out) {
  const Vec3 to_center = lamp.position - position;
  const float d2 = glm::dot(to_center, to_center), r2 = lamp.radius * lamp.radius;
  bool inside = false;
  if (lamp.shape == LampShape::kPoint) {
    if (!(d2 > 0.0f)) return false;
    out.distance = std::sqrt(d2);
    out.direction = to_center / out.distance;
    out.density = 1.0f;
    out.radiance = attenuated(lamp, -out.direction, false) / d2;
    return true;
  }
  if (lamp.shape == LampShape::kDisk) {
    if (!(d2 > 0.0f)) return false;
    // A disk that faces the point is exactly a cap of directions.
    const float one_minus = one_minus_cos_of(r2 / (d2 + r2)), d = std::sqrt(d2);
    const Vec3 local = square_to_cone(u, one_minus);
    out.direction = glm::normalize(Frame(to_center / d).to_world(local));
    out.density = cone_density(one_minus);
    out.distance = d / local.z;
  } else if (d2 > r2 * 1.000001f) {
    const float one_minus = one_minus_cos_of(r2 / d2), d = std::sqrt(d2);
    const Vec3 local = square_to_cone(u, one_minus);
    out.direction = glm::normalize(Frame(to_center / d).to_world(local));
    out.density = cone_density(one_minus);
    const float across2 = d2 * std::max((1.0f - local.z) * (1.0f + local.z), 0.0f);
    out.distance = d * local.z - std::sqrt(std::max(r2 - across2, 0.0f));
  } else {
    inside = true;
    const bool facing = glm::dot(normal, normal) > 0.0f;
    out.direction = facing ? Frame(normal).to_world(square_to_cosine_hemisphere(u)) : square_to_sphere(u);
    out.density = facing ? std::max(glm::dot(out.direction, normal), 0.0f) * kInvPi : 0.25f * kInvPi;
    out.distance = intersect_sphere(position, out.direction, lamp.position, lamp.radius, 0.0f, kInfinity);
    if (!(out.distance > 0.0f)) return false;
  }
  out.radiance = attenuated(lamp, -out.direction, inside);
  return out.density > 0.0f && !is_black(out.radiance);
}

}  // namespace

Vec3 lamp_local(const Lamp& lamp, const Vec3& d) {
  const Vec3 local(glm::dot(d, lamp.local_x), glm::dot(d, lamp.local_y), glm::dot(d, lamp.local_z));
  const float length = glm::length(local);
  return length > 0.0f ? local / length : Vec3(0, 0, -1);
}

std::optional<Lamp> make_lamp(const Light& light, Handle handle, const DVec3& origin, std::string& problem) {
  const DMat4& m = light.transform;
  const bool numbers = is_finite(light.color) && std::isfinite(light.power) && std::isfinite(light.radius) &&
                       std::isfinite(light.angle) && std::isfinite(light.spot_size) &&
                       std::isfinite(light.spot_blend) && std::isfinite(light.spread) && std::isfinite(light.size.x) &&
                       std::isfinite(light.size.y);
  if (!finite(m)) problem = "its transform is not finite";
  if (!numbers) problem = "its colour, power or size is not finite";
  if (!problem.empty()) return std::nullopt;
  Lamp lamp;
  lamp.handle = handle;
  lamp.visibility = light.visibility;
  lamp.cast_shadow = light.cast_shadow;
  lamp.has_graph = light.graph.has_value();
  lamp.legacy = light.version == 1;
  lamp.position = Vec3(DVec3(m[3]) - origin);
  lamp.axis = normalized_or(-DVec3(m[2]), Vec3(0, 0, -1));
  auto row = [](const DVec3& column, const Vec3& otherwise) {
    const double length2 = glm::dot(column, column);
    return length2 > 0.0 ? Vec3(column / length2) : otherwise;
  };
  lamp.local_x = row(DVec3(m[0]), Vec3(1, 0, 0));
  lamp.local_y = row(DVec3(m[1]), Vec3(0, 1, 0));
  lamp.local_z = row(DVec3(m[2]), Vec3(0, 0, 1));
  bool shines = false;
  switch (light.kind) {
    case LightKind::kPoint:
      shines = make_point(light, false, lamp);
      break;
    case LightKind::kSpot:
      shines = make_point(light, true, lamp);
      break;
    case LightKind::kSun:
      shines = make_sun(light, lamp);
      break;
    case LightKind::kArea:
      shines = make_area(light, m, lamp);
      break;
  }
  lamp.radiance = glm::max(lamp.radiance, Rgb(0.0f));  // negative lights are not light
  if (!shines || is_black(lamp.radiance)) return std::nullopt;
  if (!is_finite(lamp.radiance) || !is_finite(lamp.position)) {
    problem = "its radiance is beyond the range of numbers: make it larger or weaker";
    return std::nullopt;
  }
  return lamp;
}

Rgb sun_radiance(const Lamp& lamp, const Vec3& direction) {
  if (!lamp.legacy) return lamp.radiance;
  // Before 4.0 directions were chosen evenly over a flat disk before the receiver.
  const float cosine = std::max(-glm::dot(direction, lamp.axis), 1e-3f);
  return lamp.radiance / (cosine * cosine * cosine);
}

bool sample_lamp(const Lamp& lamp, const Vec3& position, const Vec3& normal, const Vec2& u, LampSample& out) {
  out = LampSample{};
  switch (lamp.shape) {
    case LampShape::kRectangle:
    case LampShape::kEllipse:
      return sample_area(lamp, position, u, out) && !is_black(out.radiance);
    case LampShape::kDirection:
      out.direction = -lamp.axis;
      out.density = 1.0f;
      out.radiance = lamp.radiance;
      return true;
    case LampShape::kCone:
      out.direction = glm::normalize(Frame(-lamp.axis).to_world(square_to_cone(u, lamp.one_minus_cos)));
      out.density = cone_density(lamp.one_minus_cos);
      out.radiance = sun_radiance(lamp, out.direction);
      return true;
    default:
      return sample_round(lamp, position, normal, u, out);
  }
}

bool intersect_lamp(const Lamp& lamp, const Vec3& origin, const Vec3& direction, float t_min, float t_max,
                    LampHit& hit) {
  const Vec3 to_center = lamp.position - origin;
  switch (lamp.shape) {
    case LampShape::kRectangle:
    case LampShape::kEllipse: {
      const float cosine = -glm::dot(direction, lamp.axis);
      if (!(cosine > 0.0f)) return false;
      const float t = -glm::dot(to_center, lamp.axis) / cosine;
      if (!(t > t_min && t < t_max)) return false;
      const Vec3 offset = direction * t - to_center;
      const Vec2 p = in_edges(lamp, offset);
      const bool round = lamp.shape == LampShape::kEllipse;
      if (round ? glm::dot(p, p) > 0.25f : std::fabs(p.x) > 0.5f || std::fabs(p.y) > 0.5f) return false;
      hit.t = t, hit.uv = p + 0.5f;
      hit.radiance = lamp.spread ? lamp.radiance * spread_attenuation(lamp, direction, cosine) : lamp.radiance;
      return !is_black(hit.radiance);
    }
    case LampShape::kSphere: {
      const float t = intersect_sphere(origin, direction, lamp.position, lamp.radius, t_min, t_max);
      if (!(t > 0.0f)) return false;
      const bool inside = glm::dot(to_center, to_center) <= lamp.radius * lamp.radius * 1.000001f;
      if (!inside && glm::dot(t * direction - to_center, direction) > 0.0f) return false;  // leaving: was met before
      hit.t = t, hit.radiance = attenuated(lamp, -direction, inside);
      return !is_black(hit.radiance);
    }
    case LampShape::kDisk: {
      const float d2 = glm::dot(to_center, to_center), cosine = glm::dot(direction, to_center);
      if (!(d2 > 0.0f) || !(cosine > 0.0f)) return false;
      const float t = d2 / cosine;
      if (!(t > t_min && t < t_max)) return false;
      const Vec3 offset = direction * t - to_center;
      if (glm::dot(offset, offset) > lamp.radius * lamp.radius) return false;
      hit.t = t, hit.radiance = attenuated(lamp, -direction, false);
      return !is_black(hit.radiance);
    }
    default:
      return false;
  }
}

float lamp_density(const Lamp& lamp, const Vec3& position, const Vec3& normal, const Vec3& direction, float t) {
  const Vec3 to_center = lamp.position - position;
  switch (lamp.shape) {
    case LampShape::kRectangle:
    case LampShape::kEllipse:
      return area_density(lamp, position, direction, t);
    case LampShape::kDisk: {
      const float d2 = glm::dot(to_center, to_center), r2 = lamp.radius * lamp.radius;
      return d2 > 0.0f ? cone_density(one_minus_cos_of(r2 / (d2 + r2))) : 0.0f;
    }
    case LampShape::kSphere: {
      const float d2 = glm::dot(to_center, to_center), r2 = lamp.radius * lamp.radius;
      if (d2 > r2 * 1.000001f) return cone_density(one_minus_cos_of(r2 / d2));
      if (glm::dot(normal, normal) > 0.0f) return std::max(glm::dot(direction, normal), 0.0f) * kInvPi;
      return 0.25f * kInvPi;
    }
    case LampShape::kCone:
      return cone_density(lamp.one_minus_cos);
    default:
      return 0.0f;
  }
}

}  // namespace afterglow
