// SPDX-License-Identifier: GPL-3.0-or-later
// How far a pixel is from the truth, told from its samples alone: sixteen independently scrambled batches give each
// pixel a variance, neighbours share their relative variances. docs/methods/path_tracing.md says why and how well it
// holds.
#pragma once

#include <cstdint>
#include <vector>

#include "film/passes.h"

namespace afterglow {

/// So many samples in a row are one stratified set; the next go to the next batch. Every batch has a scramble of its
/// own and goes on with its own sequence when its turn comes again.
inline constexpr uint32_t kBatchRun = 4;
/// From this number on every batch has samples.
inline constexpr uint32_t kAllBatches = kBatchRun * kBatchCount;

inline uint32_t batch_of(uint32_t sample) { return sample / kBatchRun % kBatchCount; }
/// Which of its batch's own samples a sample is.
inline uint32_t index_in_batch(uint32_t sample) { return sample / kAllBatches * kBatchRun + sample % kBatchRun; }
/// How many of the first `samples` are in a batch.
uint32_t batch_samples(uint32_t samples, uint32_t batch);
/// How many batches have any of the first `samples`.
uint32_t batches_begun(uint32_t samples);

/// One pixel's mean luminance, its own standard error and its samples.
struct PixelEstimate {
  double mean = 0.0, error = 0.0;
  uint32_t samples = 0;
};
/// From batch sums alone; the error is 0 when fewer than two batches have samples.
PixelEstimate pixel_estimate(const float* batch_sums, uint32_t samples);

/// Replaces each error of a width × height image by one that the 5×5 neighbours share in: relative variances of one
/// sample are averaged with binomial weights, and what comes out is scaled to the pixel's brightness and samples.
void pool_errors(std::vector<PixelEstimate>& pixels, uint32_t width, uint32_t height);

/// Relative error of a whole image as its samples make believe: sqrt(mean(var / (mean² + 0.01))) of luminance, exposed
/// to a mean of 0.5, with its own 95 % interval. Negative: not known yet.
struct BelievedError {
  float value = -1.0f, low = -1.0f, high = -1.0f;
};

/// Gathers a BelievedError over the pixels. The mean that a variance is divided by is noisy itself: divided by its own
/// pixel's mean a variance counts for too little, because the two rise together; divided by the mean of the other
/// fifteen batches it counts for too much, because the reciprocal is convex. The geometric mean of both is believed.
class ImageError {
 public:
  explicit ImageError(double exposure) : exposure_(exposure) {}
  void add(const float* batch_sums, uint32_t samples);
  BelievedError believed() const;

 private:
  struct Sum {
    double sum = 0.0, squares = 0.0;
    void add(double x) { sum += x, squares += x * x; }
    double mean(double count) const { return sum / count; }
    double relative_spread(double count) const;
  };
  double exposure_, count_ = 0.0;
  Sum own_, others_;
};

}  // namespace afterglow
