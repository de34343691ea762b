// SPDX-License-Identifier: GPL-3.0-or-later
// Wavefronts, stage after stage: see wavefront.h.
#include "render/wavefront.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <mutex>
#include <thread>

#include "base/parallel.h"
#include "film/discontinuity.h"
#include "render/wavefront_kernel.h"

namespace afterglow {

namespace {

constexpr uint64_t kMostSamples = 1u << 18;  // of one wavefront: about 50 MB of questions
constexpr size_t kMostRequests = 1u << 15;
constexpr size_t kGatherBlock = 512;
constexpr uint32_t kCarriedLights = 4;

double now() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

class Stopwatch {
 public:
  explicit Stopwatch(double& total) : total_(total), begun_(now()) {}
  ~Stopwatch() { total_ += now() - begun_; }

 private:
  double& total_;
  double begun_;
};

void walk(const path_tracing::KernelInput& input, WalkKernel kernel, std::span<const PixelRequest> requests,
          uint32_t lights, bool noise, Wavefront& wave, Work& work, WavefrontTimes& times) {
  const Stopwatch watch(times.walk);
  if (wave.requests.size() < requests.size()) wave.requests.resize(requests.size());
  parallel_blocks(
      requests.size(), 1, work.threads,
      [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end && !work.stop.stop(); ++i) {
          while (work.pause && work.pause->load() && !work.stop.stop())
            std::this_thread::sleep_for(std::chrono::milliseconds(2));
          wave.requests[i].clear(lights, noise);
          kernel(input, requests[i], wave.requests[i]);
        }
      },
      work.stop);
  wave.first.clear();
  size_t points = 0;
  for (size_t i = 0; i < requests.size(); ++i) {
    wave.first.push_back(points);
    points += wave.requests[i].points.size();
    times.counts += wave.requests[i].counts;
  }
  wave.points.resize(points);
  wave.answers.assign(points, Answer{});
  parallel_blocks(requests.size(), 64, work.threads, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i)
      std::copy(wave.requests[i].points.begin(), wave.requests[i].points.end(),
                wave.points.begin() + ptrdiff_t(wave.first[i]));
  });
  times.points += points;
}

void gather(const IndirectMethod& method, const CommittedScene& scene, Wavefront& wave, const Work& work) {
  const std::span<const CachePoint> points = wave.points;
  const std::span<Answer> answers = wave.answers;
  wave.unanswered.assign((points.size() + kGatherBlock - 1) / kGatherBlock, 0);
  parallel_blocks(
      points.size(), kGatherBlock, work.threads,
      [&](size_t begin, size_t end) {
        const std::span<Answer> own = answers.subspan(begin, end - begin);
        method.gather(scene, points.subspan(begin, end - begin), own);
        wave.unanswered[begin / kGatherBlock] =
            uint32_t(std::count_if(own.begin(), own.end(), [](const Answer& a) { return !(a.weight > 0.0f); }));
      },
      work.stop);
}

/// Points without an answer; only blocks that have any are looked at again.
std::span<const CachePoint> find_holes(Wavefront& wave) {
  size_t count = 0;
  for (const uint32_t unanswered : wave.unanswered) count += unanswered;
  if (count == wave.points.size()) return wave.points;
  wave.hole_points.clear();
  for (size_t block = 0; block < wave.unanswered.size(); ++block) {
    if (!wave.unanswered[block]) continue;
    const size_t end = std::min((block + 1) * kGatherBlock, wave.points.size());
    for (size_t i = block * kGatherBlock; i < end; ++i)
      if (!(wave.answers[i].weight > 0.0f)) wave.hole_points.push_back(wave.points[i]);
  }
  return wave.hole_points;
}

/// Asks, lets the method fill what it could not answer, and asks again.
void answer(IndirectMethod& method, const CommittedScene& scene, Wavefront& wave, Work& work, WavefrontTimes& times) {
  if (wave.points.empty()) return;
  if (!method.traits().fills_holes) {
    {
      const Stopwatch watch(times.prepare);
      method.prepare(scene, wave.points, work);
    }
    const Stopwatch watch(times.gather);
    gather(method, scene, wave, work);
    return;
  }
  std::span<const CachePoint> holes;
  {
    const Stopwatch watch(times.gather);
    gather(method, scene, wave, work);
    if (work.stop.stop()) return;
    holes = find_holes(wave);
  }
  times.holes += holes.size();
  if (holes.empty() || work.stop.stop()) return;
  {
    const Stopwatch watch(times.prepare);
    method.prepare(scene, holes, work);
  }
  if (work.stop.stop()) return;
  const Stopwatch watch(times.gather);
  gather(method, scene, wave, work);  // what was answered before may have a nearer record now
}

