// SPDX-License-Identifier: GPL-3.0-or-later
// The path tracer of a diffuse scene under emissive meshes, written down by itself: what the kernel that a scene's Effects
// choose is held against. No lens, world, lamp, clamp, holdout, transparency, local view, stop or kind of ray is known here,
// materials are a table of colours, and the one lamp is asked without choosing among lights. Its picture is that of the
// chosen kernel to the last bit, so that both count the same work (Kajiya 1986; Veach 1995 for the weights).
#pragma once

#include <cstring>
#include <vector>

#include "lights/emissive_mesh.h"
#include "methods/path_tracing/kernel.h"

namespace afterglow::bare {

/// What a diffuse scene has of each material, by dense index.
struct Paint {
  Rgb albedo{0.0f}, emission{0.0f};
};

struct Input {
  const CommittedScene& scene;
  const CameraRays& camera;
  Film& film;
  std::vector<Paint> paints;
  EmissivePatch lamp;
  Rgb lamp_radiance{0.0f};
  uint32_t diffuse_bounces = 12, seed = 0;
};

struct Path {
  Ray ray;
  Rgb throughput{1.0f}, light{0.0f};
  Vec3 position{0.0f}, normal{0.0f};
  float density = 0.0f;
};

/// Light run into, weighted against the chance that it had been looked for.
inline void emitted(const Input& in, Path& path, const SurfacePoint& point, const Rgb& emission) {
  float weight = 1.0f;
  if (path.density > 0.0f) {
    const Vec3 to_point = point.position - path.position;
    const float distance = glm::length(to_point);
    const float other =
        distance > 0.0f ? patch_density(in.lamp, path.position, path.normal, to_point / distance, distance) : 0.0f;
    weight = power_heuristic(path.density, other);
  }
  path.light += glm::max(path.throughput * (emission * weight), Rgb(0.0f));
}

inline void look_for_light(const Input& in, Path& path, const SurfacePoint& point, const Rgb& albedo, const Vec2& u,
                           RayCounts& counts) {
  PatchSample s;
  if (!sample_patch(in.lamp, point.position, point.normal, u, s) || !(s.density > 0.0f)) return;
  const float cosine = glm::dot(point.normal, s.direction);
  if (cosine <= 0.0f || glm::dot(point.face_normal, s.direction) <= 0.0f) return;
  const float density = cosine * kInvPi;
  const Rgb arriving = in.lamp_radiance * (power_heuristic(s.density, density) / s.density);
  Ray ray;
  ray.origin = offset_origin(point, s.direction);
  ray.direction = s.direction;
  ray.t_max = shadow_end(ray.origin, s.distance);
  ray.mask = kVisibleShadow;
  counts.shadow++;
  if (in.scene.rays.occluded(ray)) return;
  path.light += glm::max((path.throughput * arriving) * (albedo * density), Rgb(0.0f));
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
    const Paint& paint = in.paints[point.material];
    if (!is_black(paint.emission)) emitted(in, path, point, paint.emission);
    if (vertex > in.diffuse_bounces) return;
    sampler.set_dimension(kCameraDimensions + vertex * kVertexDimensions + 1);
    const float u_end = sampler.next1();
    const Vec2 u_lamp = sampler.next2();
    if (is_black(paint.albedo)) return;
    look_for_light(in, path, point, paint.albedo, u_lamp, counts);
    sampler.set_dimension(kCameraDimensions + vertex * kVertexDimensions + 6);
    if (!scatter(path, point, paint.albedo, sampler.next2())) return;
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
        Sampler sampler(hash(pixel_seed, i % kBatchCount), i / kBatchCount);
        const Vec2 in_pixel = in.film.filter().offset(sampler.next2());
        Path path;
        path.ray = in.camera.ray(Vec2(float(x) + 0.5f, float(y) + 0.5f) + in_pixel, Vec2(0.5f)).ray;
        path.ray.mask = kVisibleCamera;
        walk(in, path, sampler, counts);
        for (int c = 0; c < 3; ++c) sums[layout[Pass::kCombined] + c] += path.light[c];
        sums[layout[Pass::kBatches] + int(i % kBatchCount)] += luminance(path.light);
      }
      in.film.add(x, y, sums, request.count);
    }
}

}  // namespace afterglow::bare
