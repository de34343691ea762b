// SPDX-License-Identifier: GPL-3.0-or-later
// Which records answer for a point, and how much each counts: pure functions. After (4) and (5) of Debattista et al.
// 2009, with distances in units of the record's radius (the paper's (5) adds a length to a pure number), the weight
// zero at the border of a record (Tabellion and Lamorlette 2004) so that no edge is seen there, finite at its centre,
// and Ward's test for records in front of or behind the point's surface.
#pragma once

#include <algorithm>

#include "methods/instant_cache/octree.h"

namespace afterglow::instant_cache {

/// How far records reach, from the relative error that is accepted.
struct Spacing {
  float most_pixels = 20.0f, least_pixels = 2.5f;  // radius in footprints of a pixel
  float change = 0.3f;                             // of the light within a radius, relative
  float angle_scale = 2.7f;                        // 1 / sqrt(1 − cos of the angle at which a record counts no more)
};

inline Spacing spacing_of(float accuracy) {
  const float s = std::sqrt(std::clamp(accuracy, 0.0005f, 1.0f) / 0.05f);
  return {20.0f * s, 2.5f * std::min(s, 1.0f), 0.3f * s, 2.7f / std::clamp(s, 0.25f, 1.5f)};
}

/// Radius of a record from its light's steepest relative change per length, and the pixel that asked for it.
inline float record_radius(const Spacing& s, float relative_slope, float footprint) {
  const float least = s.least_pixels * footprint, most = s.most_pixels * footprint;
  return relative_slope * most > s.change ? std::max(s.change / relative_slope, least) : most;
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

inline float record_weight(float distance) { return (1.0f - distance) / (distance + 0.02f); }

}  // namespace afterglow::instant_cache
