// SPDX-License-Identifier: GPL-3.0-or-later
// What the cache holds, as colours instead of light: which record answers where, what the last edit did to it, how many
// rays that took, and where the virtual lights are. For people who look for the cause of a blotch.
#include <algorithm>

#include "base/sampler.h"
#include "methods/instant_cache/cache.h"

namespace afterglow::instant_cache {

namespace {

constexpr float kCentre = 0.12f;      // of a record's radius: its middle is drawn white
constexpr float kLightPixels = 3.0f;  // radius of a virtual light's dot
constexpr Rgb kReused{0.08f, 0.12f, 0.3f}, kUpdated{0.9f, 0.6f, 0.05f}, kNew{0.1f, 0.7f, 0.15f};

Rgb any_colour(uint32_t number) {
  const auto part = [&](uint32_t which) { return 0.08f + 0.72f * float(hash(number, which) >> 8) * 0x1p-24f; };
  return {part(1), part(2), part(3)};
}

/// Dark blue, green, yellow, red.
Rgb heat(float share) {
  const float t = std::clamp(share, 0.0f, 1.0f);
  const auto bump = [&](float at) { return std::clamp(1.5f - std::fabs(4.0f * t - at), 0.0f, 1.0f); };
  return {0.02f + 0.9f * bump(3.0f), 0.02f + 0.8f * bump(2.0f), 0.05f + 0.8f * bump(1.0f)};
}

}  // namespace

/// The light of the nearest virtual light whose dot covers the point; elsewhere a dim picture of bounced light.
Rgb Cache::show_lights(const CachePoint& p, float bounced) const {
  float nearest = kLightPixels * p.footprint;
  nearest *= nearest;
  const VirtualLight* found = nullptr;
  for (uint32_t k = 0; k < lights_.count; ++k) {
    const VirtualLight& light = lights_.lights[k];
    const Vec3 way = light.position - p.position;
    const float d2 = glm::dot(way, way);
    if (light.black() || !(d2 < nearest)) continue;
    nearest = d2, found = &light;
  }
  if (!found) return Rgb(0.03f + 0.1f * std::min(bounced, 1.0f));
  const Rgb sum = found->front + found->back;
  return sum / std::max(max_component(sum), 1e-30f);
}

Answer Cache::show(View view, const CachePoint& p) const {
  const Answer light = answer(p);
  if (!(light.weight > 0.0f)) return light;
  if (view == View::kLights) return {show_lights(p, luminance(light.light)), kAsItIs, 0.0f};
  const float limit = spacing_.most_pixels * p.footprint;
  float best = 1.0f;
  uint32_t record = kNone;
  std::vector<uint32_t> near;
  octree_.find_near({p.position, p.position}, 1.0f / limit, p.instance, near);
  for (const uint32_t r : near) {
    const float distance = distance_to_record(octree_.entry(r), p, limit, spacing_.angle_scale);
    if (distance < best) best = distance, record = r;
  }
  if (record == kNone) return {};
  const Record& r = records_[record];
  Rgb colour(0.0f);
  if (view == View::kRecords) colour = any_colour(hash(r.place.triangle, uint32_t(r.place.u * 65536.0f)));
  if (view == View::kChanges) colour = r.born == update_ ? kNew : r.asked == update_ ? kUpdated : kReused;
  if (view == View::kRays)
    colour = heat(r.asked == update_ ? float(r.rays) / float(std::max(lights_.count, 1u)) : 0.0f);
  if (best < kCentre) colour = view == View::kRecords ? Rgb(1.0f) : 0.5f * colour;
  return {colour, kAsItIs, 0.0f};
}

}  // namespace afterglow::instant_cache
