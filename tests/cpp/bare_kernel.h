// SPDX-License-Identifier: GPL-3.0-or-later
// The path tracer of a diffuse scene under emissive meshes, written down by itself: what the kernel that a scene's
// Effects choose is held against. No lens, world, lamp, clamp, holdout, transparency, local view, stop, pass or lobe
// but Lambert's is known here. What every kernel asks of the scene, it asks of the same tables: the nearest hit and its
// facts, the material's lobes, a light. What is no effect, it does as well: light that is not finite is dropped, shadow
// rays end off their lights, batches tell the error. Its picture is that of the chosen kernel to the last bit, so that
// both count the same work (Kajiya 1986; Veach 1995 for the weights).
#pragma once

#include <cstring>

#include "methods/path_tracing/film_visitor.h"

namespace afterglow::bare {

struct Input {
  const CommittedScene& scene;
  const CameraRays& camera;
  Film& film;
  uint32_t diffuse_bounces = 12, seed = 0;
};

struct Path {
  Ray ray;
  Rgb throughput{1.0f}, light{0.0f};
  Vec3 position{0.0f}, normal{0.0f};
  float density = 0.0f;
  PathContext context;
};

/// What is not finite is dropped and counted, here as everywhere.
inline void add(Path& path, const Rgb& light, RayCounts& counts) {
  if (std::fabs(light.x) + std::fabs(light.y) + std::fabs(light.z) <= path_tracing::kMostLight)
    path.light += glm::max(light, Rgb(0.0f));
  else
    counts.dropped++;
}

/// Light run into, weighted against the chance that it had been looked for.
inline void emitted(const Input& in, Path& path, const SurfacePoint& point, const Rgb& emission, RayCounts& counts) {
  const float weight =
      path.density > 0.0f
          ? power_heuristic(path.density, in.scene.lights.density_of_triangle(path.position, path.normal, point))
          : 1.0f;
  add(path, path.throughput * (emission * weight), counts);
}

inline void look_for_light(const Input& in, Path& path, const SurfacePoint& point, const Rgb& albedo, float u_light,
                           const Vec2& u, RayCounts& counts) {
  LightSample s;
  if (!in.scene.lights.sample(point.position, point.normal, u_light, u, s)) return;
  const float cosine = glm::dot(point.normal, s.direction);
  if (cosine <= 0.0f || glm::dot(point.face_normal, s.direction) <= 0.0f) return;
  const float density = cosine * kInvPi;
  const Rgb arriving = s.radiance * (power_heuristic(s.density, density) / s.density);
  const Ray ray = shadow_ray(point, s);
  counts.shadow++;
  if (in.scene.rays.occluded(ray)) return;
  add(path, (path.throughput * arriving) * (albedo * density), counts);
}

/// Turns the path into a new direction; false: it ends.
inline bool scatter(Path& path, const SurfacePoint& point, const Rgb& albedo, const Vec2& u) {
  const float radius = std::sqrt(u.x), phi = 2.0f * kPi * u.y;
  const float z = std::sqrt(std::fmax(0.0f, 1.0f - u.x));
  const Vec3 direction = Frame(point.normal).to_world({radius * std::cos(phi), radius * std::sin(phi), z});
  if (z <= 0.0f || glm::dot(point.face_normal, direction) <= 0.0f) return false;
  path.density = z * kInvPi;
  path.throughput *= (albedo * path.density) / path.density;
  if (is_black(path.throughput)) return false;
  path.position = point.position;
  path.normal = point.normal;
  path.ray.origin = offset_origin(point, direction);
  path.ray.direction = direction;
  path.ray.mask = kVisibleDiffuse;
  return true;
}

inline void walk(const Input& in, Path& path, Sampler& sampler, RayCounts& counts) {
  counts.camera++;
  for (uint32_t vertex = 0;; ++vertex) {
    Hit hit;
    if (!in.scene.rays.closest(path.ray, hit)) return;
    const SurfacePoint point = surface_point(in.scene.scene, path.ray, hit, false);
    Surface surface;
    in.scene.materials.shade(in.scene.scene, point, path.context, surface);
    if (!is_black(surface.emission)) emitted(in, path, point, surface.emission, counts);
    if (vertex > in.diffuse_bounces || !surface.count) return;
    sampler.set_dimension(kCameraDimensions + vertex * kVertexDimensions);
    const float u_light = sampler.next1(), u_end = sampler.next1();
    const Vec2 u_on_light = sampler.next2();
    const Rgb& albedo = surface.lobes[0].weight;
    look_for_light(in, path, point, albedo, u_light, u_on_light, counts);
    sampler.set_dimension(kCameraDimensions + vertex * kVertexDimensions + 6);
    if (!scatter(path, point, albedo, sampler.next2())) return;
    const float p = survival(path.throughput, vertex + 1, 0);
    if (p < 1.0f) {
      path.throughput /= p;
      if (!(u_end < p)) return;
    }
    counts.bounce++;
  }
}

inline void render(const Input& in, const PixelRequest& request, RayCounts& counts) {
  const FilmLayout& layout = in.film.layout();
  float sums[FilmLayout::kMaxFloats];
  for (uint32_t y = request.y; y < uint32_t(request.y) + request.height; ++y)
    for (uint32_t x = request.x; x < uint32_t(request.x) + request.width; ++x) {
      std::memset(sums, 0, sizeof(float) * size_t(layout.floats));
      const uint32_t pixel_seed = hash(x, y, in.seed);
      for (uint32_t i = request.first; i < request.first + request.count; ++i) {
        Sampler sampler(hash(pixel_seed, batch_of(i)), index_in_batch(i));
        const Vec2 in_pixel = in.film.filter().offset(sampler.next2());
        Path path;
        path.ray = in.camera.ray(Vec2(float(x) + 0.5f, float(y) + 0.5f) + in_pixel, Vec2(0.5f)).ray;
        path.ray.mask = kVisibleCamera;
        walk(in, path, sampler, counts);
        for (int c = 0; c < 3; ++c) sums[layout[Pass::kCombined] + c] += path.light[c];
        sums[layout[Pass::kBatches] + int(batch_of(i))] += luminance(path.light);
      }
      in.film.add(x, y, sums, request.count);
    }
}

}  // namespace afterglow::bare
