// SPDX-License-Identifier: GPL-3.0-or-later
// What must be the same for two renders to be of one picture: see running_estimate.h.
#include "render/running_estimate.h"

#include <tuple>

namespace afterglow {

namespace {

constexpr const char* kName = "running estimate";
constexpr uint32_t kMost = 1u << 20;  // samples; a sum of 32-bit floats knows them all

auto fields(const Camera& c) {
  return std::tie(c.kind, c.transform, c.window, c.clip, c.aperture_radius, c.focus_distance, c.aperture_rotation,
                  c.aperture_ratio, c.aperture_blades, c.panorama);
}

}  // namespace

bool same_view(const Camera& one, const Camera& other) { return fields(one) == fields(other); }

std::shared_ptr<Film> RunningEstimate::take(const CommittedScene& scene, const RenderSettings& settings,
                                            const FilmSettings& film, uint32_t& samples) {
  const auto kept = scene.kept.take<RunningEstimate>(kName);
  if (!kept || settings.local_view_set || kept->settings_.local_view_set) return nullptr;
  SceneChanges changes = scene.scene.changes_since(kept->version_);
  changes.camera = false;
  const RenderSettings& before = kept->settings_;
  if (!changes.empty() || !same_view(kept->camera_, scene.scene.camera())) return nullptr;
  if (before.method != settings.method || before.method_settings != settings.method_settings ||
      before.seed == settings.seed || kept->film_->settings() != film || kept->samples_ >= kMost)
    return nullptr;
  samples = kept->samples_;
  return kept->film_;
}

std::shared_ptr<Film> RunningEstimate::take_carried(const CommittedScene& scene, const RenderSettings& settings,
                                                    const FilmSettings& film, int64_t& seed) {
  const auto kept = scene.kept.take<RunningEstimate>(kName);
  if (!kept || !kept->film_->carries() || kept->film_->settings() != film) return nullptr;
  RenderSettings same = settings;
  same.seed = kept->settings_.seed;
  if (!kept->settings_.same_samples(same) || !same_view(kept->camera_, scene.scene.camera())) return nullptr;
  seed = same.seed;
  return kept->film_;
}

void RunningEstimate::leave(const CommittedScene& scene, const RenderSettings& settings, std::shared_ptr<Film> film,
                            uint32_t samples) {
  auto kept = std::make_unique<RunningEstimate>();
  kept->film_ = std::move(film);
  kept->settings_ = settings;
  kept->camera_ = scene.scene.camera();
  kept->version_ = scene.scene.version();
  kept->samples_ = samples;
  scene.kept.leave(kName, std::move(kept));
}

}  // namespace afterglow
