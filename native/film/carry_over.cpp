// SPDX-License-Identifier: GPL-3.0-or-later
// Differences of single samples, pooled over neighbours: see carry_over.h.
#include "film/carry_over.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "film/film.h"

namespace afterglow {

namespace {

/// Square of one sample's noise in units of its brightness, about: what a change is weighed against.
constexpr float kNoise = 0.1f;
/// Old samples never weigh more than this many: what no sample told of an edit fades.
constexpr uint32_t kMostKept = 256;
constexpr float kQuiet = 0.02f;  // change that may wait to be looked at closely
/// The filter leaves light alone that is 6 % off; direct light shows its noise before.
constexpr float kSmoothing = 3.0f;

/// Sums over (2 radius + 1)² neighbours of a grid, rows first.
void pool(std::vector<float>& values, int width, int height, int radius) {
  std::vector<float> line(size_t(std::max(width, height)));
  const auto run = [&](float* first, size_t stride, int count) {
    double sum = 0.0;
    for (int i = 0; i < std::min(radius, count); ++i) sum += first[size_t(i) * stride];
    for (int i = 0; i < count; ++i) {
      if (i + radius < count) sum += first[size_t(i + radius) * stride];
      line[size_t(i)] = float(std::max(sum, 0.0));
      if (i - radius >= 0) sum -= first[size_t(i - radius) * stride];
    }
    for (int i = 0; i < count; ++i) first[size_t(i) * stride] = line[size_t(i)];
  };
  for (int y = 0; y < height; ++y) run(values.data() + size_t(y) * size_t(width), 1, width);
  for (int x = 0; x < width; ++x) run(values.data() + x, size_t(width), height);
}

}  // namespace

uint32_t samples_kept(uint32_t samples, float change) {
  const uint32_t most = std::min(samples, kMostKept);
  if (!(change > 0.0f)) return most;
  const float worth = kNoise / (change * change);
  return worth >= float(most) ? most : uint32_t(worth);
}

CarryOver::CarryOver(uint32_t width, uint32_t height, const FilmLayout& layout)
    : width_(width),
      height_(height),
      floats_(size_t(layout.floats)),
      combined_(layout[Pass::kCombined]),
      cached_(layout[Pass::kDiffuseIndirect]),
      sums_(size_t(width) * height * floats_),
      asked_(size_t(width) * height),
      known_(asked_.size()),
      other_before_(asked_.size()),
      settled_(asked_.size()),
      blocks_((width + kQuietBlock - 1) / kQuietBlock),
      found_(asked_.size()),
      change_(asked_.size()),
      guides_(asked_.size()),
      guided_(asked_.size()),
      smoothing_(asked_.size(), Rgb(0.0f)) {}

size_t CarryOver::bytes() const {
  return sums_.size() * sizeof(float) +
         asked_.size() * (5 + sizeof(float) + sizeof(PixelChange) + sizeof(LayerPixel) + sizeof(Rgb));
}

void CarryOver::clear() {
  std::fill(asked_.begin(), asked_.end(), uint8_t(0));
  std::fill(known_.begin(), known_.end(), uint8_t(0));
  std::fill(found_.begin(), found_.end(), PixelChange{});
  std::fill(guided_.begin(), guided_.end(), uint8_t(0));
  std::fill(smoothing_.begin(), smoothing_.end(), Rgb(0.0f));
}

void CarryOver::begin() {
  std::fill(asked_.begin(), asked_.end(), uint8_t(0));
  std::fill(settled_.begin(), settled_.end(), uint8_t(0));
  quiet_.clear();
}

void CarryOver::find_quiet(bool all) {
  const size_t rows = (height_ + kQuietBlock - 1) / kQuietBlock;
  std::vector<uint8_t> loud(blocks_ * rows);
  for (uint32_t y = 0; y < height_; y += kQuietStep)
    for (uint32_t x = 0; x < width_; x += kQuietStep) {
      const size_t pixel = size_t(y) * width_ + x;
      const PixelChange& found = found_[pixel];
      const bool other_light = luminance(glm::abs(found.cached)) > kQuiet * found.level;
      if (known_[pixel] < 2 || change_[pixel] > kQuiet || other_light)
        loud[y / kQuietBlock * blocks_ + x / kQuietBlock] = 1;
    }
  quiet_.assign(loud.size(), 1);
  for (size_t y = 0; y < rows; ++y)
    for (size_t x = 0; x < blocks_; ++x)
      for (size_t j = y ? y - 1 : 0; j <= std::min(y + 1, rows - 1); ++j)
        for (size_t i = x ? x - 1 : 0; i <= std::min(x + 1, blocks_ - 1); ++i)
          if (loud[j * blocks_ + i]) quiet_[y * blocks_ + x] = 0;
  for (size_t b = ++turn_ % kTurns; b < quiet_.size() && !all; b += kTurns) quiet_[b] = 0;
}

void CarryOver::follow(size_t pixel, const Rgb& cached) {
  float* sums = sums_.data() + pixel * floats_;
  for (const int at : {combined_, cached_})
    for (int c = 0; c < 3; ++c) sums[at + c] += cached[c];
}

void CarryOver::ask(size_t pixel, const float* sums) {
  float* old = sums_.data() + pixel * floats_;
  if (known_[pixel]) {
    const auto light = [](const float* from, int at) {
      return at < 0 ? Rgb(0.0f) : Rgb(from[at], from[at + 1], from[at + 2]);
    };
    const Rgb before = light(old, combined_), after = light(sums, combined_);
    const Rgb cached_before = light(old, cached_), cached_after = light(sums, cached_);
    const Rgb cached = cached_after - cached_before, other = (after - cached_after) - (before - cached_before);
    PixelChange& found = found_[pixel];
    found.cached += cached;
    found.apart += luminance(glm::abs(other));
    found.level = std::max({found.level, luminance(before), luminance(after)});
    other_before_[pixel] = found.other;
    if (guided_[pixel] & kGuided) found.other = true;  // until guide() says that it is the same place
  }
  std::memcpy(old, sums, floats_ * sizeof(float));
  guided_[pixel] = guided_[pixel] & kGuided ? kWasGuided : 0;
  asked_[pixel] = 1;
  known_[pixel] = known_[pixel] ? 2 : 1;  // 2: in another state, too
}

void CarryOver::weigh(uint32_t step) {
  const int columns = int((width_ + step - 1) / step), rows = int((height_ + step - 1) / step);
  std::vector<float> apart(size_t(columns) * size_t(rows)), level(apart.size()), other(apart.size());
  const auto pixel = [&](int x, int y) { return size_t(y) * step * width_ + size_t(x) * step; };
  for (int y = 0; y < rows; ++y)
    for (int x = 0; x < columns; ++x) {
      const PixelChange& c = found_[pixel(x, y)];
      const size_t i = size_t(y) * size_t(columns) + size_t(x);
      apart[i] = c.apart, level[i] = c.level, other[i] = c.other ? 1.0f : 0.0f;
    }
  pool(other, columns, rows, 1);
  std::vector<float> far_apart = apart, far_level = level;
  pool(apart, columns, rows, 1), pool(level, columns, rows, 1);
  pool(far_apart, columns, rows, 3), pool(far_level, columns, rows, 3);
  for (int y = 0; y < rows; ++y)
    for (int x = 0; x < columns; ++x) {
      const size_t i = size_t(y) * size_t(columns) + size_t(x);
      const float near = level[i] > 0.0f ? apart[i] / level[i] : 0.0f;
      const float far = far_level[i] > 0.0f ? far_apart[i] / far_level[i] : 0.0f;
      change_[pixel(x, y)] = other[i] > 0.5f ? 1.0f : std::max(near, far);
    }
}

LayeredFilter& CarryOver::begin_smoothing() {
  filter_.begin(width_, height_);
  return filter_;
}

void CarryOver::guide(size_t pixel, const LayerPixel& surface) {
  const uint8_t was = guided_[pixel] & kWasGuided;
  if (was && guides_[pixel].position == surface.position && guides_[pixel].normal == surface.normal)
    found_[pixel].other = other_before_[pixel];
  else if (!was && known_[pixel] > 1)
    found_[pixel].other = true;
  guides_[pixel] = surface;
  guided_[pixel] = was | kGuided;
}

void CarryOver::set_light(size_t pixel, const Rgb& light, float error) {
  LayerPixel p = guides_[pixel];
  p.light = light;
  p.error = kSmoothing * error;
  filter_.set(pixel, p);
}

}  // namespace afterglow
