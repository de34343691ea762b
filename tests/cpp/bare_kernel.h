// SPDX-License-Identifier: GPL-3.0-or-later
// The path tracer of one scene, a diffuse Cornell box under one emissive rectangle, written down by itself: what the
// kernel that a scene's Effects choose is held against, to see what it pays for effects that the scene lacks.
//
// It does the same job: the same samples of the same Sobol points, light looked for and run into with the same weights,
// the same roulette, light that is not finite dropped and counted, a film with sixteen batches. Its picture is that of
// the chosen kernel to the last bit, and so are its rays, so that both count the same work.
//
// What it shares with the engine are building blocks that know of no effects, or only of such as every scene has: the
// rays through Embree with their masks, the facts at a hit, where a shadow ray begins and ends, the sample of a point
// on a rectangle and its density, sampler, pixel filter, the eye of a camera without a lens, Film::add.
//
// All else is written straight for what stands in the box. Materials are two arrays of colours: no programs, lobes,
// classes of lobes, transparency, holdouts or Light Path. The light is known: no tree, world, suns or lamps to choose
// from, no emission to look up. All bounces are diffuse: one limit, one kind of ray, no context. No lens, clamp,
// transparent film, local view, stop, subset of the pixels, visitor or pass (Kajiya 1986; Veach 1995 for the weights).
#pragma once

#include <cstring>

#include "methods/path_tracing/film_visitor.h"

namespace afterglow::bare {

/// What is known before the first ray.
struct Input {
  const CommittedScene& scene;
  const CameraRays& camera;
  Film& film;
  EmissivePatch lamp;
  Rgb radiance{0.0f};
  std::vector<Rgb> albedo, emission;  // by material
  uint32_t diffuse_bounces = 12, seed = 0;
};

struct Path {
  Ray ray;
  Rgb throughput{1.0f}, light{0.0f};
  Vec3 position{0.0f}, normal{0.0f};
  float density = 0.0f;
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
  float weight = 1.0f;
  if (path.density > 0.0f) {
    const Vec3 way = point.position - path.position;
    const float distance = glm::length(way);
    weight =
        power_heuristic(path.density, patch_density(in.lamp, path.position, path.normal, way / distance, distance));
  }
  add(path, path.throughput * (emission * weight), counts);
}

inline void look_for_light(const Input& in, Path& path, const SurfacePoint& point, const Rgb& albedo, const Vec2& u,
                           RayCounts& counts) {
  PatchSample s;
  if (!sample_patch(in.lamp, point.position, point.normal, u, s)) return;
  const float cosine = glm::dot(point.normal, s.direction);
  if (cosine <= 0.0f || glm::dot(point.face_normal, s.direction) <= 0.0f) return;
  const float density = cosine * kInvPi;
  const Rgb arriving = in.radiance * (power_heuristic(s.density, density) / s.density);
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
  path.throughput *= albedo * path.density / path.density;
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
    const Rgb &albedo = in.albedo[point.material], &emission = in.emission[point.material];
    if (!is_black(emission)) emitted(in, path, point, emission, counts);
    if (vertex > in.diffuse_bounces || is_black(albedo)) return;
    const uint32_t block = (kCameraDimensions + vertex * kVertexDimensions) / 4;
    const std::array<float, 4> u = sampler.block(block);
    look_for_light(in, path, point, albedo, {u[2], u[3]}, counts);
    const std::array<float, 4> v = sampler.block(block + 1);
    if (!scatter(path, point, albedo, {v[2], v[3]})) return;
    const float p = survival(path.throughput, vertex + 1, 0);
    if (p < 1.0f) {
      path.throughput /= p;
      if (!(u[1] < p)) return;
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
        const std::array<float, 4> u = sampler.block(0);
        const Vec2 in_pixel = in.film.filter().offset({u[0], u[1]});
        Path path;
        in.camera.pinhole_ray(Vec2(float(x) + 0.5f, float(y) + 0.5f) + in_pixel, path.ray);
        walk(in, path, sampler, counts);
        for (int c = 0; c < 3; ++c) sums[layout[Pass::kCombined] + c] += path.light[c];
        sums[layout[Pass::kBatches] + int(batch_of(i))] += luminance(path.light);
      }
      in.film.add(x, y, sums, request.count);
    }
}

}  // namespace afterglow::bare
