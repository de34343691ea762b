// SPDX-License-Identifier: GPL-3.0-or-later
// Where samples come together: sums of every kept pass for each pixel of a region, sixteen batch sums of luminance that
// tell the error, and what a reader gets from them. Writers and readers share pixels under one small lock for every
// strip of 32, so that an image can be read at any time without stopping the render.
#pragma once

#include <array>
#include <atomic>
#include <memory>
#include <span>
#include <vector>

#include "film/carry_over.h"
#include "film/error_estimate.h"
#include "film/passes.h"
#include "film/pixel_filter.h"

namespace afterglow {

struct FilmSettings {
  uint32_t width = 640, height = 360;       // of the full image
  uint32_t x0 = 0, y0 = 0, x1 = 0, y1 = 0;  // region, row 0 at the bottom; x1 = 0: everything
  PixelFilterKind filter = PixelFilterKind::kBlackmanHarris;
  float filter_width = 1.5f;
  bool transparent = false;
  float exposure = 1.0f;
  PassSet passes = kAlwaysKept;
  float mist_start = 5.0f, mist_depth = 25.0f;
  uint8_t mist_falloff = 0;  // 0 quadratic, 1 linear, 2 inverse quadratic
  bool operator==(const FilmSettings&) const = default;
};

/// The same with the region made whole and the passes that others are read with.
FilmSettings completed(FilmSettings);

/// A block of pixels to sample: every `step`th pixel of a rectangle, `count` samples from number `first` on. Pixels are
/// those of the full image and lie in the film's region.
struct PixelRequest {
  uint16_t x = 0, y = 0, width = 1, height = 1, step = 1;
  /// Leaves out the pixels that stand on a grid of this step, because an earlier request had them; 0: none.
  uint16_t skip = 0;
  uint32_t first = 0, count = 1;
  /// Samples beyond those that every pixel gets, where the picture is noisy: numbered by themselves.
  bool extra = false;
};

/// What a pixel's samples tell of its noise.
struct PixelNoise {
  float sum = 0.0f, squares = 0.0f;  // of the samples' luminances
  float seen = 0.0f;                 // light in neither, as rays of its own see to it: all rays' mean for each sample
  uint32_t samples = 0, extra = 0;   // all samples, and those of extra requests among them
};

/// Samples that a request takes, those left out not counted.
inline uint64_t sample_count(const PixelRequest& r) {
  const auto on_grid = [&](uint64_t step) { return ((r.width + step - 1) / step) * ((r.height + step - 1) / step); };
  return (on_grid(r.step) - (r.skip ? on_grid(r.skip) : 0)) * r.count;
}

/// Where each kept pass begins among the floats of one pixel; −1: not kept.
struct FilmLayout {
  explicit FilmLayout(PassSet);
  std::array<int16_t, kPassCount> at;
  int floats = 0;
  static constexpr int kMaxFloats = 112;
  int operator[](Pass p) const { return at[size_t(p)]; }
};

class Film {
 public:
  explicit Film(const FilmSettings&);
  const FilmSettings& settings() const { return settings_; }
  const FilmLayout& layout() const { return layout_; }
  const PixelFilter& filter() const { return filter_; }
  uint32_t width() const { return settings_.x1 - settings_.x0; }
  uint32_t height() const { return settings_.y1 - settings_.y0; }
  size_t bytes() const;

  /// From here on squares of luminances and extra samples are kept, too.
  void keep_noise();
  bool keeps_noise() const { return !squares_.empty(); }
  PixelNoise noise(size_t pixel) const;  // no squares where none are kept
  /// From here on light that camera rays meet at emitters and in the sky is the mean of all samples and of what see()
  /// adds, and no part of the noise: see render/sight.h. Needs kSeenPasses.
  static constexpr PassSet kSeenPasses = bit(Pass::kEmission) | bit(Pass::kEnvironment);
  void keep_sight();
  bool keeps_sight() const { return !sight_.empty(); }
  void see(uint32_t x, uint32_t y, const Rgb& emission, const Rgb& environment, uint32_t samples);
  uint32_t sight_samples(size_t pixel) const { return sight_[pixel].samples; }
  /// How many samples every pixel had when rays last looked; 0: never, or some of what they saw is gone.
  uint32_t looked() const { return looked_; }
  void set_looked(uint32_t samples) { looked_ = samples; }
  /// Adds the sums of `samples` samples of one pixel of the full image: layout().floats values. Extra samples stand in
  /// no batch.
  void add(uint32_t x, uint32_t y, const float* sums, uint32_t samples, float squares = 0.0f, bool extra = false);
  void clear();

