// SPDX-License-Identifier: GPL-3.0-or-later
// Methods that serve every light term take requests as they are; for the others the camera's paths are walked here.
#include "render/renderer.h"

#include <chrono>
#include <cstdio>
#include <fstream>

#include "base/errors.h"
#include "render/sight.h"

namespace afterglow {

std::string Renderer::chosen(const std::string& method, bool viewport) {
  return method != "AUTO" ? method : viewport ? "INSTANT_CACHE" : "PATH_TRACING";
}

Renderer::Renderer(const std::string& method) : id_(chosen(method, false)), method_(make_method(id_)) {}

std::unique_ptr<Renderer> Renderer::take(const CommittedScene& scene, const std::string& method) {
  auto renderer = std::make_unique<Renderer>(method);
  auto kept = scene.kept.take<Renderer>(renderer->id_);
  return kept ? std::move(kept) : std::move(renderer);
}

void Renderer::leave(const CommittedScene& scene, std::unique_ptr<Renderer> renderer) {
  if (renderer->method_->traits().terms == kAllTerms) return;
  const std::string name = renderer->id_;
  scene.kept.leave(name, std::move(renderer));
}

void Renderer::configure(const Settings& given) {
  const Settings settings = with_defaults(given);
  settings_ = WalkSettings{};
  settings_.configure(settings);
  method_->configure(settings);
  times_ = WavefrontTimes{};
}

void Renderer::update(const CommittedScene& scene, Work& work) {
  method_->update(scene, scene.scene.changes_since(version_), work);
  version_ = scene.scene.version();
}

void Renderer::render(const CommittedScene& scene, std::span<const PixelRequest> requests, Film& film, Work& work) {
  if (method_->traits().terms == kAllTerms) return method_->render(scene, requests, film, work);
  render_wavefronts(*method_, scene, requests, film, work, settings_, times_, wave_);
}

void Renderer::look(const CommittedScene& scene, Film& film, uint32_t samples, uint32_t least, Work& work) {
  const auto begun = std::chrono::steady_clock::now();
  uint64_t left = kSightMost * film.width() * film.height();
  const auto more = [&](uint32_t wanted, int near) {
    if (!left || work.stop.stop()) return false;
    const std::vector<PixelRequest> requests = sight_requests(film, wanted, near, left);
    afterglow::look(scene, requests, film, work, settings_, times_.counts);
    for (const PixelRequest& r : requests) times_.looks += r.count, left -= std::min<uint64_t>(left, r.count);
    return !requests.empty();
  };
  const uint32_t wanted = sight_wanted(samples, least);
  int rounds = 0;
  while (rounds < kFindingRounds && more(std::min(kFindingRays, wanted), kFindingNear)) rounds++;
  if (rounds || film.looked()) more(wanted, 1);
  times_.look += std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  film.set_looked(samples);
}

void Renderer::save(const CommittedScene& scene, const std::string& path) const {
  const std::vector<char> bytes =
      version_ == scene.scene.version() ? method_->save(scene) : std::vector<char>{};  // edits since then forget it
  if (bytes.empty()) throw InvalidInput("method " + id_ + " remembers nothing of this scene that could be saved");
  const std::string part = path + ".part";
  std::ofstream file(part, std::ios::binary | std::ios::trunc);
  file.write(bytes.data(), std::streamsize(bytes.size()));
  file.close();
  if (!file || std::rename(part.c_str(), path.c_str()) != 0) {  // std::filesystem would ask for a newer C++ library
    std::remove(part.c_str());
    throw FileError("the cache could not be written to '" + path + "'");
  }
}

void Renderer::load(const CommittedScene& scene, const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  const std::vector<char> bytes((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  if (!file && !file.eof()) throw FileError("the cache could not be read from '" + path + "'");
  method_->load(scene, bytes);
  version_ = scene.scene.version();
}

MethodStatistics Renderer::statistics() const {
  MethodStatistics s = method_->statistics();
  if (method_->traits().terms == kAllTerms) return s;
  const auto add = [&](const char* name, double value) { s.values.emplace_back(name, value); };
  add("camera_rays", double(times_.counts.camera));
  add("bounce_rays", double(times_.counts.bounce));
  add("shadow_rays", double(times_.counts.shadow));
  add("dropped", double(times_.counts.dropped + times_.dropped));
  add("looks", double(times_.looks));
  add("questions", double(times_.points));
  add("holes", double(times_.holes));
  add("seconds_walk", times_.walk);
  add("seconds_gather", times_.gather);
  add("seconds_prepare", times_.prepare);
  add("seconds_filter", times_.filter);
  add("seconds_film", times_.film);
  add("seconds_look", times_.look);
  return s;
}

}  // namespace afterglow
