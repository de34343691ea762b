// SPDX-License-Identifier: GPL-3.0-or-later
// Which records answer for a point, and how much each counts: pure functions. After (4) and (5) of Debattista et al.
// 2009, with distances in units of the record's radius (the paper's (5) adds a length to a pure number), the weight
// smooth and zero at the border of a record (Tabellion and Lamorlette 2004) so that no edge is seen there, Ward's test
// for records in front of or behind the point's surface, and Ward and Heckbert's gradients (1992).
#pragma once

#include <algorithm>

#include "methods/instant_cache/octree.h"

namespace afterglow::instant_cache {

/// How far records reach, from the relative error that is accepted.
struct Spacing {
  float most_pixels = 20.0f, least_pixels = 2.5f;  // radius in footprints of a pixel
  float bend = 0.15f;        // how far light at the radius may be from what the gradient tells, relative
  float angle_scale = 2.7f;  // 1 / sqrt(1 − cos of the angle at which a record counts no more)
};

inline Spacing spacing_of(float accuracy) {
  const float e = std::clamp(accuracy, 0.0005f, 1.0f), s = std::sqrt(e / 0.05f);
  return {20.0f * s, 2.5f * std::min(s, 1.0f), 3.0f * e, 2.7f / std::clamp(s, 0.25f, 1.5f)};
}

/// How far a record is from being usable at a point: 0 at its centre, 1 at its border. limit: the largest radius that
/// the point's own footprint allows.
inline float distance_to_record(const Entry& e, const CachePoint& p, float limit, float angle_scale) {
  const Vec3 way = p.position - e.position;
  const float inverse = std::max(e.inverse_radius, 1.0f / limit);
  const float d2 = glm::dot(way, way) * inverse * inverse;
  if (!(d2 < 1.0f) || e.instance != p.instance) return 1.0f;
  const float bend = std::max(1.0f - glm::dot(e.normal, p.normal), 0.0f);
  const float distance = std::sqrt(d2) + angle_scale * std::sqrt(bend);
  if (!(distance < 1.0f)) return 1.0f;
  // In front of the point, behind it, or on the other side of a thin wall.
  const float off = std::fabs(glm::dot(way, e.normal + p.normal)) * 0.5f * inverse;
  return off < 0.1f ? distance : 1.0f;
}

/// No peak in the middle, where each record would be seen as a facet, and no edge at the border.
inline float record_weight(float distance) { return (1.0f - distance) * (1.0f - distance); }

/// What a straight line may make of a record's light: near a light or in a corner none is true for long.
inline Rgb bounded_light(const Rgb& line, const Rgb& at_record) {
  return glm::clamp(line, 0.5f * at_record, 2.0f * at_record);
}

/// Light of a record for a point nearby: along its gradients (Ward and Heckbert 1992). A bumped lobe's normal is not
/// the surface's: lights before both count by its cosine with theirs, which is the vector irradiance along it.
inline Rgb light_at(const Record& r, const CachePoint& p) {
  const Rgb light = bounded_light(
      r.irradiance + r.by_step * (p.position - r.position) + r.by_turn * (p.normal - r.normal), r.irradiance);
  if (p.bent == p.normal) return light;
  const Rgb bumped = light + r.irradiance * (glm::dot(p.bent, p.normal) - 1.0f) + r.by_turn * (p.bent - p.normal);
  return glm::clamp(bumped, Rgb(0.0f), 2.0f * light);
}

}  // namespace afterglow::instant_cache
