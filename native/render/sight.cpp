// SPDX-License-Identifier: GPL-3.0-or-later
// Which pixels get rays that only look, and these rays: see sight.h.
#include "render/sight.h"

#include <algorithm>
#include <bit>
#include <mutex>

#include "base/parallel.h"
#include "methods/path_tracing/kernel_body.h"
#include "render/extra_samples.h"

namespace afterglow {

namespace {

constexpr float kContrast = 0.02f;     // of light met, over what is shown
constexpr float kFullContrast = 2.0f;  // of an edge that gets all rays
constexpr float kFloor = 0.05f;        // of the image's mean, which counts as shown everywhere
constexpr uint32_t kFewest = 16, kMostWanted = 1024;
constexpr float kErrors = 2.0f;  // standard ones, that a denoiser may be off
constexpr uint32_t kSeed = 0x51647u;

struct Met {
  float light = 0.0f, shown = -1.0f;  // luminances; shown below 0: no sample yet
};

/// Sums what camera rays meet at emitters and in the sky.
struct LookVisitor {
  using OnlyLooks = void;
  const path_tracing::KernelInput& in;
  RayCounts& counts;
  Rgb emission{0.0f}, environment{0.0f};

  void emitted(const PathState& path, const Rgb& light) { add(emission, path, light); }
  void escaped(const PathState& path, const Rgb& light) { add(environment, path, light); }
  void add(Rgb& to, const PathState& path, const Rgb& light) {
    to += path_tracing::kept(path.throughput * light, in.clamp_direct, counts);
  }
  void traced(const Ray&, bool) {}
  void held_out(const PathState&, float) {}
  bool surface(const PathState&, const SurfacePoint&, const Surface&) { return true; }
  void lit(const PathState&, const BsdfValue&, const Rgb&) {}
  void scattered(const PathState&, const BsdfSample&) {}
};

template <uint32_t kFeatures>
void look_at(const path_tracing::KernelInput& in, const PixelRequest& request, RayCounts& counts) {
  const Walker<kFeatures & 7u> walker(in.walk, counts);
  LookVisitor visitor{in, counts};
  const uint32_t seed = hash(request.x, request.y, in.seed ^ kSeed);
  for (uint32_t i = request.first; i < request.first + request.count; ++i) {
    Sampler sampler(seed, i);
    const Vec2 in_pixel = in.film.filter().offset(sampler.next2());
    const Vec2 on_lens = sampler.next2();
    const Vec2 middle(float(request.x) + 0.5f, float(request.y) + 0.5f);
    PathState path = path_tracing::path_from(in.camera, middle + in_pixel, on_lens, false);
    path.ray.mask = kVisibleCamera;
    path.last = true;  // it goes through what is transparent and no further
    walker.walk(path, sampler, visitor);
  }
  in.film.see(request.x, request.y, visitor.emission, visitor.environment, request.count);
}

}  // namespace

uint32_t sight_wanted(uint32_t samples, uint32_t least) {
  return std::clamp(16u * (std::bit_floor(std::min(samples, kMostWanted)) + 1u), least, kMostWanted);
}

std::vector<PixelRequest> sight_requests(const Film& film, uint32_t wanted, int near, uint64_t most) {
  const FilmSettings& f = film.settings();
  const int width = int(film.width()), height = int(film.height());
  std::vector<Met> met(size_t(width) * size_t(height));
  parallel_blocks(met.size(), 16384, [&](size_t begin, size_t end) {
    for (size_t p = begin; p < end; ++p) {
      const PixelNoise n = film.noise(p);
      if (n.samples) met[p] = {n.seen / float(n.samples), (n.sum + n.seen) / float(n.samples)};
    }
  });
  double total = 0.0;
  for (const Met& m : met) total += std::max(0.0f, m.shown);
  const float floor = kFloor * float(total / double(std::max<size_t>(met.size(), 1)));
  const auto enough_at = [&](int x, int y) {
    float least = kInfinity, brightest = 0.0f, shown = 0.0f;
    int neighbours = 0;
    for (int j = std::max(0, y - near); j <= std::min(height - 1, y + near); ++j)
      for (int i = std::max(0, x - near); i <= std::min(width - 1, x + near); ++i) {
        const Met& m = met[size_t(j) * size_t(width) + size_t(i)];
        if ((i == x && j == y) || m.shown < 0.0f) continue;
        least = std::min(least, m.light), brightest = std::max(brightest, m.light);
        shown += m.shown, ++neighbours;
      }
    const float contrast = (brightest - least) / (shown / float(std::max(neighbours, 1)) + floor);
    if (!(contrast > kContrast)) return 0u;
    return std::max(std::min(wanted, kFewest), uint32_t(float(wanted) * std::min(1.0f, contrast / kFullContrast)));
  };
  std::vector<uint32_t> enough(met.size());
  parallel_blocks(size_t(height), 8, [&](size_t begin, size_t end) {
    for (size_t y = begin; y < end; ++y)
      for (int x = 0; x < width; ++x) enough[y * size_t(width) + size_t(x)] = enough_at(x, int(y));
  });
  std::vector<PixelRequest> requests;
  for (size_t p = 0; p < met.size(); ++p) {
    const uint32_t have = film.sight_samples(p);
    if (have >= enough[p] / 2) continue;
    requests.push_back({.x = uint16_t(f.x0 + p % size_t(width)),
                        .y = uint16_t(f.y0 + p / size_t(width)),
                        .first = have,
                        .count = enough[p] - have});
  }
  uint64_t rays = 0;
  for (const PixelRequest& r : requests) rays += r.count;
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

void keep_edges(const Film& film, const std::vector<PixelNoise>& noise, const float* shown, float* denoised) {
  const std::vector<float> spread = deviations(noise, film.width(), film.height(), DeviationUnit::kLight);
  for (size_t p = 0; p < noise.size(); ++p) {
    if (!film.sight_samples(p) || !noise[p].samples) continue;
    const float limit = kErrors * film.settings().exposure * spread[p] / std::sqrt(float(noise[p].samples));
    float off = 0.0f;
    for (size_t c = 0; c < 3; ++c) off = std::max(off, std::fabs(denoised[p * 3 + c] - shown[p * 4 + c]));
    if (!(off > limit)) continue;
    for (size_t c = 0; c < 3; ++c) denoised[p * 3 + c] = glm::mix(shown[p * 4 + c], denoised[p * 3 + c], limit / off);
  }
}

}  // namespace afterglow
