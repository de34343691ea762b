// SPDX-License-Identifier: GPL-3.0-or-later
// The loop over the pixels and samples of a request that all kernels share.
#pragma once

#include "methods/path_tracing/film_visitor.h"
#include "methods/path_tracing/kernel.h"

namespace afterglow::path_tracing {

inline float mean_length(const Vec3& a, const Vec3& b) { return 0.5f * (glm::length(a) + glm::length(b)); }

/// A path from the camera. pinhole: the ray alone is wanted, and the camera has no lens.
inline PathState path_from(const CameraRays& camera, const Vec2& on_film, const Vec2& on_lens, bool pinhole) {
  if (pinhole) {
    PathState path;
    camera.pinhole_ray(on_film, path.ray);
    return path;
  }
  const CameraRay from = camera.ray(on_film, on_lens);
  PathState path;
  path.ray = from.ray;
  path.context.footprint = mean_length(from.origin_dx, from.origin_dy);
  path.pixel_angle = mean_length(from.direction_dx, from.direction_dy);
  return path;
}

template <uint32_t kFeatures>
void render_request(const KernelInput& in, const PixelRequest& request, RayCounts& counts) {
  constexpr bool kPasses = kFeatures & kFeaturePasses;
  const Walker<kFeatures & 7u> walker(in.walk, counts);
  // No material that reads its point and no pass that keeps it, no need of a footprint.
  const bool pinhole =
      in.camera.is_pinhole() && in.walk.scene.materials.all_plain() && in.film.layout()[Pass::kDenoiseSurface] < 0;
  FilmVisitor<kPasses, bool(kFeatures & kFeatureLobes)> visitor(in, counts);
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
        const auto [u_x, u_y, u_lens_x, u_lens_y] = sampler.block(0);
        const Vec2 in_pixel = in.film.filter().offset({u_x, u_y});
        const Vec2 on_lens(u_lens_x, u_lens_y);
        const Vec2 middle(float(x) + 0.5f, float(y) + 0.5f);
        PathState path = path_from(in.camera, placing ? middle : middle + in_pixel, on_lens, pinhole);
        placing ? visitor.begin_place(path) : visitor.begin_sample(path, i);
        walker.walk(path, sampler, visitor);
        placing ? visitor.end_place() : visitor.end_sample();
        i += placing ? 0 : 1;
        placing = false;
      }
      in.film.add(x, y, visitor.sums(), request.count, visitor.squares());
    }
}

}  // namespace afterglow::path_tracing