  /// From here on samples outlive edits of the scene, see carry_over.h; needs kCarriedPasses. After
  /// begin_asking() the samples that come are each pixel's asked one, the same in every state of the scene, until
  /// end_asking(1). end_asking(step): every step-th pixel has it.
  static constexpr PassSet kCarriedPasses = bit(Pass::kDiffuseDirect) | bit(Pass::kDiffuseIndirect) |
                                            bit(Pass::kDiffuseColor) | bit(Pass::kEmission) | bit(Pass::kEnvironment);
  void carry_over();
  bool carries() const { return carry_ != nullptr; }
  void begin_asking();
  /// rest: what seems untouched will be asked later; else an eighth of it is asked now, another one each time.
  void end_asking(uint32_t step, bool rest = true);
  bool asks() const { return asking_; }
  /// Whether any pixel of a request has to be asked soon; the others' turn comes with ask_the_rest().
  bool wants(const PixelRequest&) const;
  void ask_the_rest();
  bool rest_waits() const { return carry_ && carry_->some_quiet(); }
  /// The first diffuse surface of the asked sample of a pixel of the full image: after its add().
  void guide(uint32_t x, uint32_t y, const LayerPixel&);
  /// From here on pictures show diffuse direct light filtered. deviations: of one sample of each pixel, relative.
  void smooth(const std::vector<float>& deviations, unsigned threads, StopToken stop);
  /// The number of the next sample that no pixel has had; moves on.
  uint32_t next_sample() { return ++sample_; }
  uint32_t samples(size_t pixel) const { return counts_[pixel]; }
  /// What samples of carried films spread by, as BelievedError's value.
  float spread() const;

  /// A pass over the region, row 0 at the bottom, pass_info(pass).channels values a pixel. step > 1: only every step-th
  /// pixel has samples; the others are shown as their block's first.
  void read(Pass, float* out, uint32_t step = 1, StopToken stop = {}) const;
  BelievedError believed_error() const;

 private:
  class Lock;
  uint32_t batch_sums(size_t pixel, float* sums) const;  // returns the samples that stand in batches
  uint32_t in_batches(size_t pixel) const { return counts_[pixel] - (extras_.empty() ? 0u : extras_[pixel]); }
  void read_error(float* out, uint32_t step) const;
  struct Sight {
    Rgb emission{0.0f}, environment{0.0f};  // sums
    uint32_t samples = 0;
  };
  Rgb seen(const float* sums) const;
  float mean_seen(const Sight&, const float* sums, uint32_t samples) const;
  void add_sight(Pass, const Sight&, const float* sums, uint32_t samples, float* out) const;
  void read_row(Pass, float* out, uint32_t y, uint32_t step) const;
  void read_pixel(Pass, const float* sums, uint32_t samples, float* out) const;
  void read_edited(size_t pixel, size_t asked, float* out) const;
  void settle(size_t pixel);
  void keep(size_t pixel, uint32_t samples, const Rgb& cached);
  FilmSettings settings_;
  FilmLayout layout_;
  PixelFilter filter_;
  std::vector<float> sums_;
  std::vector<uint32_t> counts_;
  std::vector<float> squares_;    // empty: no noise is kept
  std::vector<uint32_t> extras_;  // of counts_
  std::vector<Sight> sight_;      // empty: none is kept
  std::atomic<uint32_t> looked_{0};
  std::unique_ptr<CarryOver> carry_;
  bool asking_ = false;
  uint32_t sample_ = 0;
  mutable std::vector<std::atomic_flag> locks_;
};

/// The lock of the strip that a pixel lies in.
class Film::Lock {
 public:
  Lock(const Film& film, size_t pixel) : flag_(film.locks_[pixel / 32]) {
    while (flag_.test_and_set(std::memory_order_acquire)) {
    }
  }
  ~Lock() { flag_.clear(std::memory_order_release); }

 private:
  std::atomic_flag& flag_;
};

}  // namespace afterglow
