// SPDX-License-Identifier: GPL-3.0-or-later
// What a film keeps of its samples when the scene was edited and the view stands still. One sample of every pixel is
// taken again with the same random numbers: where nothing that it touched changed, it comes out the same to the bit, so
// its difference tells the edit from the noise (Schied, Peters and Dachsbacher 2018, "Gradient Estimation for Real-Time
// Adaptive Temporal Filtering"). Light that a cache answered has next to no noise: its difference is added to what
// stands there. Of all other light a pixel keeps so many samples that their being old weighs no more than their noise.
#pragma once

#include <cstdint>
#include <vector>

#include "base/math.h"
#include "film/layered_filter.h"
#include "film/passes.h"

namespace afterglow {

struct FilmLayout;

/// What an edit changed at a pixel, told by one sample before and after.
struct PixelChange {
  Rgb cached{0.0f};    // light that a cache answered: the difference
  bool other = false;  // the sample meets another place
  float apart = 0.0f;  // all other light: how far apart, luminance
  float level = 0.0f;  // of the brighter of both samples
};

/// How many of a pixel's samples stay when light around it changed by this much, relative: 1, everything; 0, nothing.
/// None: the pixel starts anew.
uint32_t samples_kept(uint32_t samples, float change);
/// From this change on what is shown is the new sample, however coarse, and not the old mean.
inline constexpr float kShownAnew = 0.3f;

class CarryOver {
 public:
  CarryOver(uint32_t width, uint32_t height, const FilmLayout&);
  void clear();
  /// After an edit: no pixel was asked yet. What was found and not settled since the last edit stays found.
  void begin();
  /// The asked sample of a pixel, from sums of all passes. Threads may ask different pixels at once.
  void ask(size_t pixel, const float* sums);
  bool asked(size_t pixel) const { return asked_[pixel]; }
  const float* sums(size_t pixel) const { return sums_.data() + pixel * floats_; }
  const PixelChange& found(size_t pixel) const { return found_[pixel]; }
  /// After every step-th pixel was asked: how much changed around each.
  void weigh(uint32_t step);
  float change(size_t pixel) const { return change_[pixel]; }
  /// After weigh(kQuietStep): blocks of kQuietBlock pixels in which and beside which no asked sample told of a change.
  /// They need not be asked at once: what their nearest asked pixel found of a cache's light stands for them.
  /// `all`: else every kTurns-th of them is not left alone, in turns.
  void find_quiet(bool all);
  bool quiet(uint32_t x, uint32_t y) const {
    return !quiet_.empty() && quiet_[size_t(y / kQuietBlock) * blocks_ + x / kQuietBlock];
  }
  bool some_quiet() const { return !quiet_.empty(); }
  void forget_quiet() { quiet_.clear(); }
  static constexpr uint32_t kQuietStep = 4, kQuietBlock = 16, kTurns = 8;
  /// The pixel's samples were set right.
  void settle(size_t pixel) { found_[pixel] = PixelChange{}, change_[pixel] = 0.0f, settled_[pixel] = 1; }
  bool settled(size_t pixel) const { return settled_[pixel]; }
  /// The same, without its sample: the difference in a cache's light of a pixel nearby is taken for its own.
  void follow(size_t pixel, const Rgb& cached);
  size_t bytes() const;

  // Direct light as a picture shows it: what the layered filter makes of its diffuse part, before albedo. It fades as
  // samples come together.
  /// The first diffuse surface of the asked sample; light and error are left out.
  void guide(size_t pixel, const LayerPixel& surface);
  LayeredFilter& begin_smoothing();
  /// light: a mean, before albedo; error: how far the pixel may be off, relative.
  void set_light(size_t pixel, const Rgb& light, float error);
  /// Light as it is shown, in place of the pixel's own.
  void take_smooth(size_t pixel, const Rgb& difference) { smoothing_[pixel] += difference; }
  void take_nothing(size_t pixel) { smoothing_[pixel] = Rgb(0.0f); }
  bool guided(size_t pixel) const { return guided_[pixel] & kGuided; }
  const Rgb& smoothing(size_t pixel) const { return smoothing_[pixel]; }

 private:
  uint32_t width_, height_;
  size_t floats_;
  int combined_, cached_;
  std::vector<float> sums_;  // of the sample, as the last state of the scene had it
  std::vector<uint8_t> asked_, known_, other_before_, settled_, quiet_;
  size_t blocks_, turn_ = 0;
  std::vector<PixelChange> found_;
  std::vector<float> change_;
  std::vector<LayerPixel> guides_;
  static constexpr uint8_t kGuided = 1, kWasGuided = 2;
  std::vector<uint8_t> guided_;  // this pixel's asked sample met a diffuse surface; it did in the state before
  std::vector<Rgb> smoothing_;
  LayeredFilter filter_;
};

}  // namespace afterglow