/// The pixels of a wavefront, in steps of their pass.
struct PixelBox {
  uint32_t x0 = 0, y0 = 0, width = 0, height = 0;
  size_t index(const CachePoint& p) const { return size_t(p.y - y0) * width + (p.x - x0); }
};

PixelBox pixels_of(std::span<const PixelRequest> requests) {
  uint32_t x0 = ~0u, y0 = ~0u, x1 = 0, y1 = 0;
  for (const PixelRequest& r : requests) {
    x0 = std::min<uint32_t>(x0, r.x / r.step), y0 = std::min<uint32_t>(y0, r.y / r.step);
    x1 = std::max<uint32_t>(x1, (r.x + r.width - 1u) / r.step + 1u);
    y1 = std::max<uint32_t>(y1, (r.y + r.height - 1u) / r.step + 1u);
  }
  return {x0, y0, x1 - x0, y1 - y0};
}

/// Shares answers between the first diffuse surfaces of neighbouring pixels.
void share(std::span<const PixelRequest> requests, uint32_t interleave, Wavefront& wave, const Work& work,
           WavefrontTimes& times) {
  const Stopwatch watch(times.filter);
  const PixelBox box = pixels_of(requests);
  const uint32_t width = box.width, height = box.height;
  std::vector<SharedIrradiance> grid(size_t(width) * height);
  std::vector<Rgb> shared(grid.size());
  const auto at = [&](const CachePoint& p) { return box.index(p); };
  const auto takes_part = [](const CachePoint& p) { return p.layer == 0 && !p.translucent; };
  for (size_t i = 0; i < wave.points.size(); ++i) {
    const CachePoint& p = wave.points[i];
    if (takes_part(p)) grid[at(p)] = {p.position, p.normal, p.footprint, wave.answers[i].light, true};
  }
  filter_discontinuities(grid, width, height, int(interleave / 2), shared, work.threads, work.stop);
  if (work.stop.stop()) return;
  for (size_t i = 0; i < wave.points.size(); ++i)
    if (takes_part(wave.points[i])) wave.answers[i].light = shared[at(wave.points[i])];
}

/// Filters what was answered, surface after surface along the paths, each sample of the picture by itself.
void filter_layers(std::span<const PixelRequest> requests, Wavefront& wave, const Work& work, WavefrontTimes& times) {
  const Stopwatch watch(times.filter);
  const PixelBox box = pixels_of(requests);
  std::array<size_t, 256> present{};
  std::mutex mutex;
  const size_t count = wave.points.size();
  wave.layers.resize(count);
  const auto each = [&](const std::function<void(size_t, size_t)>& body) {
    parallel_blocks(count, 16384, work.threads, body, work.stop);
  };
  each([&](size_t begin, size_t end) {
    std::array<size_t, 256> own{};
    for (size_t i = begin; i < end; ++i) {
      const CachePoint& p = wave.points[i];
      own[wave.layers[i] = uint8_t(std::min(2u * p.layer + p.translucent, 255u))]++;
    }
    const std::lock_guard lock(mutex);
    for (size_t layer = 0; layer < own.size(); ++layer) present[layer] += own[layer];
  });
  for (uint32_t layer = 0; layer < present.size() - 1 && !work.stop.stop(); ++layer) {
    if (!present[layer]) continue;
    wave.filter.begin(box.width, box.height);
    each([&](size_t begin, size_t end) {
      for (size_t i = begin; i < end; ++i) {
        if (wave.layers[i] != layer) continue;
        const CachePoint& p = wave.points[i];
        const Answer& a = wave.answers[i];
        wave.filter.set(box.index(p),
                        {p.position, p.normal, p.footprint, p.segment, a.relative_error, a.light, !(a.weight > 0.0f)});
      }
    });
    wave.filter.run(work.threads, work.stop);
    if (work.stop.stop()) return;
    each([&](size_t begin, size_t end) {
      for (size_t i = begin; i < end; ++i)
        if (wave.layers[i] == layer) wave.answers[i].light = wave.filter.light(box.index(wave.points[i]));
    });
  }
}

