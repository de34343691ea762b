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
constexpr float kTiny = 1e-35f;       // keeps 0 / 0 from being asked
constexpr int kRun = 64;              // pixels of a row at a time

/// How far luminances may differ. Faster than the error itself, so that the filter is gone when it would blur more than
/// it smooths.
inline float believed(float error) { return kErrorScale * error * std::sqrt(error); }

/// By value: a compiler that sees references makes no vector instructions of a loop.
inline float most(float a, float b) { return a > b ? a : b; }
inline float normal_weight(float cosine) {
  const float c = most(0.0f, cosine), c2 = c * c, c4 = c2 * c2;
  return c4 * c4;
}
inline float plane_weight(float off, float footprint_a, float footprint_b, float reach) {
  return most(0.0f, 1.0f - off / (0.5f * reach * most(footprint_a, footprint_b) + kTiny));
}
inline float segment_weight(float a, float b) {
  return most(0.0f, 1.0f - kSegment * std::fabs(a - b) / (most(a, b) + kTiny));
}
/// 1 - log(1 + y) with y = kLuminance r / (1 + r) by the second Padé approximant, half a hundredth off at most.
inline float luminance_weight(float a, float b, float error) {
  const float difference = std::fabs(a - b);
  const float y = kLuminance * difference / (difference + 0.5f * (a + b) * error + kTiny);
  return most(0.0f, 1.0f - y * (6.0f + 3.0f * y) / (6.0f + y * (6.0f + y)));
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
  float red[kRun], green[kRun], blue[kRun], weight[kRun];
};

void LayeredFilter::begin(uint32_t width, uint32_t height) {
  width_ = width, height_ = height;
  const size_t pixels = size_t(width) * height;
  for (auto* plane : {&x_, &y_, &z_, &nx_, &ny_, &nz_, &footprint_, &segment_, &error_, &red_, &green_, &blue_, &luminance_,
                      &next_[0], &next_[1], &next_[2], &next_known_})
    if (plane->size() < pixels) plane->resize(pixels);  // what no surface has set is never used but times 0
  known_.assign(pixels, 0.0f);
  todo_.assign(pixels, 0);
}

void LayeredFilter::set(size_t pixel, const LayerPixel& p) {
  x_[pixel] = p.position.x, y_[pixel] = p.position.y, z_[pixel] = p.position.z;
  nx_[pixel] = p.normal.x, ny_[pixel] = p.normal.y, nz_[pixel] = p.normal.z;
  footprint_[pixel] = p.footprint, segment_[pixel] = std::min(p.segment, kMostLength), error_[pixel] = p.error;
  red_[pixel] = p.light.x, green_[pixel] = p.light.y, blue_[pixel] = p.light.z;
  luminance_[pixel] = luminance(p.light);
  known_[pixel] = p.hole ? 0.0f : 1.0f;
  todo_[pixel] = p.hole || p.error > kExact;
}

/// Adds what `count` pixels from p on get from those from q on. One loop without branches, which compilers turn into
/// vector instructions.
void LayeredFilter::tap(size_t p, size_t q, size_t count, float kernel, float reach, float step, Sums& sums) const {
  const float *x = x_.data(), *y = y_.data(), *z = z_.data(), *nx = nx_.data(), *ny = ny_.data(), *nz = nz_.data();
  const float *footprint = footprint_.data(), *segment = segment_.data(), *error = error_.data();
  const float *lum = luminance_.data(), *known = known_.data();
  const float *red = red_.data(), *green = green_.data(), *blue = blue_.data();
  const float sharpness = 1.0f / step;
  float *__restrict weights = sums.weight, *__restrict reds = sums.red, *__restrict greens = sums.green,
                    *__restrict blues = sums.blue;
  for (size_t i = 0; i < count; ++i) {
    const size_t a = p + i, b = q + i;
    const float wx = x[b] - x[a], wy = y[b] - y[a], wz = z[b] - z[a];
    const float off_a = std::fabs(wx * nx[a] + wy * ny[a] + wz * nz[a]);
    const float off_b = std::fabs(wx * nx[b] + wy * ny[b] + wz * nz[b]);
    const float cosine = nx[a] * nx[b] + ny[a] * ny[b] + nz[a] * nz[b];
    const float stop = normal_weight(cosine) * plane_weight(most(off_a, off_b), footprint[a], footprint[b], reach) *
                       segment_weight(segment[a], segment[b]);
    const float light = luminance_weight(lum[a], lum[b], believed(most(error[a], error[b])) * sharpness);
    const float w = known[b] != 0.0f ? kernel * stop * (known[a] != 0.0f ? light : 1.0f) : 0.0f;
    weights[i] += w;
    reds[i] += w * red[b];
    greens[i] += w * green[b];
    blues[i] += w * blue[b];
  }
}

void LayeredFilter::row(int y, int step) {
  const int width = int(width_), height = int(height_);
  for (int begin = 0; begin < width; begin += kRun) {
    const int end = std::min(width, begin + kRun);
    const size_t first = size_t(y) * width_ + size_t(begin);
    if (!std::memchr(todo_.data() + first, 1, size_t(end - begin))) continue;
    Sums sums;
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
        Sums part;  // begins at `from`
        const bool whole = from == begin;
        Sums& into = whole ? sums : part;
        if (!whole) std::memset(&part, 0, sizeof part);
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
