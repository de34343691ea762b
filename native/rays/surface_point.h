// SPDX-License-Identifier: GPL-3.0-or-later
// The geometric facts at a hit, and where the next ray may start. Positions come from barycentric coordinates, not from
// the ray, so that they lie on the triangle; a bound of their rounding error goes along (after Woo et al. 1996 and
// Pharr et al. 2023, 6.8), because a fixed offset would fit only one size of scene.
#pragma once

#include "rays/ray_caster.h"

namespace afterglow {

struct SurfacePoint {
  Vec3 position;     // relative to Scene::origin()
  Vec3 face_normal;  // unit, world, turned to the side that the ray came from
  Vec3 normal;       // unit shading normal, turned likewise
  Vec3 outgoing;     // unit, to where the ray came from
  Vec2 uv{0.0f};     // active map
  float u = 0.0f, v = 0.0f, t = 0.0f;
  uint32_t instance = kNone, triangle = kNone;
  uint32_t material = 0;  // dense index
  float error = 0.0f;     // how far from the true surface rounding may have put the position
  bool backfacing = false;
};

/// with_uv: also the active UV map (skipped where no program reads it).
SurfacePoint surface_point(const Scene&, const Ray&, const Hit&, bool with_uv);

/// The active UV map at a hit, for those who learn only from the point's material that they want it.
Vec2 surface_uv(const Scene&, const SurfacePoint&);

/// The dense material index at a hit, without the facts that cost more.
uint32_t material_at(const Scene&, const Hit&);

/// How far along its normal a point of a face may be from where a ray meets it. bound: sum of the magnitudes of all
/// terms that its position is made of; e1, e2: edges in world space.
float rounding_error(const Vec3& face_normal, const Vec3& bound, const Vec3& e1, const Vec3& e2);

/// A ray's start beyond self-intersection on the side that `direction` leaves to. The error bound covers the transform.
Vec3 offset_origin(const SurfacePoint&, const Vec3& direction);

}  // namespace afterglow
