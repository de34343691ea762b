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

constexpr int kPasses = 3;
constexpr float kKernel[3] = {3.0f / 8.0f, 1.0f / 4.0f, 1.0f / 16.0f};
constexpr float kErrorScale = 16.0f;  // single samples of bounced light spread by a few times their mean
constexpr float kExact = 0.06f;       // relative error below which light is left alone
constexpr float kSegment = 2.0f;      // s_d'
constexpr float kLuminance = 3.0f;    // s_l, as the paper has it

constexpr float kMostLength = 1e30f;
constexpr float kTiny = 1e-35f;  // keeps 0 / 0 from being asked
constexpr int kRun = 64;         // pixels of a row at a time

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

// The weights, of one pair of pixels or of eight.
template <class T>
T normal_weight(T cosine) {
  const T c = most(cosine, T{}), c2 = c * c, c4 = c2 * c2;
  return c4 * c4;
}
template <class T>
T plane_weight(T off, T footprint_a, T footprint_b, float reach) {
  return most(1.0f - most(off, -off) / (0.5f * reach * most(footprint_a, footprint_b) + kTiny), T{});
}
template <class T>
T segment_weight(T a, T b) {
  return most(1.0f - kSegment * most(a - b, b - a) / (most(a, b) + kTiny), T{});
}
/// 1 - log(1 + y) with y = kLuminance r / (1 + r) by the second Padé approximant, half a hundredth off at most.
template <class T>
T luminance_weight(T a, T b, T error) {
  const T difference = most(a - b, b - a);
  const T y = kLuminance * difference / (difference + 0.5f * (a + b) * error + kTiny);
  return most(1.0f - y * (6.0f + 3.0f * y) / (6.0f + y * (6.0f + y)), T{});
}

}  // namespace

float normal_stop(const Vec3& a, const Vec3& b) { return normal_weight(glm::dot(a, b)); }

float plane_stop(const LayerPixel& a, const LayerPixel& b, float reach) {
  const Vec3 way = b.position - a.position;
  const float off = std::max(std::fabs(glm::dot(way, a.normal)), std::fabs(glm::dot(way, b.normal)));
  return plane_weight(off, a.footprint, b.footprint, reach);
}

float segment_stop(float a, float b) { return segment_weight(std::min(a, kMostLength), std::min(b, kMostLength)); }

float luminance_stop(const Rgb& a, const Rgb& b, float error) {
  return luminance_weight(luminance(a), luminance(b), error);
}

/// Sums over the taps of a run of pixels.
struct LayeredFilter::Sums {
  float red[kRun + kLanes], green[kRun + kLanes], blue[kRun + kLanes], weight[kRun + kLanes];
};

void LayeredFilter::begin(uint32_t width, uint32_t height) {
  width_ = width, height_ = height;
  const size_t pixels = size_t(width) * height + kLanes;  // eight are read at once, the last ones, too
  for (auto* plane : {&x_, &y_, &z_, &nx_, &ny_, &nz_, &footprint_, &segment_, &spread_, &red_, &green_, &blue_,
                      &luminance_, &next_[0], &next_[1], &next_[2], &next_known_})
    if (plane->size() < pixels) plane->resize(pixels);  // what no surface has set is never used but times 0
  known_.assign(pixels, 0.0f);
  todo_.assign(pixels, 0);
}

void LayeredFilter::set(size_t pixel, const LayerPixel& p) {
  x_[pixel] = p.position.x, y_[pixel] = p.position.y, z_[pixel] = p.position.z;
  nx_[pixel] = p.normal.x, ny_[pixel] = p.normal.y, nz_[pixel] = p.normal.z;
  footprint_[pixel] = p.footprint, segment_[pixel] = std::min(p.segment, kMostLength),
  spread_[pixel] = believed(p.error);
  red_[pixel] = p.light.x, green_[pixel] = p.light.y, blue_[pixel] = p.light.z;
  luminance_[pixel] = luminance(p.light);
  known_[pixel] = p.hole ? 0.0f : 1.0f;
  todo_[pixel] = p.hole || p.error > kExact;
}

