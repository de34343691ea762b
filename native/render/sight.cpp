// SPDX-License-Identifier: GPL-3.0-or-later
// Which pixels get rays that only look, and these rays: see sight.h.
#include "render/sight.h"

#include <algorithm>
#include <bit>
#include <mutex>

#include "base/parallel.h"
#include "methods/path_tracing/film_visitor.h"
#include "methods/path_tracing/kernel_body.h"

namespace afterglow {

namespace {

constexpr float kContrast = 0.02f;  // of light met, over what is shown
constexpr float kFloor = 0.05f;     // of the image's mean, which counts as shown everywhere
constexpr uint32_t kMostWanted = 1024;
constexpr uint64_t kMostPerPixel = 8;  // on the average over the film
constexpr uint32_t kSeed = 0x51647u;

struct Met {
  float light = 0.0f, shown = -1.0f;  // luminances; shown below 0: no sample yet
};

template <uint32_t kFeatures>
void look_at(const path_tracing::KernelInput& in, const PixelRequest& request, RayCounts& counts) {
  const Walker<kFeatures & 7u> walker(in.walk, counts);
  path_tracing::FilmVisitor<true> visitor(in, counts);
  const FilmLayout& layout = in.film.layout();
  const uint32_t seed = hash(request.x, request.y, in.seed ^ kSeed);
  visitor.begin_pixel();
  for (uint32_t i = request.first; i < request.first + request.count; ++i) {
    Sampler sampler(seed, i);
    const Vec2 in_pixel = in.film.filter().offset(sampler.next2());
    const Vec2 on_lens = sampler.next2();
    const Vec2 middle(float(request.x) + 0.5f, float(request.y) + 0.5f);
    PathState path = path_tracing::path_from(in.camera, middle + in_pixel, on_lens, false);
    path.ray.mask = kVisibleCamera;
    path.last = true;  // it goes through what is transparent and no further
    visitor.begin_sample(path, 0);
    walker.walk(path, sampler, visitor);
  }
  const auto sum = [&](Pass pass) {
    const float* from = visitor.sums() + layout[pass];
    return Rgb(from[0], from[1], from[2]);
  };
  in.film.see(request.x, request.y, sum(Pass::kEmission), sum(Pass::kEnvironment), request.count);
}

}  // namespace

uint32_t sight_wanted(uint32_t samples) {
  return std::min(16u * (std::bit_floor(std::min(samples, kMostWanted)) + 1u), kMostWanted);
}

std::vector<PixelRequest> sight_requests(const Film& film, uint32_t wanted) {
  const FilmSettings& f = film.settings();
  const int width = int(film.width()), height = int(film.height());
  std::vector<Met> met(size_t(width) * size_t(height));
  double total = 0.0;
  for (size_t p = 0; p < met.size(); ++p) {
    const PixelNoise n = film.noise(p);
    if (!n.samples) continue;
    met[p] = {n.seen / float(n.samples), (n.sum + n.seen) / float(n.samples)};
    total += met[p].shown;
  }
  const float floor = kFloor * float(total / double(std::max<size_t>(met.size(), 1)));
  std::vector<PixelRequest> requests;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      float least = kInfinity, most = 0.0f, shown = 0.0f;
      int neighbours = 0;
      for (int j = std::max(0, y - 1); j <= std::min(height - 1, y + 1); ++j)
        for (int i = std::max(0, x - 1); i <= std::min(width - 1, x + 1); ++i) {
          const Met& m = met[size_t(j) * size_t(width) + size_t(i)];
          if ((i == x && j == y) || m.shown < 0.0f) continue;
          least = std::min(least, m.light), most = std::max(most, m.light);
          shown += m.shown, ++neighbours;
        }
      if (!neighbours || !(most - least > kContrast * (shown / float(neighbours) + floor))) continue;
      const size_t p = size_t(y) * size_t(width) + size_t(x);
      const uint32_t have = film.sight_samples(p);
      if (have < wanted / 2)
        requests.push_back({.x = uint16_t(f.x0 + uint32_t(x)),
                            .y = uint16_t(f.y0 + uint32_t(y)),
                            .first = have,
                            .count = wanted - have});
    }
  uint64_t rays = 0;
  for (const PixelRequest& r : requests) rays += r.count;
  const uint64_t most = kMostPerPixel * met.size();
  for (PixelRequest& r : requests)
    if (rays > most) r.count = std::max(1u, uint32_t(uint64_t(r.count) * most / rays));
  return requests;
}

void look(const CommittedScene& scene, std::span<const PixelRequest> requests, Film& film, Work& work,
          const WalkSettings& settings, RayCounts& counts) {
  const CameraRays camera(scene.scene.camera(), scene.scene.origin(), film.settings().width, film.settings().height);
  const path_tracing::KernelInput input{.walk = {scene, settings.limits, work.shown, false},
                                        .camera = camera,
                                        .film = film,
                                        .clamp_direct = settings.clamp_direct,
                                        .clamp_indirect = settings.clamp_indirect,
                                        .seed = hash(uint32_t(work.seed), uint32_t(work.seed >> 32)),
                                        .stop = work.stop};
  const uint32_t features = path_tracing::kernel_features(scene.effects, film.settings().passes, work.shown);
  const auto kernel = features & kFeatureStraight ? look_at<15> : look_at<13>;
  std::mutex mutex;
  parallel_blocks(
      requests.size(), 64, work.threads,
      [&](size_t begin, size_t end) {
        RayCounts own;
        for (size_t i = begin; i < end && !work.stop.stop(); ++i) kernel(input, requests[i], own);
        const std::lock_guard lock(mutex);
        counts += own;
      },
      work.stop);
}

}  // namespace afterglow
