// SPDX-License-Identifier: GPL-3.0-or-later
// Walks of short rays: see short_rays.h.
#include "transport/short_rays.h"

#include <algorithm>

#include "base/packing.h"
#include "lights/shapes.h"

namespace afterglow {

namespace {

constexpr uint32_t kDimensions = 12;  // of a vertex
// Way and place of the lamp stand in one block: the points of all walks are even in all four dimensions.
constexpr uint32_t kWay = 0, kLamp = 2, kLight = 5, kSide = 6, kGroupChoice = 8;
constexpr int kMostPassages = 16;  // transparent surfaces before one that is met
using Stop = ShortRayStop;

float sum_of(const Rgb& c) { return c.x + c.y + c.z; }

Sampler sampler_at(const ShortRayPlace& place, uint32_t index, uint32_t depth, uint32_t dimension) {
  Sampler sampler(place.seed, index);
  sampler.set_dimension(kDimensions * (depth - 1) + dimension);
  return sampler;
}

}  // namespace

ShortRays::ShortRays(const WalkScene& walk, const VirtualLightColumns& lights, SlotPlan plan, float bound,
                     uint32_t count)
    : walk_(walk), lights_(lights), plan_(std::move(plan)), bound_(bound), count_(count) {
  const Vec3 size = walk.scene.scene.bounds().size();
  far_ = 4.0f * (size.x + size.y + size.z);
  if (!(bound_ > 0.0f) || plan_.paths.empty()) count_ = 0;
}

Rgb ShortRays::gather(const ShortRayPlace& place, std::vector<Stop>& stops, RayCounts& counts) const {
  stops.clear();
  for (uint32_t k = 0; k < count_; ++k) walk(place, k, stops, counts);
  return sum(stops);
}

Rgb ShortRays::sum(std::span<const Stop> stops) const {
  Rgb total(0.0f);
  for (const Stop& stop : stops) total += stop.light;
  return count_ ? total / float(count_) : total;
}

bool ShortRays::direction(const ShortRayPlace& place, uint32_t index, uint32_t depth, const Vec3& around,
                          const Vec3& face, Vec3& out) const {
  const Vec2 way = sampler_at(place, index, depth, kWay).next2();
  out = glm::normalize(Frame(around).to_world(square_to_cosine_hemisphere(way)));
  return glm::dot(out, face) > 0.0f;
}

void ShortRays::walk(const ShortRayPlace& place, uint32_t index, std::vector<Stop>& stops, RayCounts& counts) const {
  const uint32_t bounces = uint32_t(plan_.paths.size());
  Rgb throughput(1.0f);
  PathContext context;
  context.kind = PathContext::kDiffuse | PathContext::kReflection;
  context.drop_glossy = !walk_.limits.caustics_reflective, context.drop_refractive = !walk_.limits.caustics_refractive;
  Vec3 from = place.position, around = place.normal, face = place.face_normal;
  float error = place.error;
  // As paths are counted: what a translucent surface lets through is not a diffuse bounce.
  uint32_t reflected = 1, transmitted = 0;
  const uint32_t deepest = std::clamp(walk_.limits.max_bounces, 1u, 255u);
  for (uint32_t depth = 1; depth <= deepest; ++depth) {
    Ray ray;
    ray.origin = from + error * face;
    if (!direction(place, index, depth, around, face, ray.direction)) return;
    ray.t_max = reach(), ray.mask = kVisibleDiffuse;
    context.depth = uint16_t(depth);
    Sampler sampler = sampler_at(place, index, depth, kSide);
    const float u_side = sampler.next1(), u_straight = sampler.next1();
    SurfacePoint point;
    Surface surface, diffuse;
    if (!meet(ray, from, u_straight, context, point, surface, throughput, counts)) return;
    throughput *= 1.0f - smooth_bound(0.8f * bound_, reach(), glm::distance(from, point.position));
    split_diffuse(surface, diffuse);
    Rgb albedo[2] = {Rgb(0.0f), Rgb(0.0f)};
    for (int i = 0; i < diffuse.count; ++i)
      albedo[diffuse.lobes[i].kind == LobeKind::kTranslucent] += diffuse.lobes[i].weight;
    const float weight[2] = {sum_of(albedo[0]), sum_of(albedo[1])};
    Stop stop;
    stop.position = point.position, stop.error = point.error;
    stop.normal = pack_direction(point.normal), stop.face_normal = pack_direction(point.face_normal);
    stop.walk = uint16_t(index), stop.depth = uint8_t(depth);
    if (!(weight[0] + weight[1] > 0.0f) || is_black(throughput)) {
      stops.push_back(stop);  // brings nothing, but when it leaves, what is behind it may
      return;
    }
    for (int side : {0, 1}) stop.weight[side] = pack_color(throughput * albedo[side]);
    stop.choice = uint16_t(sampler_at(place, index, depth, kGroupChoice).next1() * 65536.0f);
    stop.flags = Stop::kLampStale;
    const bool back = u_side * (weight[0] + weight[1]) >= weight[0];
    throughput *= albedo[back] * ((weight[0] + weight[1]) / weight[back]);
    (back ? transmitted : reflected)++;
    if (back) stop.flags |= Stop::kBack;
    const bool ends = depth >= deepest || reflected > bounces || transmitted > walk_.limits.transmission;
    if (!ends) {
      stop.flags |= Stop::kGoesOn;
      stop.left = uint8_t(std::min(bounces - std::min(back ? reflected : reflected - 1, bounces), 255u));
    }
    find_light(place, stop, counts);
    stops.push_back(stop);
    if (ends) return;
    from = point.position, error = point.error;
    const float side = back ? -1.0f : 1.0f;
    around = side * unpack_direction(stop.normal), face = side * unpack_direction(stop.face_normal);
    context.kind = PathContext::kDiffuse | (back ? PathContext::kTransmission : PathContext::kReflection);
  }
}

void ShortRays::find_light(const ShortRayPlace& place, Stop& stop, RayCounts& counts) const {
  if (!stop.weight[0] && !stop.weight[1]) {
    stop.flags &= uint8_t(~(Stop::kStale | Stop::kLampStale));
    return;
  }
  if (stop.flags & Stop::kLampStale) {
    Sampler sampler = sampler_at(place, stop.walk, stop.depth, kLamp);
    const Vec2 u = sampler.next2();
    const float u_lamp = sampler.next1();
    SurfacePoint point;
    point.position = stop.position, point.error = stop.error;
    point.normal = unpack_direction(stop.normal), point.face_normal = unpack_direction(stop.face_normal);
    stop.lamp_light = pack_color(from_emitters(point, stop, u_lamp, u, counts));
  }
  Rgb found = unpack_color(stop.lamp_light);
  if (stop.left) found += from_lights(stop, sampler_at(place, stop.walk, stop.depth, kLight).next1(), counts);
  stop.light = is_finite(found) ? glm::max(found, Rgb(0.0f)) : Rgb(0.0f);
  stop.flags &= uint8_t(~(Stop::kStale | Stop::kLampStale));
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
      const float through = sum_of(surface.transparency);
      if (!(through > 0.0f)) return true;
      float rest = 0.0f;
      for (int i = 0; i < surface.count; ++i) rest += sum_of(surface.lobes[i].weight);
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

/// What one sample of the emitters sends through here, on the side that it comes to.
Rgb ShortRays::from_emitters(const SurfacePoint& point, Stop& stop, float u_light, const Vec2& u,
                             RayCounts& counts) const {
  const bool known = stop.flags & Stop::kLampKnown;
  stop.flags &= uint8_t(~Stop::kLampKnown);
  LightSample s;
  const bool both_sides = stop.both_sides();
  if (!walk_.scene.lights.sample(point.position, both_sides ? Vec3(0.0f) : point.normal, u_light, u, s) ||
      !(s.visibility & kVisibleDiffuse))
    return Rgb(0.0f);
  const float cosine = glm::dot(s.direction, point.normal);
  const bool back = cosine < 0.0f;
  if ((back && !both_sides) || cosine * glm::dot(s.direction, point.face_normal) <= 0.0f) return Rgb(0.0f);
  const Rgb light = unpack_color(stop.weight[back]) * s.radiance * (std::fabs(cosine) / s.density);
  if (is_black(light) || !is_finite(light) || !s.cast_shadow) return light;
  const Ray ray = shadow_ray(point, s);
  const Vec3 end = ray.origin + ray.direction * std::min(ray.t_max, far_);
  if (!known || stop.lamp_end != end) {
    PathContext context;
    context.depth = stop.depth;
    counts.shadow++;
    stop.passes[0] = pack_transmittance(!walk_.shown && !walk_.scene.effects.has(kTransparency)
                                            ? Rgb(walk_.scene.rays.occluded(ray) ? 0.0f : 1.0f)
                                            : transmittance(walk_, ray, context, counts));
    stop.lamp_end = end;
  }
  stop.flags |= Stop::kLampKnown;
  return light * unpack_transmittance(stop.passes[0]);
}

/// Two groups as far from each other as can be; each is as likely as the others.
void ShortRays::groups(const Stop& stop, uint32_t (&found)[kGroups]) const {
  const uint32_t all = (slots(stop) + kGroup - 1) / kGroup;
  const float step = std::max(float(all) / float(kGroups), 1.0f), u = (float(stop.choice) + 0.5f) * 0x1p-16f;
  for (uint32_t i = 0; i < kGroups; ++i) found[i] = std::min(uint32_t((u + float(i)) * step), all - 1);
}

/// What the virtual lights send through here, by one of them: of two groups of slots, which depend on nothing else, the
/// one that is chosen by what it would bring unhidden (resampling, Talbot et al. 2005). Lights of other groups can do
/// what they want.
Rgb ShortRays::from_lights(Stop& stop, float u, RayCounts& counts) const {
  const uint32_t before = stop.flags & Stop::kLightKnown ? stop.chosen : kNone, most = slots(stop);
  stop.flags &= uint8_t(~Stop::kLightKnown);
  stop.chosen = kNone;
  const bool behind = stop.flags & Stop::kBack;
  const Vec3 normal = unpack_direction(stop.normal) * (behind ? -1.0f : 1.0f);
  uint32_t group[kGroups];
  groups(stop, group);
  float terms[kGroups * kGroup], brings[kGroups * kGroup];
  uint32_t count = 0;
  float all = 0.0f;
  for (uint32_t i = 0; i < kGroups; ++i) {
    if (i && group[i] == group[i - 1]) continue;
    const uint32_t first = group[i] * kGroup;
    geometry_terms(lights_, stop.position, normal, bound_, terms + count, first, kGroup);
    for (uint32_t k = 0; k < kGroup; ++k) {
      const float g = terms[count + k];
      const auto& light = g > 0.0f ? lights_.front : lights_.back;
      const float b = std::fabs(g) * (light[0][first + k] + light[1][first + k] + light[2][first + k]);
      all += brings[count + k] = first + k < most ? b : 0.0f;
    }
    count += kGroup;
  }
  if (!(all > 0.0f) || !std::isfinite(all)) return Rgb(0.0f);
  float target = u * all;
  uint32_t at = kNone;
  for (uint32_t k = 0; k < count; ++k) {
    if (!(brings[k] > 0.0f)) continue;
    at = k;
    if ((target -= brings[k]) < 0.0f) break;
  }
  const uint32_t chosen = group[at / kGroup] * kGroup + at % kGroup;
  const VirtualLight& light = lights_.lights[chosen];
  const bool front = terms[at] > 0.0f;
  const Vec3 face = unpack_direction(stop.face_normal) * (behind ? -1.0f : 1.0f);
  if (!can_see(stop.position, face, light, front)) return Rgb(0.0f);
  if (chosen != before)
    stop.passes[1] =
        pack_transmittance(visibility(walk_, visibility_ray(stop.position + stop.error * face, light), counts));
  stop.chosen = chosen, stop.flags |= Stop::kLightKnown;
  // As one side was chosen to go on from.
  const Rgb albedo[2] = {unpack_color(stop.weight[0]), unpack_color(stop.weight[1])};
  const float sides = (sum_of(albedo[0]) + sum_of(albedo[1])) / std::max(sum_of(albedo[behind]), 1e-30f);
  const float share = float((most + kGroup - 1) / kGroup) * float(kGroup) / float(count);
  return albedo[behind] * (front ? light.front : light.back) * unpack_transmittance(stop.passes[1]) *
         (std::fabs(terms[at]) * all / brings[at] * sides * share);
}

}  // namespace afterglow
