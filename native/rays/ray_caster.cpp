// SPDX-License-Identifier: GPL-3.0-or-later
// The two questions that kernels ask the BVH. Building it is bvh_build.cpp's work; here is only the way of one ray
// through Embree (Wald et al. 2014), kept as thin as it can be.
#include "rays/ray_caster.h"

#include <cstddef>
#include <cstring>

#include "rays/ray_caster_state.h"

namespace afterglow {

namespace {

using Lanes = float __attribute__((vector_size(16)));

/// Embree's answer to a ray that is not finite, or further out than it can square, is undefined; ours is: nothing is
/// hit. Origin and nearest distance, direction and furthest distance are compared four at a time.
bool usable(const Ray& ray) {
  static_assert(sizeof(Vec3) == 12 && offsetof(Ray, t_min) == 12 && offsetof(Ray, t_max) == 28);
  constexpr float largest = 1.844e18f;
  Lanes from, way;
  std::memcpy(&from, &ray.origin, 16);
  std::memcpy(&way, &ray.direction, 16);
  const Lanes bound{largest, largest, largest, kInfinity};
  const auto inside = (from <= bound) & (from >= -bound) & (way <= bound) & (way >= -bound);
  return (inside[0] & inside[1] & inside[2] & inside[3]) && ray.t_min <= ray.t_max;
}

void fill(RTCRay& to, const Ray& ray) {
  to.org_x = ray.origin.x;
  to.org_y = ray.origin.y;
  to.org_z = ray.origin.z;
  to.tnear = ray.t_min;
  to.dir_x = ray.direction.x;
  to.dir_y = ray.direction.y;
  to.dir_z = ray.direction.z;
  to.time = 0.0f;
  to.tfar = ray.t_max;
  to.mask = ray.mask;
  to.id = 0;
  to.flags = 0;
}

}  // namespace

bool RayCaster::closest(const Ray& ray, Hit& hit) const {
  hit.instance = kNone;
  hit.t = kInfinity;
  if (!usable(ray)) return false;
  RTCRayHit query;
  fill(query.ray, ray);
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  embree::closest(state_->root, query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return false;
  hit.t = query.ray.tfar;
  hit.u = query.hit.u;
  hit.v = query.hit.v;
  // Met in the common BVH (by itself: no instance; below the top level: instance 0) the mesh has its place as id, an
  // instance has its place + 1.
  static_assert(RTC_INVALID_GEOMETRY_ID == ~0u && kFlatId == 0);
  const uint32_t instance = query.hit.instID[0];
  hit.instance = instance + 1 <= 1 ? query.hit.geomID : instance - 1;
  hit.triangle = query.hit.primID;
  return true;
}

bool RayCaster::occluded(const Ray& ray) const {
  if (!usable(ray)) return false;
  RTCRay query;
  fill(query, ray);
  embree::occluded(state_->root, query);
  return query.tfar < 0.0f;
}

}  // namespace afterglow
