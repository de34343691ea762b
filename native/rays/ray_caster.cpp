// SPDX-License-Identifier: GPL-3.0-or-later
// The two questions that kernels ask the BVH. Building it is bvh_build.cpp's work; here is only the way of one ray
// through Embree (Wald et al. 2014), kept as thin as it can be.
#include "rays/ray_caster.h"

#include "rays/ray_caster_state.h"
#include "rays/ray_query.h"

namespace afterglow {

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

bool RayCaster::occluded(const Ray& ray) const { return ray_occluded(state_->root, ray); }

}  // namespace afterglow
