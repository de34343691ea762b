// SPDX-License-Identifier: GPL-3.0-or-later
// Gathering from virtual point lights, interleaved 3 × 3 (Keller and Heidrich 2001): see instant_radiosity.h.
// Equations: Debattista et al. 2009, (1) with radiant intensities normalised by light paths, (2), (3).
#include "methods/instant_radiosity/instant_radiosity.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <mutex>
#include <utility>

#include "methods/virtual_light_settings.h"
#include "methods/walk_settings.h"
#include "transport/light_importance.h"
#include "transport/short_rays.h"

namespace afterglow::instant_radiosity {

namespace {

constexpr uint32_t kInterleave = 3, kParts = kInterleave * kInterleave;

class InstantRadiosity final : public IndirectMethod {
 public:
  MethodTraits traits() const override { return {.interleave = lights_settings_.interleave ? kInterleave : 1}; }

  void configure(const Settings& settings) override {
    settings_.configure(settings);
    lights_settings_.configure(settings);
    stale_ = true;
  }

  void update(const CommittedScene& scene, const SceneChanges& changes, Work& work) override {
    shown_.clear();
    if (work.shown) shown_ = *work.shown;
    const SceneChanges& c = changes;
    SceneChanges seen = c;
    seen.camera = false;
    const Viewpoint viewpoint = snapped_viewpoint(scene);
    const bool other_view = std::exchange(viewpoint_, viewpoint) != viewpoint && emission_.far();
    if (!stale_ && !other_view && seen.empty()) return;
    stale_ = false;
    const auto begun = std::chrono::steady_clock::now();
    emission_.build(scene.scene, scene.materials);
    std::vector<VirtualLight> lights = trace_virtual_lights(
        walk(scene), emission_, lights_settings_.options(settings_.limits, work.threads), path_rays_);
    bound_ = lights_settings_.bound_length(scene.scene.bounds(), lights);
    alive_ = 0;
    std::array<std::vector<VirtualLight>, kParts> parts;
    uint32_t next = 0;
    for (const VirtualLight& light : lights) {
      if (light.black()) continue;
      alive_++;
      parts[next++ % kParts].push_back(light);
    }
    for (uint32_t i = 0; i < kParts; ++i) parts_[i].fill(std::move(parts[i]));
    whole_.fill(std::move(lights));
    seconds_lights_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  }

  bool refine(const CommittedScene&, Work&) override { return false; }
  void prepare(const CommittedScene&, std::span<const CachePoint>, Work&) override {}

  void gather(const CommittedScene& scene, std::span<const CachePoint> points,
              std::span<Answer> answers) const override {
    RayCounts counts;
    const WalkScene walked = walk(scene);
    std::array<std::vector<uint32_t>, kParts + 1> asking;  // points that ask a part of the lights, and all of them
    for (uint32_t i = 0; i < points.size(); ++i) {
      const CachePoint& p = points[i];
      const bool shares = lights_settings_.interleave && p.layer == 0 && !p.translucent;
      asking[shares ? (p.x % kInterleave + kInterleave * (p.y % kInterleave) + p.sample) % kParts : kParts].push_back(
          i);
    }
    std::vector<float> terms;
    for (uint32_t part = 0; part <= kParts; ++part) {
      const std::span<const uint32_t> all = asking[part];
      for (size_t i = 0; i < all.size(); i += RayCaster::kTogether)
        gather_together(walked, part, points, all.subspan(i, std::min(all.size() - i, RayCaster::kTogether)), answers,
                        terms, counts);
    }
    const VirtualLightSettings& s = lights_settings_;
    if (s.short_rays) {
      std::vector<ShortRayStop> stops;
      const ShortRays nearby(walked, whole_, plan_slots(s.count, s.options(settings_.limits, 0).bounces), bound_,
                             s.short_rays);
      for (size_t i = 0; i < points.size(); ++i) {
        const CachePoint& p = points[i];
        const uint32_t number = hash(hash(p.x, p.y, p.sample), p.layer);
        answers[i].light += nearby.gather({p.position, p.bent, p.face_normal, p.error, number}, stops, counts);
      }
    }
    const std::lock_guard lock(mutex_);
    gather_rays_ += counts;
  }

