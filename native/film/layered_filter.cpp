// SPDX-License-Identifier: GPL-3.0-or-later
// The layered filter: see layered_filter.h. Where it differs from Roth et al. 2020: (3) and (4) go negative and depend
// on the scene's units, so lengths are relative and weights end at 0; (3) takes the distance from the tangent plane,
// because path lengths differ along a floor seen at a grazing angle; (5) is left out, since irradiance knows no albedo;
// (6) measures a difference by the error that is believed, so that the filter fades as the light converges.
#include "film/layered_filter.h"

#include <algorithm>
#include <cstring>

#include "base/parallel.h"

namespace afterglow {

namespace {

constexpr float kKernel[3] = {3.0f / 8.0f, 1.0f / 4.0f, 1.0f / 16.0f};
constexpr float kErrorScale = 16.0f;  // single samples of bounced light spread by a few times their mean
constexpr float kExact = 0.06f;       // relative error below which light is left alone
constexpr float kSegment = 2.0f;      // s_d'
constexpr float kLuminance = 3.0f;    // s_l, as the paper has it

constexpr float kMostLength = 1e30f;
constexpr float kTiny = 1e-35f;  // keeps 0 / 0 from being asked
constexpr size_t kMargin = 16;   // before and behind: eight are read at once, up to eight beside a row's end

/// How far luminances may differ. Faster than the error itself, so that the filter is gone when it would blur more than
/// it smooths.
inline float believed(float error) { return kErrorScale * error * std::sqrt(error); }

/// Eight pixels at once.
using Floats = float __attribute__((vector_size(32)));
constexpr int kLanes = 8;
constexpr Floats kIndices = {0, 1, 2, 3, 4, 5, 6, 7};

inline Floats load(const float* from) {
  Floats v;
  std::memcpy(&v, from, sizeof v);
  return v;
}
inline float most(float a, float b) { return a > b ? a : b; }
inline Floats most(Floats a, Floats b) { return a > b ? a : b; }

// The weights, all from 0 to 1 and without units, of one pair of pixels or of eight. (2)
template <class T>
T normal_weight(T cosine) {
  const T c = most(cosine, T{}), c2 = c * c, c4 = c2 * c2;
  return c4 * c4;
}
/// (3), by the distance from the plane.
template <class T>
T plane_weight(T off, T footprint_a, T footprint_b, float reach) {
  return most(1.0f - most(off, -off) / (0.5f * reach * most(footprint_a, footprint_b) + kTiny), T{});
}
/// (4), relative.
template <class T>
T segment_weight(T a, T b) {
  return most(1.0f - kSegment * most(a - b, b - a) / (most(a, b) + kTiny), T{});
}
/// (6), relative to what is believed: 1 - log(1 + y) with y = kLuminance r / (1 + r) by the second Padé approximant,
/// half a hundredth off at most.
template <class T>
T luminance_weight(T a, T b, T error) {
  const T difference = most(a - b, b - a);
  const T y = kLuminance * difference / (difference + 0.5f * (a + b) * error + kTiny);
  return most(1.0f - y * (6.0f + 3.0f * y) / (6.0f + y * (6.0f + y)), T{});
}

}  // namespace

void LayeredFilter::begin(uint32_t width, uint32_t height) {
  width_ = width, height_ = height;
  const size_t pixels = size_t(width) * height + 2 * kMargin;
  for (auto* plane : {&x_, &y_, &z_, &nx_, &ny_, &nz_, &footprint_, &segment_, &spread_, &red_, &green_, &blue_,
                      &luminance_, &next_[0], &next_[1], &next_[2], &next_known_})
    if (plane->size() < pixels) plane->resize(pixels);  // what no surface has set is never used but times 0
  known_.assign(pixels, 0.0f);
  todo_.assign(pixels, 0);
}

Rgb LayeredFilter::light(size_t pixel) const {
  return {red_[pixel + kMargin], green_[pixel + kMargin], blue_[pixel + kMargin]};
}

void LayeredFilter::set(size_t pixel, const LayerPixel& p) {
  pixel += kMargin;
  x_[pixel] = p.position.x, y_[pixel] = p.position.y, z_[pixel] = p.position.z;
  nx_[pixel] = p.normal.x, ny_[pixel] = p.normal.y, nz_[pixel] = p.normal.z;
  footprint_[pixel] = p.footprint, segment_[pixel] = std::min(p.segment, kMostLength),
  spread_[pixel] = believed(p.error);
  red_[pixel] = p.light.x, green_[pixel] = p.light.y, blue_[pixel] = p.light.z;
  luminance_[pixel] = luminance(p.light);
  known_[pixel] = p.hole ? 0.0f : 1.0f;
  todo_[pixel] = p.hole || p.error > kExact;
}

/// Eight pixels of a row, from column x on: all that they are asked for is loaded once, and sums stay in registers.
void LayeredFilter::block(int x, int y, int step) {
  const int width = int(width_), height = int(height_);
  const size_t p = kMargin + size_t(y) * width_ + size_t(x);
  const Floats columns = kIndices + float(x);
  const Floats ax = load(&x_[p]), ay = load(&y_[p]), az = load(&z_[p]);
  const Floats nax = load(&nx_[p]), nay = load(&ny_[p]), naz = load(&nz_[p]);
  const Floats footprint = load(&footprint_[p]), segment = load(&segment_[p]);
  const Floats luminances = load(&luminance_[p]), spread = load(&spread_[p]), known = load(&known_[p]);
  Floats weight = known * (kKernel[0] * kKernel[0]);
  Floats red = weight * load(&red_[p]), green = weight * load(&green_[p]), blue = weight * load(&blue_[p]);
  const float sharpness = 1.0f / float(step);
  for (int dy = -2; dy <= 2; ++dy) {
    if (y + dy * step < 0 || y + dy * step >= height) continue;
    for (int dx = -2; dx <= 2; ++dx) {
      const int left = x + dx * step;
      if ((!dx && !dy) || left + kLanes <= 0 || left >= width) continue;
      const size_t q = size_t(ptrdiff_t(p) + ptrdiff_t(dy * step) * width + dx * step);
      uint64_t any[4];  // known pixels are rare in the layers behind mirrors
      std::memcpy(any, &known_[q], sizeof any);
      if (!(any[0] | any[1] | any[2] | any[3])) continue;
      const Floats column = columns + float(dx * step);
      const Floats here = column >= 0.0f && column < float(width) ? load(&known_[q]) : Floats{};
      const Floats nbx = load(&nx_[q]), nby = load(&ny_[q]), nbz = load(&nz_[q]);
      const Floats wx = load(&x_[q]) - ax, wy = load(&y_[q]) - ay, wz = load(&z_[q]) - az;
      const Floats off_a = wx * nax + wy * nay + wz * naz, off_b = wx * nbx + wy * nby + wz * nbz;
      const float reach = float(step * std::max(std::abs(dx), std::abs(dy)));
      const Floats stop =
          normal_weight(nax * nbx + nay * nby + naz * nbz) *
          plane_weight(most(most(off_a, -off_a), most(off_b, -off_b)), footprint, load(&footprint_[q]), reach) *
          segment_weight(segment, load(&segment_[q]));
      const Floats light =
          luminance_weight(luminances, load(&luminance_[q]), most(spread, load(&spread_[q])) * sharpness);
      const float kernel = kKernel[std::abs(dx)] * kKernel[std::abs(dy)];
      const Floats w = here * (kernel * stop) * (known != 0.0f ? light : Floats{} + 1.0f);
      weight += w;
      red += w * load(&red_[q]), green += w * load(&green_[q]), blue += w * load(&blue_[q]);
    }
  }
  for (int i = 0; i < std::min(kLanes, width - x); ++i) {
    if (!todo_[p + size_t(i)] || !(weight[i] > 0.0f)) continue;
    const float scale = 1.0f / weight[i];
    next_[0][p + size_t(i)] = red[i] * scale, next_[1][p + size_t(i)] = green[i] * scale;
    next_[2][p + size_t(i)] = blue[i] * scale;
    next_known_[p + size_t(i)] = 1.0f;
  }
}

void LayeredFilter::run(unsigned threads, StopToken stop, int passes) {
  const auto rows = [&](const auto& what) {
    parallel_blocks(
        height_, 8, threads,
        [&](size_t begin, size_t end) {
          for (size_t y = begin; y < end; ++y)
            if (std::memchr(todo_.data() + kMargin + y * width_, 1, width_)) what(int(y));
        },
        stop);
  };
  for (int pass = 0; pass < passes && !stop.stop(); ++pass) {
    rows([&](int y) {
      const size_t first = kMargin + size_t(y) * width_;
      std::fill_n(next_known_.begin() + ptrdiff_t(first), width_, 0.0f);
      for (size_t x = 0; x < width_; x += kLanes)
        if (std::memchr(todo_.data() + first + x, 1, std::min<size_t>(kLanes, width_ - x))) block(int(x), y, 1 << pass);
    });
    if (stop.stop()) return;
    rows([&](int y) {
      for (size_t p = kMargin + size_t(y) * width_, end = p + width_; p < end; ++p)
        if (todo_[p] && next_known_[p] != 0.0f) {
          red_[p] = next_[0][p], green_[p] = next_[1][p], blue_[p] = next_[2][p];
          luminance_[p] = luminance({red_[p], green_[p], blue_[p]});
          known_[p] = 1.0f;
        }
    });
  }
}

}  // namespace afterglow
