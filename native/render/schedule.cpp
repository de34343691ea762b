// SPDX-License-Identifier: GPL-3.0-or-later
// Sizes of passes and their pixels.
#include "render/schedule.h"

#include <algorithm>

namespace afterglow {

namespace {

uint32_t next_count(uint32_t done, bool timed) {
  if (timed) {  // an eighth of what is done, as a power of two
    uint32_t count = 1;
    while (count * 16 <= done) count *= 2;
    return std::min(count, 64u);
  }
  if (done < 2) return 1;
  if (done < 16) return done;
  return 16;
}

}  // namespace

PassPlan plan_pass(const ScheduleOptions& options, uint32_t index, uint32_t done) {
  if (options.viewport && index < 32 && options.coarsest >> index)
    return {0, options.samples ? 1u : 0u, options.coarsest >> index, index ? 2 * options.coarsest >> index : 0u};
  const uint32_t wanted = options.viewport ? (done < 16 ? 1u : 2u) : next_count(done, options.timed);
  return {done, std::min(wanted, options.samples - std::min(done, options.samples)), 1, 0};
}

uint32_t coarsest_step(uint64_t pixels, double sample_seconds) {
  if (!(sample_seconds > 0.0)) return 8;
  uint32_t step = 1;
  while (step<kCoarsestStep&& double(pixels) * sample_seconds> kFirstPassSeconds * step * step) step *= 2;
  return step;
}

DenoisePlan denoise_plan(bool viewport, uint32_t samples, uint32_t kept, bool exact) {
  const bool clean = kept >= kPrefilterTo, quick = !exact && samples <= kQuickTo;
  return {.prefilter = !viewport && !clean && samples >= kPrefilterFrom, .fast = viewport || clean || quick};
}

std::vector<PixelRequest> pass_requests(const PassPlan& plan, uint32_t x0, uint32_t y0, uint32_t x1, uint32_t y1) {
  // About a thousand samples a request: small enough to share out evenly, large enough to forget the sharing.
  uint32_t side = 16;
  while (side > 4 && side * side * plan.count > 2048) side /= 2;
  side *= plan.step;
  std::vector<PixelRequest> requests;
  requests.reserve(size_t((x1 - x0) / side + 1) * ((y1 - y0) / side + 1));
  for (uint32_t y = y0; y < y1; y += side)
    for (uint32_t x = x0; x < x1; x += side)
      requests.push_back({.x = uint16_t(x),
                          .y = uint16_t(y),
                          .width = uint16_t(std::min(side, x1 - x)),
                          .height = uint16_t(std::min(side, y1 - y)),
                          .step = uint16_t(plan.step),
                          .skip = uint16_t(plan.skip),
                          .first = plan.first,
                          .count = plan.count});
  return requests;
}

uint32_t least_samples(const Film& film) {
  uint32_t least = ~0u;
  for (size_t p = 0, n = size_t(film.width()) * film.height(); p < n; ++p) least = std::min(least, film.samples(p));
  return least;
}

uint32_t typical_samples(const Film& film) {
  std::vector<uint32_t> counts(size_t(film.width()) * film.height());
  for (size_t p = 0; p < counts.size(); ++p) counts[p] = film.samples(p);
  const auto middle = counts.begin() + ptrdiff_t(counts.size() / 2);
  std::nth_element(counts.begin(), middle, counts.end());
  return middle == counts.end() ? 0 : *middle;
}

std::vector<PixelRequest> catch_up_requests(Film& film, uint32_t enough) {
  constexpr uint32_t kSide = 16;
  const FilmSettings& f = film.settings();
  const uint32_t number = film.next_sample(), least = least_samples(film);
  const uint32_t most = std::min(least + least / 2, std::max(enough, 1u) - 1);
  const auto behind = [&](uint32_t x, uint32_t y) {
    return film.samples(size_t(y - f.y0) * film.width() + (x - f.x0)) <= most;
  };
  std::vector<PixelRequest> requests;
  const auto add = [&](uint32_t x, uint32_t y, uint32_t width, uint32_t height) {
    requests.push_back(
        {.x = uint16_t(x), .y = uint16_t(y), .width = uint16_t(width), .height = uint16_t(height), .first = number});
  };
  for (uint32_t y0 = f.y0; y0 < f.y1; y0 += kSide)
    for (uint32_t x0 = f.x0; x0 < f.x1; x0 += kSide) {
      const uint32_t x1 = std::min(x0 + kSide, f.x1), y1 = std::min(y0 + kSide, f.y1);
      uint32_t wanted = 0;
      for (uint32_t y = y0; y < y1; ++y)
        for (uint32_t x = x0; x < x1; ++x) wanted += behind(x, y);
      if (wanted * 8 >= (x1 - x0) * (y1 - y0) * 7) {
        add(x0, y0, x1 - x0, y1 - y0);
        continue;
      }
      for (uint32_t y = y0; y < y1 && wanted; ++y)
        for (uint32_t x = x0; x < x1;) {
          uint32_t end = x;
          while (end < x1 && behind(end, y)) ++end;
          if (end > x) add(x, y, end - x, 1), wanted -= end - x;
          x = end + 1;
        }
    }
  return requests;
}

std::vector<PixelRequest> waiting_requests(const Film& film) {
  const FilmSettings& f = film.settings();
  std::vector<PixelRequest> requests = pass_requests({0, 1, 1, 0}, f.x0, f.y0, f.x1, f.y1);
  std::erase_if(requests, [&](const PixelRequest& r) { return film.wants(r); });
  return requests;
}

}  // namespace afterglow
