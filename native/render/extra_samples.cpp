// SPDX-License-Identifier: GPL-3.0-or-later
// Deviations and their shares: see extra_samples.h.
#include "render/extra_samples.h"

#include <algorithm>
#include <cfloat>

#include "base/parallel.h"
#include "base/sampler.h"

namespace afterglow {

namespace {

constexpr uint32_t kMostTimes = 64;  // samples beyond a pixel's own, for each of those
constexpr float kMiddleGrey = 0.18f;
constexpr float kWorth = 5.0f;  // of an `extra`: samples for each own one where one has a shown deviation of 1
constexpr int kHalvings = 24;

/// Sums over 3 × 3 pixels with binomial weights.
struct Near {
  float weight = 0.0f, sum = 0.0f, level = 0.0f, mean_square = 0.0f, variance = 0.0f, known = 0.0f;
};

}  // namespace

std::vector<float> deviations(const std::vector<PixelNoise>& pixels, uint32_t width, uint32_t height,
                              DeviationUnit unit, StopToken stop) {
  double total = 0.0;
  uint64_t known = 0;
  std::vector<float> lit;
  for (const PixelNoise& p : pixels) {
    if (!p.samples) continue;
    const float level = (p.sum + p.seen) / float(p.samples);
    total += level, ++known;
    if (unit == DeviationUnit::kShown && level > 0.0f) lit.push_back(level);
  }
  std::vector<float> found(pixels.size(), 0.0f);
  if (!known || !(total > 0.0)) return found;
  const float bright = 2.0f * float(total / double(known)), floor = 0.01f * bright * bright;
  float shown = 1.0f;
  if (!lit.empty()) {
    const auto middle = lit.begin() + ptrdiff_t(lit.size() / 2);
    std::nth_element(lit.begin(), middle, lit.end());
    shown = kMiddleGrey / std::max(*middle, FLT_MIN);
  }
  const auto look_at_row = [&](int y) {
    for (int x = 0; x < int(width); ++x) {
      Near near;
      for (int j = std::max(0, y - 1); j <= std::min(int(height) - 1, y + 1); ++j)
        for (int i = std::max(0, x - 1); i <= std::min(int(width) - 1, x + 1); ++i) {
          const PixelNoise& p = pixels[size_t(j) * width + size_t(i)];
          if (!p.samples) continue;
          const float w = (i == x ? 2.0f : 1.0f) * (j == y ? 2.0f : 1.0f), n = float(p.samples), mean = p.sum / n;
          near.weight += w, near.sum += w * mean, near.mean_square += w * p.squares / n;
          near.level += w * (mean + p.seen / n);
          if (p.samples < 2) continue;
          near.known += w;
          near.variance += w * std::max(0.0f, (p.squares - p.sum * mean) / (n - 1.0f));
        }
      if (!(near.weight > 0.0f)) continue;
      const float mean = near.sum / near.weight, level = near.level / near.weight;
      const float variance =
          near.known > 0.0f ? near.variance / near.known : std::max(0.0f, near.mean_square / near.weight - mean * mean);
      const float square = unit == DeviationUnit::kLight   ? 1.0f
                           : unit == DeviationUnit::kShown ? std::sqrt(level * level + floor) / shown
                                                           : level * level + floor;
      found[size_t(y) * width + size_t(x)] = std::sqrt(variance / square);
    }
  };
  parallel_blocks(
      height, 8, 0,
      [&](size_t begin, size_t end) {
        for (size_t y = begin; y < end; ++y) look_at_row(int(y));
      },
      stop);
  return found;
}

std::vector<uint32_t> share_out(const std::vector<float>& noise, const std::vector<PixelNoise>& pixels, uint64_t budget,
                                float worth, uint32_t most, uint32_t seed) {
  std::vector<uint32_t> counts(pixels.size(), 0);
  if (!budget) return counts;
  const auto wanted = [&](size_t p, float scale) {
    const float own = float(pixels[p].samples - pixels[p].extra);
    return std::clamp(noise[p] * scale - float(pixels[p].samples), 0.0f,
                      std::max(0.0f, own * float(most) - float(pixels[p].extra)));
  };
  const auto all = [&](float scale) {
    double sum = 0.0;
    for (size_t p = 0; p < pixels.size(); ++p) sum += wanted(p, scale);
    return sum;
  };
  float low = 0.0f, high = worth;
  if (all(high) <= double(budget)) low = high;
  for (int i = 0; i < kHalvings && low < high; ++i) {
    const float middle = 0.5f * (low + high);
    (all(middle) <= double(budget) ? low : high) = middle;
  }
  for (size_t p = 0; p < pixels.size(); ++p) {
    const float n = wanted(p, low);
    if (n > 0.0f) counts[p] = uint32_t(n + unit_float(hash(uint32_t(p), seed, pixels[p].samples)));
  }
  return counts;
}

std::vector<PixelRequest> extra_requests(const Film& film, float extra) {
  const FilmSettings& f = film.settings();
  std::vector<PixelNoise> pixels(size_t(film.width()) * film.height());
  double own = 0.0, done = 0.0;
  for (size_t p = 0; p < pixels.size(); ++p) {
    pixels[p] = film.noise(p);
    own += pixels[p].samples - pixels[p].extra, done += pixels[p].extra;
  }
  const double budget = double(extra) * own - done;
  std::vector<PixelRequest> requests;
  if (!(budget >= 1.0)) return requests;
  const std::vector<float> noise = deviations(pixels, film.width(), film.height(), DeviationUnit::kShown);
  const float worth = kWorth * extra * float(own / double(pixels.size()));
  const std::vector<uint32_t> counts = share_out(noise, pixels, uint64_t(budget), worth, kMostTimes, uint32_t(own));
  for (uint32_t y = f.y0; y < f.y1; ++y)
    for (uint32_t x = f.x0; x < f.x1; ++x) {
      const size_t p = size_t(y - f.y0) * film.width() + (x - f.x0);
      if (counts[p])
        requests.push_back(
            {.x = uint16_t(x), .y = uint16_t(y), .first = pixels[p].extra, .count = counts[p], .extra = true});
    }
  return requests;
}

}  // namespace afterglow
