// SPDX-License-Identifier: GPL-3.0-or-later
// Variances of batch means, and their sharing among neighbours.
#include "film/error_estimate.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

namespace afterglow {

namespace {

/// A plane of values with a weight each, blurred along both axes; pixels of weight 0 give nothing.
struct Plane {
  std::vector<double> value, weight;

  void blur(uint32_t width, uint32_t height, std::span<const double> kernel) {
    for (std::vector<double>* plane : {&value, &weight}) {
      along(*plane, width, height, 1, width, kernel);
      along(*plane, height, width, width, 1, kernel);
    }
  }
  double at(size_t p) const { return weight[p] > 0.0 ? value[p] / weight[p] : 0.0; }

 private:
  static void along(std::vector<double>& plane, uint32_t length, uint32_t lines, size_t step, size_t next,
                    std::span<const double> kernel) {
    const int reach = int(kernel.size()) / 2, n = int(length);
    std::vector<double> line(length);
    for (uint32_t l = 0; l < lines; ++l) {
      double* first = plane.data() + l * next;
      for (int i = 0; i < n; ++i) line[size_t(i)] = first[size_t(i) * step];
      for (int i = 0; i < n; ++i) {
        double sum = 0.0;
        for (int k = std::max(-reach, -i); k <= std::min(reach, n - 1 - i); ++k)
          sum += kernel[size_t(k + reach)] * line[size_t(i + k)];
        first[size_t(i) * step] = sum;
      }
    }
  }
};

constexpr std::array<double, 3> kThree = {1.0, 2.0, 1.0};
constexpr std::array<double, 5> kFive = {1.0, 4.0, 6.0, 4.0, 1.0};
/// Added to a squared brightness, as a share of the image's mean squared, so that black is no division by zero.
constexpr double kFloor = 1e-3;

}  // namespace

uint32_t batch_samples(uint32_t samples, uint32_t batch) {
  const uint32_t rest = samples % kAllBatches, before = batch * kBatchRun;
  return samples / kAllBatches * kBatchRun + (rest > before ? std::min(rest - before, kBatchRun) : 0u);
}

uint32_t batches_begun(uint32_t samples) {
  return std::min<uint32_t>((std::min(samples, kAllBatches) + kBatchRun - 1) / kBatchRun, kBatchCount);
}

PixelEstimate pixel_estimate(const float* batch_sums, uint32_t samples) {
  PixelEstimate pixel{.samples = samples};
  if (!samples) return pixel;
  const uint32_t batches = batches_begun(samples);
  for (uint32_t b = 0; b < batches; ++b) pixel.mean += batch_sums[b];
  pixel.mean /= samples;
  if (batches < 2) return pixel;
  double variance = 0.0;
  for (uint32_t b = 0; b < batches; ++b) {
    const double n = batch_samples(samples, b), off = batch_sums[b] / n - pixel.mean;
    variance += n * off * off;
  }
  pixel.error = std::sqrt(variance / (double(samples) * (batches - 1)));
  return pixel;
}

void pool_errors(std::vector<PixelEstimate>& pixels, uint32_t width, uint32_t height) {
  const size_t count = pixels.size();
  Plane brightness{std::vector<double>(count), std::vector<double>(count)};
  double total = 0.0, known = 0.0;
  for (size_t p = 0; p < count; ++p) {
    if (batches_begun(pixels[p].samples) < 2) continue;
    brightness.value[p] = pixels[p].mean, brightness.weight[p] = 1.0;
    total += pixels[p].mean, known += 1.0;
  }
  if (!(total > 0.0)) return;
  Plane relative{std::vector<double>(count), brightness.weight};
  brightness.blur(width, height, kThree);
  const double floor = kFloor * (total / known) * (total / known);
  std::vector<double> scale(count);
  for (size_t p = 0; p < count; ++p) {
    scale[p] = brightness.at(p) * brightness.at(p) + floor;
    if (relative.weight[p] > 0.0) relative.value[p] = pixels[p].error * pixels[p].error * pixels[p].samples / scale[p];
  }
  relative.blur(width, height, kFive);
  for (size_t p = 0; p < count; ++p)
    if (pixels[p].samples) pixels[p].error = std::sqrt(relative.at(p) * scale[p] / pixels[p].samples);
}

double ImageError::Sum::relative_spread(double count) const {
  const double m = mean(count);
  return m > 0.0 ? std::sqrt(std::max(0.0, squares / count - m * m) / count) / m : 0.0;
}

void ImageError::add(const float* batch_sums, uint32_t samples) {
  const PixelEstimate pixel = pixel_estimate(batch_sums, samples);
  const uint32_t batches = batches_begun(samples);
  const auto divided = [](double square, double mean) { return square / (mean * mean + 0.01); };
  const double mean = exposure_ * pixel.mean, error = exposure_ * pixel.error;
  double others = 0.0;
  for (uint32_t b = 0; b < batches; ++b) {
    const double n = batch_samples(samples, b), off = exposure_ * batch_sums[b] / n - mean;
    others += n * divided(off * off, (mean * samples - exposure_ * batch_sums[b]) / (samples - n));
  }
  own_.add(divided(error * error, mean));
  others_.add(others / (double(samples) * (batches - 1)));
  count_ += 1.0;
}

BelievedError ImageError::believed() const {
  const double mean = std::sqrt(own_.mean(count_) * others_.mean(count_));
  const double spread = mean * 1.96 * 0.5 * (own_.relative_spread(count_) + others_.relative_spread(count_));
  return {float(std::sqrt(mean)), float(std::sqrt(std::max(0.0, mean - spread))), float(std::sqrt(mean + spread))};
}

}  // namespace afterglow
