// SPDX-License-Identifier: GPL-3.0-or-later
// Films whose samples outlive edits: what of them stays, and how they look until the next samples come; see
// carry_over.h.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>

#include "base/parallel.h"
#include "film/film.h"

namespace afterglow {

namespace {

constexpr float kMostSmoothing = 1.5f;  // standard errors
constexpr float kUnseen = 1e-4f;        // relative change around a pixel that is no more than rounding

}  // namespace

void Film::carry_over() {
  keep_noise();
  if (!carry_) carry_ = std::make_unique<CarryOver>(width(), height(), layout_);
}

void Film::begin_asking() {
  carry_->begin();
  asking_ = true;
}

void Film::end_asking(uint32_t step, bool rest) {
  carry_->weigh(step);
  if (step == CarryOver::kQuietStep) carry_->find_quiet(rest);
  if (step > 1) return;
  asking_ = false;
  const auto each = [&](const std::function<void(uint32_t, uint32_t, size_t)>& body) {
    parallel_blocks(height(), 16, 0, [&](size_t begin, size_t end) {
      for (size_t y = begin; y < end; ++y)
        for (size_t x = 0; x < width(); ++x) body(uint32_t(x), uint32_t(y), y * width() + x);
    });
  };
  each([&](uint32_t x, uint32_t y, size_t pixel) {
    if (carry_->asked(pixel) || !counts_[pixel] || carry_->settled(pixel)) return;
    const uint32_t s = CarryOver::kQuietStep;
    const Rgb cached = carry_->found(size_t(y - y % s) * width() + (x - x % s)).cached;
    carry_->follow(pixel, cached);
    keep(pixel, samples_kept(counts_[pixel], 0.0f), cached);
  });
  each([&](uint32_t, uint32_t, size_t pixel) {
    if (carry_->asked(pixel) && !carry_->settled(pixel)) settle(pixel);
  });
}

void Film::ask_the_rest() {
  carry_->forget_quiet();
  asking_ = true;
}

bool Film::wants(const PixelRequest& r) const {
  if (!carry_->some_quiet()) return true;
  for (uint32_t y = r.y; y < uint32_t(r.y) + r.height; y += CarryOver::kQuietBlock)
    for (uint32_t x = r.x; x < uint32_t(r.x) + r.width; x += CarryOver::kQuietBlock)
      if (!carry_->quiet(x - settings_.x0, y - settings_.y0)) return true;
  return false;
}

/// Under the pixel's lock: so many of its samples, with other light from the cache.
void Film::keep(size_t pixel, uint32_t kept, const Rgb& cached) {
  float* to = sums_.data() + pixel * size_t(layout_.floats);
  const float share = float(kept) / float(counts_[pixel]);
  if (kept != counts_[pixel]) {
    std::array<float, FilmLayout::kMaxFloats> before;
    std::copy_n(to, layout_.floats, before.begin());
    for (int i = 0; i < layout_.floats; ++i) to[i] *= share;
    for (const Pass pass : {Pass::kDepth, Pass::kPosition, Pass::kObjectIndex, Pass::kMaterialIndex})  // not sums
      if (layout_[pass] >= 0) std::copy_n(before.begin() + layout_[pass], pass_info(pass).channels, to + layout_[pass]);
  }
  squares_[pixel] *= share;
  for (const Pass pass : {Pass::kCombined, Pass::kDiffuseIndirect})
    for (int c = 0; c < 3; ++c) to[layout_[pass] + c] = std::max(0.0f, to[layout_[pass] + c] + float(kept) * cached[c]);
  counts_[pixel] = kept;
}

/// Brings what stands in a pixel to the scene's new state.
void Film::settle(size_t pixel) {
  const Lock lock(*this, pixel);
  float* to = sums_.data() + pixel * size_t(layout_.floats);
  const uint32_t before = counts_[pixel], kept = before ? samples_kept(before, carry_->change(pixel)) : 0;
  if (keeps_sight() && carry_->change(pixel) > kUnseen && sight_[pixel].samples) sight_[pixel] = {}, looked_ = 0;
  if (kept) {
    keep(pixel, kept, carry_->found(pixel).cached);
  } else {
    std::memcpy(to, carry_->sums(pixel), size_t(layout_.floats) * sizeof(float));
    const float* c = to + layout_[Pass::kCombined];
    const float light = luminance(Rgb(c[0], c[1], c[2]) - (keeps_sight() ? seen(to) : Rgb(0.0f)));
    counts_[pixel] = 1;
    squares_[pixel] = light * light;
  }
  extras_[pixel] = 0;
  carry_->settle(pixel);
}

void Film::guide(uint32_t x, uint32_t y, const LayerPixel& surface) {
  carry_->guide(size_t(y - settings_.y0) * width() + (x - settings_.x0), surface);
}

/// Without deviations pictures show what stands in the film.
void Film::smooth(const std::vector<float>& deviations, unsigned threads, StopToken stop) {
  for (size_t p = 0; p < counts_.size() && deviations.empty(); ++p) carry_->take_nothing(p);
  if (deviations.empty()) return;
  const auto mean = [&](size_t pixel, Pass pass) {
    const float* from = sums_.data() + pixel * size_t(layout_.floats) + size_t(layout_[pass]);
    return Rgb(from[0], from[1], from[2]) / float(counts_[pixel]);
  };
  const auto each = [&](const std::function<void(size_t)>& body) {
    parallel_blocks(
        height(), 16, threads,
        [&](size_t begin, size_t end) {
          for (size_t p = begin * width(); p < end * width(); ++p)
            if (counts_[p]) body(p);
        },
        stop);
  };
  const auto error = [&](size_t p) { return deviations[p] / std::sqrt(float(counts_[p])); };
  const auto gloss = [&](size_t p) {
    const Rgb diffuse = mean(p, Pass::kDiffuseIndirect) + mean(p, Pass::kDiffuseDirect);
    const Rgb seen = mean(p, Pass::kEmission) + mean(p, Pass::kEnvironment);
    return glm::max(mean(p, Pass::kCombined) - diffuse - seen, Rgb(0.0f));
  };
  LayeredFilter& filter = carry_->begin_smoothing();
  each([&](size_t p) {
    if (!carry_->guided(p)) return;
    const Rgb direct = mean(p, Pass::kDiffuseDirect), albedo = mean(p, Pass::kDiffuseColor);
    Rgb light(0.0f);
    for (int c = 0; c < 3; ++c) light[c] = albedo[c] > 0.0f ? direct[c] / albedo[c] : 0.0f;
    carry_->set_light(p, light, error(p));
  });
  filter.run(threads, stop);
  if (stop.stop()) return;
  // By no more than the pixel's own noise: so its mean is never left for long, and edges stay as smooth as they become.
  const auto within = [&](size_t p, const Rgb& difference) {
    const float most = kMostSmoothing * error(p) * luminance(mean(p, Pass::kCombined));
    const float wanted = luminance(glm::abs(difference));
    return wanted > most ? difference * (most / wanted) : difference;
  };
  each([&](size_t p) {
    carry_->take_nothing(p);
    if (!carry_->guided(p)) return;
    const Rgb smooth = filter.light(p) * mean(p, Pass::kDiffuseColor);
    carry_->take_smooth(p, within(p, smooth - mean(p, Pass::kDiffuseDirect)));
  });
  carry_->begin_smoothing();
  each([&](size_t p) {
    if (carry_->guided(p)) carry_->set_light(p, gloss(p), error(p));
  });
  filter.run(threads, stop);
  if (stop.stop()) return;
  each([&](size_t p) {
    if (carry_->guided(p)) carry_->take_smooth(p, within(p, filter.light(p) - gloss(p)));
  });
}

/// While an edit is asked about: the old mean with what changed of a cache's light, or the new sample.
void Film::read_edited(size_t pixel, size_t asked, float* out) const {
  if (!counts_[pixel] || carry_->change(asked) >= kShownAnew) {
    if (carry_->asked(asked)) return read_pixel(Pass::kCombined, carry_->sums(asked), 1, out);
    std::fill_n(out, 4, 0.0f);
    return;
  }
  const float* sums = sums_.data() + pixel * size_t(layout_.floats);
  read_pixel(Pass::kCombined, sums, counts_[pixel], out);
  if (keeps_sight()) add_sight(Pass::kCombined, sight_[pixel], sums, counts_[pixel], out);
  const Rgb& more = carry_->found(asked).cached;
  const Rgb smooth = carry_->smoothing(pixel);
  for (int c = 0; c < 3; ++c) out[c] = std::max(0.0f, out[c] + (more[c] + smooth[c]) * settings_.exposure);
}

}  // namespace afterglow
