// SPDX-License-Identifier: GPL-3.0-or-later
// Accumulation and resolution of the film's passes.
#include "film/film.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "base/parallel.h"

namespace afterglow {

namespace {

uint32_t stored_floats(Pass pass) {
  switch (pass) {
    case Pass::kSampleCount:
    case Pass::kError:
      return 0;  // made from others
    default:
      return pass_info(pass).channels;
  }
}

}  // namespace

FilmSettings completed(FilmSettings s) {
  s.passes |= kAlwaysKept;
  if (s.x1 == 0 || s.x1 > s.width) s.x1 = s.width;
  if (s.y1 == 0 || s.y1 > s.height) s.y1 = s.height;
  s.x0 = std::min(s.x0, s.x1), s.y0 = std::min(s.y0, s.y1);
  // A light pass is read divided by its colour.
  const PassSet direct = bit(Pass::kDiffuseDirect) | bit(Pass::kDiffuseIndirect);
  if (s.passes & direct) s.passes |= bit(Pass::kDiffuseColor);
  if (s.passes & (direct << 3)) s.passes |= bit(Pass::kGlossyColor);
  if (s.passes & (direct << 6)) s.passes |= bit(Pass::kTransmissionColor);
  return s;
}

FilmLayout::FilmLayout(PassSet passes) {
  at.fill(-1);
  for (int i = 0; i < kPassCount; ++i) {
    const uint32_t size = stored_floats(Pass(i));
    if (!(passes & (1u << i)) || !size) continue;
    at[size_t(i)] = int16_t(floats);
    floats += int(size);
  }
}

Film::Film(const FilmSettings& settings)
    : settings_(completed(settings)),
      layout_(settings_.passes),
      filter_(settings_.filter, settings_.filter_width),
      sums_(size_t(width()) * height() * size_t(layout_.floats)),
      counts_(size_t(width()) * height()),
      locks_(counts_.size() / 32 + 1) {}

size_t Film::bytes() const {
  return (sums_.size() + squares_.size()) * sizeof(float) + (counts_.size() + extras_.size()) * sizeof(uint32_t) +
         sight_.size() * sizeof(Sight) + locks_.size() + (carry_ ? carry_->bytes() : 0);
}

void Film::clear() {  // sums without samples are never read: they need no zeros
  std::fill(counts_.begin(), counts_.end(), 0u);
  std::fill(extras_.begin(), extras_.end(), 0u);
  std::fill(squares_.begin(), squares_.end(), 0.0f);
  std::fill(sight_.begin(), sight_.end(), Sight{});
  looked_ = 0;
  if (carry_) carry_->clear();
  asking_ = false;
  sample_ = 0;
}

void Film::keep_noise() {
  if (keeps_noise()) return;
  squares_.assign(counts_.size(), 0.0f);
  extras_.assign(counts_.size(), 0u);
}

PixelNoise Film::noise(size_t pixel) const {
  const Lock lock(*this, pixel);
  if (!counts_[pixel]) return {};
  const float* sums = sums_.data() + pixel * size_t(layout_.floats);
  const float* c = sums + layout_[Pass::kCombined];
  PixelNoise noise{.sum = luminance(Rgb(c[0], c[1], c[2])), .samples = counts_[pixel]};
  if (keeps_sight()) {
    noise.sum -= luminance(seen(sums));
    noise.seen = mean_seen(sight_[pixel], sums, noise.samples) * float(noise.samples);
  }
  if (keeps_noise()) noise.squares = squares_[pixel], noise.extra = extras_[pixel];
  return noise;
}

void Film::keep_sight() {
  if (!keeps_sight()) sight_.resize(counts_.size());
}

void Film::see(uint32_t x, uint32_t y, const Rgb& emission, const Rgb& environment, uint32_t samples) {
  const size_t pixel = size_t(y - settings_.y0) * width() + (x - settings_.x0);
  const Lock lock(*this, pixel);
  Sight& sight = sight_[pixel];
  sight.emission += emission, sight.environment += environment, sight.samples += samples;
}

Rgb Film::seen(const float* sums) const {
  const float* emission = sums + layout_[Pass::kEmission];
  const float* sky = sums + layout_[Pass::kEnvironment];
  const float share = settings_.transparent ? 0.0f : 1.0f;  // a transparent film shows no sky
  return Rgb(emission[0] + share * sky[0], emission[1] + share * sky[1], emission[2] + share * sky[2]);
}

/// Luminance of all rays' mean.
float Film::mean_seen(const Sight& sight, const float* sums, uint32_t samples) const {
  const Rgb more = sight.emission + (settings_.transparent ? Rgb(0.0f) : sight.environment);
  return luminance(seen(sums) + more) / float(samples + sight.samples);
}

/// Puts the mean over all rays in the place of the samples' own.
void Film::add_sight(Pass pass, const Sight& sight, const float* sums, uint32_t samples, float* out) const {
  if (!sight.samples || !samples) return;
  const auto add = [&](Pass from, const Rgb& sum) {
    const float* own = sums + layout_[from];
    for (int c = 0; c < 3; ++c) {
      const float all = (own[c] + sum[c]) / float(samples + sight.samples);
      out[c] += (all - own[c] / float(samples)) * settings_.exposure;
    }
  };
  const bool combined = pass == Pass::kCombined;
  if (combined || pass == Pass::kEmission) add(Pass::kEmission, sight.emission);
  if (pass == Pass::kEnvironment || (combined && !settings_.transparent)) add(Pass::kEnvironment, sight.environment);
  if (combined)
    for (int c = 0; c < 3; ++c) out[c] = std::max(0.0f, out[c]);  // of rounding
}

void Film::add(uint32_t x, uint32_t y, const float* sums, uint32_t samples, float squares, bool extra) {
  const size_t pixel = size_t(y - settings_.y0) * width() + (x - settings_.x0);
  float* to = sums_.data() + pixel * size_t(layout_.floats);
  const Lock lock(*this, pixel);
  if (asking_) return carry_->ask(pixel, sums);
  if (counts_[pixel])
    for (int i = 0; i < layout_.floats; ++i) to[i] += sums[i];
  else
    std::copy_n(sums, layout_.floats, to);
  counts_[pixel] += samples;
  if (squares_.empty()) return;
  squares_[pixel] += squares;
  if (extra) extras_[pixel] += samples;
}

void Film::read_pixel(Pass pass, const float* sums, uint32_t samples, float* out) const {
  const float scale = samples ? 1.0f / float(samples) : 0.0f, exposed = scale * settings_.exposure;
  const float* from = layout_[pass] >= 0 ? sums + layout_[pass] : nullptr;
  const int channels = pass_info(pass).channels;
  const auto copy = [&](float factor) {
    for (int c = 0; c < channels; ++c) out[c] = from ? from[c] * factor : 0.0f;
  };
  const auto divided = [&](Pass color_pass) {
    const float* color = sums + layout_[color_pass];
    for (int c = 0; c < 3; ++c) out[c] = from && color[c] > 0.0f ? from[c] / color[c] * settings_.exposure : 0.0f;
  };
  switch (pass) {
    case Pass::kCombined:
      copy(exposed);
      out[3] = samples ? std::clamp(1.0f - from[3] * scale, 0.0f, 1.0f) : 0.0f;
      break;
    case Pass::kDepth:
      out[0] = from && from[0] != 0.0f ? from[0] : 1e10f;  // nothing there
      break;
    case Pass::kPosition:
    case Pass::kObjectIndex:
    case Pass::kMaterialIndex:
      copy(1.0f);  // the first sample's
      break;
    case Pass::kMist:
      out[0] = from ? 1.0f - from[0] * scale : 0.0f;
      break;
    case Pass::kDiffuseDirect:
    case Pass::kDiffuseIndirect:
      divided(Pass::kDiffuseColor);
      break;
    case Pass::kGlossyDirect:
    case Pass::kGlossyIndirect:
      divided(Pass::kGlossyColor);
      break;
    case Pass::kTransmissionDirect:
    case Pass::kTransmissionIndirect:
      divided(Pass::kTransmissionColor);
      break;
    case Pass::kEmission:
    case Pass::kEnvironment:
      copy(exposed);
      break;
    case Pass::kSampleCount:
      out[0] = float(samples);
      break;
    case Pass::kBatches:
      for (uint32_t b = 0; b < kBatchCount; ++b) {
        const uint32_t n = batch_samples(samples, b);
        out[b] = n ? from[b] / float(n) * settings_.exposure : 0.0f;
      }
      break;
    default:
      copy(scale);
  }
}

void Film::read(Pass pass, float* out, uint32_t step, StopToken stop) const {
  if (pass == Pass::kError) return read_error(out, step);
  // Rows that are shown as an earlier one stay in that one's block.
  parallel_blocks(
      height(), std::max(step, 16u) / step * step, 0,
      [&](size_t begin, size_t end) {
        for (size_t y = begin; y < end; ++y) read_row(pass, out, uint32_t(y), step);
      },
      stop);
}

float Film::spread() const {
  double mean = 0.0, total = 0.0;
  const size_t pixels = counts_.size();
  for (size_t p = 0; p < pixels; ++p) {
    const PixelNoise n = noise(p);
    mean += n.samples ? double(n.sum + n.seen) / n.samples : 0.0;
  }
  mean /= double(std::max<size_t>(pixels, 1));
  if (!(mean > 0.0)) return 0.0f;
  const double exposure = 0.5 / mean;
  for (size_t p = 0; p < pixels; ++p) {
    const PixelNoise n = noise(p);
    if (n.samples < 2) continue;
    const double m = exposure * n.sum / n.samples, square = exposure * exposure * n.squares / n.samples;
    const double level = exposure * (n.sum + n.seen) / n.samples;
    total += std::max(0.0, square - m * m) / (n.samples - 1) / (level * level + 0.01);
  }
  return float(std::sqrt(total / double(pixels)));
}

void Film::read_row(Pass pass, float* out, uint32_t y, uint32_t step) const {
  const size_t channels = pass_info(pass).channels, w = width();
  std::array<float, FilmLayout::kMaxFloats> sums;
  if (asking_ && pass == Pass::kCombined) {
    for (size_t x = 0; x < w; ++x)
      read_edited(y * w + x, size_t(y - y % step) * w + (x - x % step), out + (y * w + x) * channels);
    return;
  }
  if (y % step) {
    float* row = out + y * w * channels;
    std::memcpy(row, row - w * channels, w * channels * sizeof(float));
    return;
  }
  for (size_t x = 0; x < w; ++x) {
    float* to = out + (y * w + x) * channels;
    if (x % step) {
      std::memcpy(to, to - channels, channels * sizeof(float));
      continue;
    }
    const size_t pixel = y * w + x;
    uint32_t samples, all;
    Sight sight;
    {
      const Lock lock(*this, pixel);
      if (keeps_sight()) sight = sight_[pixel];
      std::memcpy(sums.data(), sums_.data() + pixel * size_t(layout_.floats), size_t(layout_.floats) * sizeof(float));
      all = counts_[pixel], samples = pass == Pass::kBatches ? in_batches(pixel) : all;
    }
    if (!samples) sums.fill(0.0f);
    read_pixel(pass, sums.data(), samples, to);
    add_sight(pass, sight, sums.data(), samples, to);
    if (pass == Pass::kBatches && keeps_sight() && all)
      for (uint32_t b = 0; b < batches_begun(samples); ++b)
        to[b] += mean_seen(sight, sums.data(), all) * settings_.exposure;
    if (!carry_ || pass != Pass::kCombined || !samples) continue;
    const Rgb& smooth = carry_->smoothing(pixel);
    for (int c = 0; c < 3; ++c) to[c] = std::max(0.0f, to[c] + smooth[c] * settings_.exposure);
  }
}

uint32_t Film::batch_sums(size_t pixel, float* sums) const {
  const Lock lock(*this, pixel);
  std::memcpy(sums, sums_.data() + pixel * size_t(layout_.floats) + size_t(layout_[Pass::kBatches]),
              kBatchCount * sizeof(float));
  const uint32_t samples = in_batches(pixel);
  if (keeps_sight() && counts_[pixel]) {  // batches hold what is noisy alone
    const float seen = mean_seen(sight_[pixel], sums_.data() + pixel * size_t(layout_.floats), counts_[pixel]);
    for (uint32_t b = 0; b < kBatchCount; ++b) sums[b] += seen * float(batch_samples(samples, b));
  }
  if (samples == counts_[pixel] || !samples) return samples;
  // Extra samples make the mean surer: batches are shown as far apart as if all had stood in them.
  double mean = 0.0;
  for (int b = 0; b < kBatchCount; ++b) mean += sums[b];
  mean /= samples;
  const double share = std::sqrt(double(samples) / counts_[pixel]);
  for (uint32_t b = 0; b < kBatchCount; ++b) {
    const double whole = mean * batch_samples(samples, b);
    sums[b] = float(whole + share * (sums[b] - whole));
  }
  return samples;
}

void Film::read_error(float* out, uint32_t step) const {
  std::vector<PixelEstimate> pixels(counts_.size());
  std::array<float, kBatchCount> sums;
  for (size_t p = 0; p < pixels.size(); ++p) {
    const uint32_t samples = batch_sums(p, sums.data());
    pixels[p] = pixel_estimate(sums.data(), samples);
  }
  pool_errors(pixels, width(), height());
  for (uint32_t y = 0; y < height(); ++y)
    for (uint32_t x = 0; x < width(); ++x)
      out[size_t(y) * width() + x] =
          float(pixels[size_t(y - y % step) * width() + (x - x % step)].error * settings_.exposure);
}

BelievedError Film::believed_error() const {
  const size_t pixels = counts_.size();
  std::array<float, kBatchCount> sums;
  double total = 0.0;
  for (size_t p = 0; p < pixels; ++p) {
    const uint32_t samples = batch_sums(p, sums.data());
    if (batches_begun(samples) < 2) return {};
    total += pixel_estimate(sums.data(), samples).mean;
  }
  if (!pixels) return {};
  if (!(total > 0.0)) return {0.0f, 0.0f, 0.0f};
  ImageError image(0.5 * double(pixels) / total);
  for (size_t p = 0; p < pixels; ++p) {
    const uint32_t samples = batch_sums(p, sums.data());
    image.add(sums.data(), samples);
  }
  return image.believed();
}

}  // namespace afterglow
