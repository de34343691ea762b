// SPDX-License-Identifier: GPL-3.0-or-later
// The path tracer as a method: its settings, and requests handed to the kernel that the scene's effects choose.
#include "methods/path_tracing/path_tracing.h"

#include <chrono>
#include <mutex>
#include <thread>

#include "base/parallel.h"
#include "methods/path_tracing/kernel.h"
#include "methods/walk_settings.h"

namespace afterglow::path_tracing {

namespace {

template <size_t... kIndices>
constexpr std::array<Kernel, sizeof...(kIndices)> kernel_table(std::index_sequence<kIndices...>) {
  return {render_request<uint32_t(kIndices)>...};
}

class PathTracing final : public IndirectMethod {
 public:
  MethodTraits traits() const override { return {.terms = kAllTerms, .exact = true}; }

  void configure(const Settings& settings) override { settings_.configure(settings); }

  void update(const CommittedScene&, const SceneChanges&, Work&) override {}
  bool refine(const CommittedScene&, Work&) override { return false; }
  void prepare(const CommittedScene&, std::span<const CachePoint>, Work&) override {}
  void gather(const CommittedScene&, std::span<const CachePoint>, std::span<Answer> answers) const override {
    for (Answer& answer : answers) answer = Answer{};
  }

  void render(const CommittedScene& scene, std::span<const PixelRequest> requests, Film& film, Work& work) override {
    const CameraRays camera(scene.scene.camera(), scene.scene.origin(), film.settings().width, film.settings().height);
    const bool with_uv = film.layout()[Pass::kUv] >= 0;
    const KernelInput input{.walk = {scene, settings_.limits, work.shown, with_uv},
                            .camera = camera,
                            .film = film,
                            .clamp_direct = settings_.clamp_direct,
                            .clamp_indirect = settings_.clamp_indirect,
                            .seed = hash(uint32_t(work.seed), uint32_t(work.seed >> 32)),
                            .stop = work.stop};
    const Kernel kernel = choose_kernel(kernel_features(scene.effects, film.settings().passes, work.shown));
    std::mutex mutex;
    parallel_blocks(
        requests.size(), 1, work.threads,
        [&](size_t begin, size_t end) {
          RayCounts counts;
          for (size_t i = begin; i < end && !work.stop.stop(); ++i) {
            while (work.pause && work.pause->load() && !work.stop.stop())
              std::this_thread::sleep_for(std::chrono::milliseconds(2));
            kernel(input, requests[i], counts);
            if (work.samples_done) *work.samples_done += sample_count(requests[i]);
          }
          const std::lock_guard lock(mutex);
          counts_ += counts;
        },
        work.stop);
  }

  MethodStatistics statistics() const override {
    return {{{"camera_rays", double(counts_.camera)},
             {"bounce_rays", double(counts_.bounce)},
             {"shadow_rays", double(counts_.shadow)},
             {"dropped", double(counts_.dropped)}}};
  }

 private:
  WalkSettings settings_;
  RayCounts counts_;
};

}  // namespace

Kernel choose_kernel(uint32_t features) {
  static constexpr auto kTable = kernel_table(std::make_index_sequence<kKernelCount>());
  return kTable[features];
}

uint32_t kernel_features(const Effects& effects, PassSet passes, bool local_view) {
  uint32_t features = 0;
  if (effects.has(kGlossy) || effects.has(kTransmission)) features |= kFeatureLobes;
  if (effects.has(kTransparency) || effects.has(kRayVisibility) || local_view) features |= kFeatureStraight;
  if (effects.has(kPunctualLights)) features |= kFeatureShapes;
  if (passes & ~kAlwaysKept) features |= kFeaturePasses;
  return features;
}

MethodDescription describe() {
  MethodDescription d;
  d.id = "PATH_TRACING";
  d.label = "Path Tracing";
  d.description =
      "Every path by itself: no bias but the limits set here, noise that halves with four times the samples";
  const auto bounces = [&](const char* name, const char* label, const char* text, int64_t value) {
    d.settings.push_back({name, label, text, "", value, 0.0, 1024.0});
  };
  bounces("max_bounces", "Max Bounces", "Scatterings of a path in all", 12);
  bounces("diffuse_bounces", "Diffuse", "Diffuse reflections of a path", 4);
  bounces("glossy_bounces", "Glossy", "Glossy reflections of a path", 4);
  bounces("transmission_bounces", "Transmission", "Passages through glass and the like", 12);
  bounces("transparent_max_bounces", "Transparent", "Transparent surfaces that a ray passes", 8);
  d.settings.push_back(
      {"sample_clamp_direct", "Clamp Direct", "Largest direct light of a sample; 0: not clamped", "", 0.0, 0.0, 1e8});
  d.settings.push_back({"sample_clamp_indirect", "Clamp Indirect", "Largest indirect light of a sample; 0: not clamped",
                        "", 0.0, 0.0, 1e8});
  d.settings.push_back(
      {"caustics_reflective", "Reflective Caustics", "Glossy lobes that diffuse light runs into", "", true, 0.0, 1.0});
  d.settings.push_back(
      {"caustics_refractive", "Refractive Caustics", "Glass that diffuse light runs into", "", true, 0.0, 1.0});
  d.statistics = {"camera_rays", "bounce_rays", "shadow_rays", "dropped"};
  return d;
}

std::unique_ptr<IndirectMethod> make() { return std::make_unique<PathTracing>(); }

}  // namespace afterglow::path_tracing
