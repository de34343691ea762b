// SPDX-License-Identifier: GPL-3.0-or-later
// The loop over the pixels and samples of a request that all kernels share.
#pragma once

#include "methods/path_tracing/film_visitor.h"
#include "methods/path_tracing/kernel.h"

namespace afterglow::path_tracing {

inline float mean_length(const Vec3& a, const Vec3& b) { return 0.5f * (glm::length(a) + glm::length(b)); }

template <uint32_t kFeatures>
void render_request(const KernelInput& in, const PixelRequest& request, RayCounts& counts) {
  constexpr bool kPasses = kFeatures & kFeaturePasses;
  const Walker<kFeatures & 7u> walker(in.walk, counts);
  const bool lens = in.camera.needs_lens();
  FilmVisitor<kPasses> visitor(in, counts);
  for (uint32_t y = request.y; y < uint32_t(request.y) + request.height; y += request.step)
    for (uint32_t x = request.x; x < uint32_t(request.x) + request.width; x += request.step) {
      if (in.stop.stop()) return;
      if (request.skip && (x - in.film.settings().x0) % request.skip == 0 &&
          (y - in.film.settings().y0) % request.skip == 0)
        continue;
      visitor.begin_pixel();
      const uint32_t pixel_seed = hash(x, y, in.seed);
      bool placing = kPasses && request.first == 0 && visitor.wants_place();  // one walk more, before the first sample
      for (uint32_t i = request.first; i < request.first + request.count;) {
        Sampler sampler(hash(pixel_seed, batch_of(i)), index_in_batch(i));
        const Vec2 in_pixel = in.film.filter().offset(sampler.next2());
        const Vec2 on_lens = lens ? sampler.next2() : Vec2(0.5f);
        const Vec2 middle(float(x) + 0.5f, float(y) + 0.5f);
        const CameraRay camera_ray = in.camera.ray(placing ? middle : middle + in_pixel, on_lens);
        PathState path;
        path.ray = camera_ray.ray;
        path.ray.mask = kVisibleCamera;
        path.context.footprint = mean_length(camera_ray.origin_dx, camera_ray.origin_dy);
        path.pixel_angle = mean_length(camera_ray.direction_dx, camera_ray.direction_dy);
        placing ? visitor.begin_place(path) : visitor.begin_sample(path, i);
        walker.walk(path, sampler, visitor);
        placing ? visitor.end_place() : visitor.end_sample();
        i += placing ? 0 : 1;
        placing = false;
      }
      in.film.add(x, y, visitor.sums(), request.count);
    }
}

}  // namespace afterglow::path_tracing
