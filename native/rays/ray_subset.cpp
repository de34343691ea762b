// SPDX-License-Identifier: GPL-3.0-or-later
// A second top level over geometries that the first one has made: see ray_subset.h.
#include "rays/ray_subset.h"

#include "rays/ray_caster_state.h"
#include "rays/ray_query.h"

namespace afterglow {

RaySubset::RaySubset(const RayCaster& caster, std::span<const uint32_t> instances) {
  const RayCaster::State& s = *caster.state_;
  for (const uint32_t i : instances) complete_ &= i >= s.places.size() || s.places[i].kind != PlacedGeometry::kFlat;
  if (!complete_) return;
  const RTCScene scene = rtcNewScene(s.device);
  rtcSetSceneFlags(scene, kSceneFlags);
  for (const uint32_t i : instances)
    if (i < s.places.size() && s.places[i].kind == PlacedGeometry::kInstance)
      rtcAttachGeometryByID(scene, s.places[i].geometry, i + 1);
  rtcCommitScene(scene);
  scene_ = scene;
}

RaySubset::~RaySubset() {
  if (scene_) rtcReleaseScene(static_cast<RTCScene>(scene_));
}

bool RaySubset::occluded(const Ray& ray) const { return ray_occluded(static_cast<RTCScene>(scene_), ray); }

}  // namespace afterglow