void join(const FilmLayout& layout, const WalkSettings& settings, const Question& q, const Answer& answer, float* sums,
          uint64_t& dropped) {
  Rgb light = q.weight * answer.light;
  const float sum = light.x + light.y + light.z;
  if (!(std::fabs(light.x) + std::fabs(light.y) + std::fabs(light.z) <= path_tracing::kMostLight)) {
    dropped++;
    return;
  }
  const float limit = settings.clamp_indirect;
  light = glm::max(sum > limit ? light * (limit / sum) : light, Rgb(0.0f));
  const auto add = [&](Pass pass, const Rgb& value) {
    const int at = layout[pass];
    if (at < 0) return;
    for (int c = 0; c < 3; ++c) sums[at + c] += value[c];
  };
  add(Pass::kCombined, light);
  sums[layout[Pass::kBatches] + int(batch_of(q.sample))] += luminance(light);
  if (q.direct) return add(Pass::kDiffuseIndirect, light);
  add(Pass::kDiffuseIndirect, light * q.diffuse);
  add(Pass::kGlossyIndirect, light * q.glossy);
  add(Pass::kTransmissionIndirect, light * q.transmission);
}

bool shown_as_it_is(const Answer& answer) { return answer.weight == kAsItIs; }

/// A debug view's colours take the place of the request's picture.
bool show_colours(const FilmLayout& layout, const Wavefront& wave, size_t request, WalkedRequest& r) {
  const size_t first = wave.first[request], floats = size_t(layout.floats);
  const auto begin = wave.answers.begin() + ptrdiff_t(first);
  if (std::none_of(begin, begin + ptrdiff_t(r.questions.size()), shown_as_it_is)) return false;
  const int at = layout[Pass::kCombined];
  for (size_t pixel = 0; pixel * floats < r.sums.size(); ++pixel)
    for (const Pass pass : {Pass::kCombined, Pass::kEmission, Pass::kEnvironment})
      if (layout[pass] >= 0) std::fill_n(r.sums.begin() + ptrdiff_t(pixel * floats) + layout[pass], 3, 0.0f);
  for (size_t k = 0; k < r.questions.size(); ++k) {
    const CachePoint& p = wave.points[first + k];
    if (p.layer || p.translucent || !shown_as_it_is(wave.answers[first + k])) continue;
    for (int c = 0; c < 3; ++c)
      r.sums[floats * r.questions[k].pixel + size_t(at + c)] += wave.answers[first + k].light[c];
  }
  return true;
}

void finish(std::span<const PixelRequest> requests, Film& film, Wavefront& wave, const WalkSettings& settings,
            Work& work, WavefrontTimes& times) {
  const Stopwatch watch(times.film);
  const size_t floats = size_t(film.layout().floats);
  std::atomic<uint64_t> dropped{0};
  parallel_blocks(requests.size(), 8, work.threads, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      WalkedRequest& r = wave.requests[i];
      uint64_t lost = 0;
      const bool shown = show_colours(film.layout(), wave, i, r);
      for (size_t k = 0; k < r.questions.size() && !shown; ++k)
        join(film.layout(), settings, r.questions[k], wave.answers[wave.first[i] + k],
             r.sums.data() + floats * r.questions[k].pixel, lost);
      dropped += lost;
      const PixelRequest& request = requests[i];
      if (film.keeps_noise() && !shown)
        for (size_t k = 0; k < r.questions.size(); ++k)
          r.luminances[r.questions[k].path] += luminance(r.questions[k].weight * wave.answers[wave.first[i] + k].light);
      const auto squares = [&](size_t pixel) {
        float sum = 0.0f;
        for (size_t k = 0; k < request.count && film.keeps_noise(); ++k) {
          const float l = r.luminances[pixel * request.count + k];
          sum += l * l;
        }
        return sum;
      };
      const FilmSettings& f = film.settings();
      size_t pixel = 0, next = 0;
      for (uint32_t y = request.y; y < uint32_t(request.y) + request.height; y += request.step)
        for (uint32_t x = request.x; x < uint32_t(request.x) + request.width; x += request.step) {
          if (request.skip && (x - f.x0) % request.skip == 0 && (y - f.y0) % request.skip == 0) continue;
          float* sums = r.sums.data() + floats * pixel;
          if (request.extra) std::fill_n(sums + film.layout()[Pass::kBatches], kBatchCount, 0.0f);
          film.add(x, y, sums, request.count, squares(pixel), request.extra);
          for (; film.asks() && next < r.questions.size() && r.questions[next].pixel == pixel; ++next) {
            const CachePoint& p = wave.points[wave.first[i] + next];
            if (!p.layer && !p.translucent)
              film.guide(x, y,
                         {.position = p.position, .normal = p.normal, .footprint = p.footprint, .segment = p.segment});
          }
          ++pixel;
        }
      if (work.samples_done) *work.samples_done += sample_count(request);
    }
  });
  times.dropped += dropped;
}

}  // namespace