/// Adds what `count` pixels from p on get from those from q on.
void LayeredFilter::tap(size_t p, size_t q, size_t count, float kernel, float reach, float step, Sums& sums) const {
  const float sharpness = 1.0f / step;
  for (size_t i = 0; i < count; i += kLanes) {
    const size_t a = p + i, b = q + i;
    const Floats here = kIndices < float(count - i) ? load(&known_[b]) : Floats{};
    const Floats nax = load(&nx_[a]), nay = load(&ny_[a]), naz = load(&nz_[a]);
    const Floats nbx = load(&nx_[b]), nby = load(&ny_[b]), nbz = load(&nz_[b]);
    const Floats x = load(&x_[b]) - load(&x_[a]), y = load(&y_[b]) - load(&y_[a]), z = load(&z_[b]) - load(&z_[a]);
    const Floats off_a = x * nax + y * nay + z * naz, off_b = x * nbx + y * nby + z * nbz;
    const Floats stop = normal_weight(nax * nbx + nay * nby + naz * nbz) *
                        plane_weight(most(most(off_a, -off_a), most(off_b, -off_b)), load(&footprint_[a]),
                                     load(&footprint_[b]), reach) *
                        segment_weight(load(&segment_[a]), load(&segment_[b]));
    const Floats light = luminance_weight(load(&luminance_[a]), load(&luminance_[b]),
                                          most(load(&spread_[a]), load(&spread_[b])) * sharpness);
    const Floats w = here * (kernel * stop) * (load(&known_[a]) != 0.0f ? light : Floats{} + 1.0f);
    const auto add = [&](float* to, Floats value) {
      const Floats sum = load(to + i) + value;
      std::memcpy(to + i, &sum, sizeof sum);
    };
    add(sums.weight, w);
    add(sums.red, w * load(&red_[b])), add(sums.green, w * load(&green_[b])), add(sums.blue, w * load(&blue_[b]));
  }
}

void LayeredFilter::row(int y, int step) {
  const int width = int(width_), height = int(height_);
  for (int begin = 0; begin < width; begin += kRun) {
    const int end = std::min(width, begin + kRun);
    const size_t first = size_t(y) * width_ + size_t(begin);
    if (!std::memchr(todo_.data() + first, 1, size_t(end - begin))) continue;
    Sums sums = {};
    for (int i = 0; i < end - begin; ++i) {
      const size_t p = first + size_t(i);
      const float w = known_[p] * kKernel[0] * kKernel[0];
      sums.weight[i] = w;
      sums.red[i] = w * red_[p], sums.green[i] = w * green_[p], sums.blue[i] = w * blue_[p];
    }
    for (int dy = -2; dy <= 2; ++dy) {
      const int j = y + dy * step;
      if (j < 0 || j >= height) continue;
      for (int dx = -2; dx <= 2; ++dx) {
        if (!dx && !dy) continue;
        const int from = std::max(begin, -dx * step), to = std::min(end, width - dx * step);
        if (from >= to) continue;
        const bool whole = from == begin;
        Sums part;  // begins at `from`
        if (!whole) part = Sums{};
        Sums& into = whole ? sums : part;
        tap(size_t(y) * width_ + size_t(from), size_t(j) * width_ + size_t(from + dx * step), size_t(to - from),
            kKernel[std::abs(dx)] * kKernel[std::abs(dy)], float(step * std::max(std::abs(dx), std::abs(dy))),
            float(step), into);
        if (whole) continue;
        for (int i = 0; i < to - from; ++i) {
          sums.weight[i + from - begin] += part.weight[i], sums.red[i + from - begin] += part.red[i];
          sums.green[i + from - begin] += part.green[i], sums.blue[i + from - begin] += part.blue[i];
        }
      }
    }
    for (int i = 0; i < end - begin; ++i) {
      const size_t p = first + size_t(i);
      if (!todo_[p] || !(sums.weight[i] > 0.0f)) continue;
      const float scale = 1.0f / sums.weight[i];
      next_[0][p] = sums.red[i] * scale, next_[1][p] = sums.green[i] * scale, next_[2][p] = sums.blue[i] * scale;
      next_known_[p] = 1.0f;
    }
  }
}

void LayeredFilter::run(unsigned threads, StopToken stop) {
  const auto rows = [&](const auto& what) {
    parallel_blocks(
        height_, 8, threads,
        [&](size_t begin, size_t end) {
          for (size_t y = begin; y < end; ++y)
            if (std::memchr(todo_.data() + y * width_, 1, width_)) what(int(y));
        },
        stop);
  };
  for (int pass = 0; pass < kPasses && !stop.stop(); ++pass) {
    rows([&](int y) {
      std::fill_n(next_known_.begin() + ptrdiff_t(size_t(y) * width_), width_, 0.0f);
      row(y, 1 << pass);
    });
    if (stop.stop()) return;
    rows([&](int y) {
      for (size_t p = size_t(y) * width_, end = p + width_; p < end; ++p)
        if (todo_[p] && next_known_[p] != 0.0f) {
          red_[p] = next_[0][p], green_[p] = next_[1][p], blue_[p] = next_[2][p];
          luminance_[p] = luminance(light(p));
          known_[p] = 1.0f;
        }
    });
  }
}

}  // namespace afterglow