  void render(const CommittedScene&, std::span<const PixelRequest>, Film&, Work&) override {}

  MethodStatistics statistics() const override {
    return {{{"virtual_lights", double(alive_)},
             {"path_rays", double(path_rays_.bounce)},
             {"visibility_rays", double(gather_rays_.shadow)},
             {"seconds_lights", seconds_lights_}}};
  }

 private:
  WalkScene walk(const CommittedScene& scene) const {
    return {scene, settings_.limits, shown_.empty() ? nullptr : &shown_, false};
  }

  /// Points that ask the same lights stand three pixels apart: their rays to each light stay together.
  void gather_together(const WalkScene& walked, uint32_t part, std::span<const CachePoint> points,
                       std::span<const uint32_t> which, std::span<Answer> answers, std::vector<float>& terms,
                       RayCounts& counts) const {
    const VirtualLightColumns& lights = part < kParts ? parts_[part] : whole_;
    const size_t row = lights.padded();
    terms.resize(which.size() * row);
    std::array<Rgb, RayCaster::kTogether> sums{};
    for (size_t i = 0; i < which.size(); ++i)
      geometry_terms(lights, points[which[i]].position, points[which[i]].bent, bound_, terms.data() + i * row);
    std::array<Ray, RayCaster::kTogether> rays;
    std::array<Rgb, RayCaster::kTogether> brings, seen;
    std::array<uint32_t, RayCaster::kTogether> whose;
    for (uint32_t k = 0; k < lights.count; ++k) {
      const VirtualLight& light = lights.lights[k];
      size_t asked = 0;
      for (uint32_t i = 0; i < which.size(); ++i) {
        const float g = terms[i * row + k];
        if (g == 0.0f) continue;
        const CachePoint& p = points[which[i]];
        const Rgb& intensity = g > 0.0f ? light.front : light.back;
        if (is_black(intensity) || !can_see(p.position, p.face_normal, light, g > 0.0f)) continue;
        rays[asked] = visibility_ray(p.position + p.error * p.face_normal, light);
        brings[asked] = std::fabs(g) * intensity, whose[asked++] = i;
      }
      visibility(walked, std::span(rays).first(asked), seen, counts);
      for (size_t j = 0; j < asked; ++j) sums[whose[j]] += brings[j] * seen[j];
    }
    const float share = part < kParts ? float(kParts) : 1.0f;
    for (size_t i = 0; i < which.size(); ++i) answers[which[i]] = {share * sums[i], 1.0f, 0.0f};
  }

  WalkSettings settings_;
  VirtualLightSettings lights_settings_;
  LightEmission emission_;
  Viewpoint viewpoint_;  // that the lights were traced for
  InstanceMask shown_;
  std::array<VirtualLightColumns, kParts> parts_;
  VirtualLightColumns whole_;
  float bound_ = 0.0f;
  bool stale_ = true;
  uint32_t alive_ = 0;
  RayCounts path_rays_;
  double seconds_lights_ = 0.0;
  mutable std::mutex mutex_;
  mutable RayCounts gather_rays_;
};

}  // namespace

MethodDescription describe() {
  MethodDescription d;
  d.id = "INSTANT_RADIOSITY";
  d.label = "Instant Radiosity";
  d.description =
      "Virtual point lights asked by every pixel anew: no noise, but nothing is remembered. No caustics on diffuse "
      "surfaces that are seen directly; corners are too dark without short rays";
  VirtualLightSettings::describe(d.settings);
  d.settings.push_back({"interleave", "Interleave",
                        "Neighbouring pixels ask different parts of the lights and share what they find", "", true, 0.0,
                        1.0});
  d.statistics = {"virtual_lights", "path_rays", "visibility_rays", "seconds_lights"};
  return d;
}

std::unique_ptr<IndirectMethod> make() { return std::make_unique<InstantRadiosity>(); }

}  // namespace afterglow::instant_radiosity