WalkKernel choose_walk_kernel(const Effects& effects, PassSet passes, bool local_view) {
  const uint32_t features = path_tracing::kernel_features(effects, passes, local_view);
  const bool straight = features & kFeatureStraight;
  if (features & kFeaturePasses) return straight ? walk_request<15> : walk_request<13>;
  return straight ? walk_request<7> : walk_request<5>;
}

void render_wavefronts(IndirectMethod& method, const CommittedScene& scene, std::span<const PixelRequest> all,
                       Film& film, Work& work, const WalkSettings& settings, WavefrontTimes& times, Wavefront& wave) {
  const CameraRays camera(scene.scene.camera(), scene.scene.origin(), film.settings().width, film.settings().height);
  const path_tracing::KernelInput input{.walk = {scene, settings.limits, work.shown, film.layout()[Pass::kUv] >= 0},
                                        .camera = camera,
                                        .film = film,
                                        .clamp_direct = settings.clamp_direct,
                                        .clamp_indirect = settings.clamp_indirect,
                                        .seed = hash(uint32_t(work.seed), uint32_t(work.seed >> 32)),
                                        .stop = work.stop};
  const WalkKernel kernel = choose_walk_kernel(scene.effects, film.settings().passes, work.shown);
  const MethodTraits traits = method.traits();
  const uint32_t interleave = traits.interleave;
  // Kept samples live long: where light sources are asked more often, the noise of a second's work is less.
  const uint32_t lights = work.extra       ? std::min(1u, traits.lights)
                          : film.carries() ? std::max(kCarriedLights, traits.lights)
                                           : traits.lights;
  std::vector<PixelRequest> requests(all.begin(), all.end());
  const bool layers = traits.layers && !work.extra;  // extra samples have no neighbours
  const bool apart = (interleave > 1 || layers) && !work.extra;
  if (apart) {  // neighbours share what they found for the same sample
    requests.clear();
    uint32_t most = 0;
    for (const PixelRequest& r : all) most = std::max(most, r.count);
    for (uint32_t k = 0; k < most; ++k)
      for (PixelRequest r : all)
        if (k < r.count) r.first += k, r.count = 1, requests.push_back(r);
  }
  for (size_t begin = 0; begin < requests.size() && !work.stop.stop();) {
    size_t end = begin;
    uint64_t samples = 0;
    do samples += sample_count(requests[end++]);
    while (end < requests.size() && samples + sample_count(requests[end]) <= kMostSamples &&
           end - begin < kMostRequests && (!apart || requests[end].first == requests[begin].first));
    const std::span<const PixelRequest> part(requests.data() + begin, end - begin);
    begin = end;
    walk(input, kernel, part, lights, film.keeps_noise(), wave, work, times);
    if (work.stop.stop()) return;
    answer(method, scene, wave, work, times);
    if (work.stop.stop()) return;
    if (interleave > 1 && !work.extra) share(part, interleave, wave, work, times);
    if (layers) filter_layers(part, wave, work, times);
    if (work.stop.stop()) return;
    finish(part, film, wave, settings, work, times);
  }
}

}  // namespace afterglow
