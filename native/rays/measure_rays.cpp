// SPDX-License-Identifier: GPL-3.0-or-later
// The wrapper against bare Embree calls: see measure_rays.h.
#include "rays/measure_rays.h"

#include <time.h>

#include <algorithm>

#include "base/errors.h"
#include "base/parallel.h"
#include "rays/ray_caster_state.h"

namespace afterglow {

namespace {

/// Of this thread alone, so that other programs on the machine do not count.
double thread_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return double(now.tv_sec) + 1e-9 * double(now.tv_nsec);
}

template <class Work>
double seconds(const Work& work) {
  const double start = thread_seconds();
  work();
  return thread_seconds() - start;
}

/// Embree's own structures, filled before the clock runs.
std::vector<RTCRayHit> bare_rays(std::span<const Ray> rays) {
  std::vector<RTCRayHit> out(rays.size());
  for (size_t i = 0; i < rays.size(); ++i) {
    RTCRay& to = out[i].ray;
    const Ray& ray = rays[i];
    to = {ray.origin.x,
          ray.origin.y,
          ray.origin.z,
          ray.t_min,
          ray.direction.x,
          ray.direction.y,
          ray.direction.z,
          0.0f,
          ray.t_max,
          ray.mask,
          0,
          0};
    out[i].hit.geomID = out[i].hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  }
  return out;
}

}  // namespace

struct RayMeasurement {
  static RTCScene scene(const RayCaster& rays) { return rays.state_->root; }
};

RayTimings measure_rays(const RayCaster& caster, std::span<const Ray> rays, bool occlusion, int rounds) {
  const FlushDenormals flush;
  RTCScene scene = RayMeasurement::scene(caster);
  const std::vector<RTCRayHit> prepared = bare_rays(rays);
  if (std::ranges::any_of(rays, [](const Ray& r) { return !is_finite(r.origin) || !is_finite(r.direction); }))
    throw InvalidInput("measure_rays: all rays must be finite");
  RayTimings out;
  for (int round = 0; round < rounds; ++round) {
    out.hits_wrapped = out.hits_bare = 0;
    const auto wrapped = [&] {
      Hit hit;
      for (const Ray& ray : rays) out.hits_wrapped += occlusion ? caster.occluded(ray) : caster.closest(ray, hit);
    };
    const auto bare = [&] {
      for (RTCRayHit query : prepared) {
        if (occlusion) {
          embree::occluded(scene, query.ray);
          out.hits_bare += query.ray.tfar < 0.0f;
        } else {
          embree::closest(scene, query);
          out.hits_bare += query.hit.geomID != RTC_INVALID_GEOMETRY_ID;
        }
      }
    };
    if (round % 2) out.bare.push_back(seconds(bare));
    out.wrapped.push_back(seconds(wrapped));
    if (round % 2 == 0) out.bare.push_back(seconds(bare));
  }
  return out;
}

}  // namespace afterglow
