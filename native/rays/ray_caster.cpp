// SPDX-License-Identifier: GPL-3.0-or-later
// The two questions that kernels ask the BVH. Building it is bvh_build.cpp's work; here is only the way of one ray
// through Embree (Wald et al. 2014), kept as thin as it can be.
#include "rays/ray_caster.h"

#include <algorithm>

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

namespace {

/// N lanes of Embree's packet, some of them without a ray.
template <class Packet, size_t N>
uint32_t packet_occluded(RTCScene scene, std::span<const Ray> rays) {
  alignas(64) int valid[N] = {};
  alignas(64) Packet packet{};
  for (size_t i = 0; i < rays.size(); ++i) {
    const Ray& ray = rays[i];
    if (!usable(ray)) continue;
    valid[i] = -1;
    packet.org_x[i] = ray.origin.x, packet.org_y[i] = ray.origin.y, packet.org_z[i] = ray.origin.z;
    packet.dir_x[i] = ray.direction.x, packet.dir_y[i] = ray.direction.y, packet.dir_z[i] = ray.direction.z;
    packet.tnear[i] = ray.t_min, packet.tfar[i] = ray.t_max, packet.mask[i] = ray.mask;
  }
  embree::occluded(valid, scene, packet);
  uint32_t hidden = 0;
  for (size_t i = 0; i < rays.size(); ++i) hidden |= uint32_t(valid[i] && packet.tfar[i] < 0.0f) << i;
  return hidden;
}

}  // namespace

uint32_t RayCaster::occluded(std::span<const Ray> rays) const {
  constexpr size_t kFew = 2;  // a packet's lanes cost more
  uint32_t hidden = 0;
  for (size_t i = 0; i < rays.size(); i += state_->together) {
    const std::span<const Ray> part = rays.subspan(i, std::min(rays.size() - i, state_->together));
    uint32_t found = 0;
    if (part.size() <= kFew)
      for (size_t j = 0; j < part.size(); ++j) found |= uint32_t(occluded(part[j])) << j;
    else if (part.size() <= 4)
      found = packet_occluded<RTCRay4, 4>(state_->root, part);
    else if (part.size() <= 8)
      found = packet_occluded<RTCRay8, 8>(state_->root, part);
    else
      found = packet_occluded<RTCRay16, 16>(state_->root, part);
    hidden |= found << i;
  }
  return hidden;
}

}  // namespace afterglow
