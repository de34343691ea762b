// SPDX-License-Identifier: GPL-3.0-or-later
// A walk whose visitor keeps nothing but the rays.
#include "render/record_rays.h"

#include <algorithm>

#include "lights/camera.h"
#include "transport/path_walker.h"

namespace afterglow {

namespace {

struct RecordingVisitor {
  RecordedRays& rays;
  size_t most;
  bool surface(const PathState&, const SurfacePoint&, const Surface&) { return true; }
  void lit(const PathState&, const BsdfValue&, const Rgb&) {}
  void scattered(const PathState&, const BsdfSample&) {}
  void emitted(const PathState&, const Rgb&) {}
  void escaped(const PathState&, const Rgb&) {}
  void held_out(const PathState&, float) {}
  void traced(const Ray& ray, bool occlusion) {
    std::vector<Ray>& kept = occlusion ? rays.occlusion : rays.closest;
    if (kept.size() < most) kept.push_back(ray);
  }
};

WalkLimits limits_of(const RenderSettings& settings) {
  WalkLimits limits;
  for (const auto& [name, value] : settings.method_settings) {
    const auto* count = std::get_if<int64_t>(&value);
    if (!count) continue;
    if (name == "max_bounces") limits.max_bounces = uint32_t(*count);
    if (name == "diffuse_bounces") limits.diffuse = uint32_t(*count);
    if (name == "glossy_bounces") limits.glossy = uint32_t(*count);
    if (name == "transmission_bounces") limits.transmission = uint32_t(*count);
  }
  return limits;
}

}  // namespace

RecordedRays record_rays(const CommittedScene& scene, const RenderSettings& settings, size_t most) {
  const FilmSettings film = completed(settings.film);
  const CameraRays camera(scene.scene.camera(), scene.scene.origin(), film.width, film.height);
  const WalkScene walk{scene, limits_of(settings)};
  RayCounts counts;
  const Walker<kFeatureLobes | kFeatureStraight | kFeatureShapes> walker(walk, counts);
  RecordedRays rays;
  RecordingVisitor visitor{rays, most};
  // Tiles as a render takes them, but only so many of them that the rays come from all over the image.
  const uint32_t tile = 16, columns = (film.x1 - film.x0 + tile - 1) / tile,
                 rows = (film.y1 - film.y0 + tile - 1) / tile;
  const uint64_t rays_a_tile = uint64_t(tile) * tile * 4;
  const uint32_t stride =
      std::max<uint32_t>(1, uint32_t(uint64_t(columns) * rows * rays_a_tile / std::max<size_t>(most, 1)));
  for (uint32_t t = 0; t < columns * rows && std::min(rays.closest.size(), rays.occlusion.size()) < most; t += stride)
    for (uint32_t i = 0; i < tile * tile; ++i) {
      const uint32_t x = film.x0 + t % columns * tile + i % tile, y = film.y0 + t / columns * tile + i / tile;
      if (x >= film.x1 || y >= film.y1) continue;
      Sampler sampler(hash(x, y, uint32_t(settings.seed)), 0);
      const Vec2 in_pixel = sampler.next2();
      PathState path;
      path.ray = camera.ray(Vec2(float(x), float(y)) + in_pixel, Vec2(0.5f)).ray;
      path.ray.mask = kVisibleCamera;
      walker.walk(path, sampler, visitor);
    }
  return rays;
}

}  // namespace afterglow
