// SPDX-License-Identifier: GPL-3.0-or-later
// The loop over the pixels and samples of a request that all kernels share.
#pragma once

#include "methods/path_tracing/film_visitor.h"
#include "methods/path_tracing/kernel.h"

namespace afterglow::path_tracing {

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
      for (uint32_t i = request.first; i < request.first + request.count; ++i) {
        Sampler sampler(hash(pixel_seed, i % kBatchCount), i / kBatchCount);
        const Vec2 in_pixel = in.film.filter().offset(sampler.next2());
        const Vec2 on_lens = lens ? sampler.next2() : Vec2(0.5f);
        const CameraRay camera_ray = in.camera.ray(Vec2(float(x) + 0.5f, float(y) + 0.5f) + in_pixel, on_lens);
        PathState path;
        path.ray = camera_ray.ray;
        path.ray.mask = kVisibleCamera;
        visitor.begin_sample(path, i);
        walker.walk(path, sampler, visitor);
        visitor.end_sample();
      }
      in.film.add(x, y, visitor.sums(), request.count);
    }
}

}  // namespace afterglow::path_tracing
