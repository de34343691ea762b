// SPDX-License-Identifier: GPL-3.0-or-later
// Walks of short rays: see short_rays.h.
#include "transport/short_rays.h"

#include <algorithm>

#include "lights/shapes.h"

namespace afterglow {

namespace {

constexpr uint32_t kDimensions = 12;  // of a vertex
constexpr int kMostPassages = 16;     // transparent surfaces before one that is met

float sum(const Rgb& c) { return c.x + c.y + c.z; }

}  // namespace

Rgb ShortRays::gather(const Vec3& position, const Vec3& normal, const Vec3& face_normal, float error, uint32_t seed,
                      std::vector<float>& terms, RayCounts& counts) const {
  Rgb total(0.0f);
  const uint32_t bounces = uint32_t(plan_.paths.size());
  if (!count_ || !(bound_ > 0.0f) || !bounces) return total;
  const float reach = 1.2f * bound_;
  for (uint32_t k = 0; k < count_; ++k) {
    Sampler sampler(seed, k);
    Rgb throughput(1.0f), found(0.0f);
    PathContext context;
    context.kind = PathContext::kDiffuse | PathContext::kReflection;
    context.drop_glossy = !walk_.limits.caustics_reflective,
    context.drop_refractive = !walk_.limits.caustics_refractive;
    Vec3 from = position, around = normal, face = face_normal, lifted = position + error * face_normal;
    // As paths are counted: what a translucent surface lets through is not a diffuse bounce.
    uint32_t reflected = 1, transmitted = 0;
    for (uint32_t depth = 1; depth <= std::max(walk_.limits.max_bounces, 1u); ++depth) {
      sampler.set_dimension(kDimensions * (depth - 1));
      const Vec2 way = sampler.next2(), place = sampler.next2();
      const float u_light = sampler.next1(), u_virtual = sampler.next1(), u_side = sampler.next1(),
                  u_straight = sampler.next1();
      Ray ray;
      ray.origin = lifted;
      ray.direction = glm::normalize(Frame(around).to_world(square_to_cosine_hemisphere(way)));
      if (glm::dot(ray.direction, face) <= 0.0f) break;
      ray.t_max = reach, ray.mask = kVisibleDiffuse;
      context.depth = uint16_t(depth);
      SurfacePoint point;
      Surface surface, diffuse;
      if (!meet(ray, from, u_straight, context, point, surface, throughput, counts)) break;
      throughput *= 1.0f - smooth_bound(0.8f * bound_, reach, glm::distance(from, point.position));
      split_diffuse(surface, diffuse);
      Rgb albedo[2] = {Rgb(0.0f), Rgb(0.0f)};
      for (int i = 0; i < diffuse.count; ++i)
        albedo[diffuse.lobes[i].kind == LobeKind::kTranslucent] += diffuse.lobes[i].weight;
      const float weight[2] = {sum(albedo[0]), sum(albedo[1])};
      if (!(weight[0] + weight[1] > 0.0f) || is_black(throughput)) break;
      Rgb direct;
      bool back;
      if (from_emitters(point, context, weight[1] > 0.0f, u_light, place, direct, back, counts))
        found += throughput * albedo[back] * direct;
      const bool side = u_side * (weight[0] + weight[1]) >= weight[0];
      throughput *= albedo[side] * ((weight[0] + weight[1]) / weight[side]);
      (side ? transmitted : reflected)++;
      if (depth >= walk_.limits.max_bounces || reflected > bounces || transmitted > walk_.limits.transmission) break;
      const uint32_t left = bounces - std::min(side ? reflected : reflected - 1, bounces);
      if (left) {
        const uint32_t slots = left < bounces ? plan_.first[left] : plan_.slots;
        found += throughput * from_lights(point, side, slots, u_virtual, terms, counts);
      }
      from = point.position, around = side ? -point.normal : point.normal;
      face = side ? -point.face_normal : point.face_normal;
      lifted = from + point.error * face;
      context.kind = PathContext::kDiffuse | (side ? PathContext::kTransmission : PathContext::kReflection);
    }
    if (is_finite(found)) total += glm::max(found, Rgb(0.0f));
  }
  return total / float(count_);
}

/// The first surface that light does not go straight through.
bool ShortRays::meet(Ray& ray, const Vec3& from, float u, PathContext& context, SurfacePoint& point, Surface& surface,
                     Rgb& throughput, RayCounts& counts) const {
  const CommittedScene& scene = walk_.scene;
  const float reach = ray.t_max;
  for (int passage = 0; passage < kMostPassages; ++passage) {
    Hit hit;
    counts.bounce++;
    if (!scene.rays.closest(ray, hit)) return false;
    point = surface_point(scene.scene, ray, hit, walk_.with_uv);
    if (!walk_.with_uv && scene.materials.reads_uv(point.material)) point.uv = surface_uv(scene.scene, point);
    if (walk_.shows(hit.instance)) {
      context.ray_length = hit.t;
      scene.materials.shade(scene.scene, point, context, surface);
      const float through = sum(surface.transparency);
      if (!(through > 0.0f)) return true;
      float rest = 0.0f;
      for (int i = 0; i < surface.count; ++i) rest += sum(surface.lobes[i].weight);
      const float chance = rest > 0.0f ? through / (through + rest) : 1.0f;
      if (u >= chance) {
        throughput /= 1.0f - chance;
        return true;
      }
      throughput *= surface.transparency / chance;
      u /= chance;
    }
    ray.origin = offset_origin(point, ray.direction);
    ray.t_min = 0.0f, ray.t_max = reach - glm::distance(from, point.position);
    context.transparent_depth++;
    if (!(ray.t_max > 0.0f)) return false;
  }
  return false;
}

/// Irradiance by one sample of the emitters, on the side that it comes to.
bool ShortRays::from_emitters(const SurfacePoint& point, const PathContext& context, bool both_sides, float u_light,
                              const Vec2& u, Rgb& light, bool& back, RayCounts& counts) const {
  LightSample s;
  if (!walk_.scene.lights.sample(point.position, both_sides ? Vec3(0.0f) : point.normal, u_light, u, s)) return false;
  if (!(s.visibility & kVisibleDiffuse)) return false;
  const float cosine = glm::dot(s.direction, point.normal);
  back = cosine < 0.0f;
  if ((back && !both_sides) || cosine * glm::dot(s.direction, point.face_normal) <= 0.0f) return false;
  light = s.radiance * (std::fabs(cosine) / s.density);
  if (is_black(light) || !is_finite(light)) return false;
  if (!s.cast_shadow) return true;
  const Ray ray = shadow_ray(point, s);
  counts.shadow++;
  if (!walk_.shown && !walk_.scene.effects.has(kTransparency)) return !walk_.scene.rays.occluded(ray);
  light *= transmittance(walk_, ray, context, counts);
  return !is_black(light);
}

/// Irradiance of the first slots' lights on one side, by one of them that is chosen by what it would bring unhidden.
Rgb ShortRays::from_lights(const SurfacePoint& point, bool back, uint32_t slots, float u, std::vector<float>& terms,
                           RayCounts& counts) const {
  const Vec3 normal = back ? -point.normal : point.normal, face = back ? -point.face_normal : point.face_normal;
  geometry_terms(lights_, point.position, normal, bound_, terms.data());
  const auto bring = [&](uint32_t k) {
    const auto& light = terms[k] > 0.0f ? lights_.front : lights_.back;
    return std::fabs(terms[k]) * (light[0][k] + light[1][k] + light[2][k]);
  };
  float all = 0.0f;
  for (uint32_t k = 0; k < slots; ++k) all += bring(k);
  if (!(all > 0.0f) || !std::isfinite(all)) return Rgb(0.0f);
  float target = u * all;
  uint32_t chosen = kNone;
  for (uint32_t k = 0; k < slots; ++k) {
    const float b = bring(k);
    if (!(b > 0.0f)) continue;
    chosen = k;
    if ((target -= b) < 0.0f) break;
  }
  const VirtualLight& light = lights_.lights[chosen];
  const bool front = terms[chosen] > 0.0f;
  if (!can_see(point.position, face, light, front)) return Rgb(0.0f);
  const Ray ray = visibility_ray(point.position + point.error * face, light);
  return (front ? light.front : light.back) * (std::fabs(terms[chosen]) * all / bring(chosen)) *
         visibility(walk_, ray, counts);
}

}  // namespace afterglow
