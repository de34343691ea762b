// SPDX-License-Identifier: GPL-3.0-or-later
// The layered filter: see layered_filter.h. Where it differs from Roth et al. 2020: (3) and (4) go negative and depend
// on the scene's units, so lengths are relative and weights end at 0; (3) takes the distance from the tangent plane,
// because path lengths differ along a floor seen at a grazing angle; (5) is left out, since irradiance knows no albedo;
// (6) measures a difference by the error that is believed, so that the filter fades as the light converges.
#include "film/layered_filter.h"

#include <algorithm>

#include "base/parallel.h"

namespace afterglow {

namespace {

constexpr int kPasses = 3;
constexpr float kKernel[3] = {3.0f / 8.0f, 1.0f / 4.0f, 1.0f / 16.0f};
constexpr float kErrorScale = 16.0f;  // single samples of bounced light spread by a few times their mean
constexpr float kExact = 0.06f;       // relative error below which light is left alone
constexpr float kSegment = 2.0f;      // s_d'
constexpr float kLuminance = 3.0f;    // s_l, as the paper has it

/// How far luminances may differ. Faster than the error itself, so that the filter is gone when it would blur more than
/// it smooths.
float believed(float error) { return kErrorScale * error * std::sqrt(error); }

}  // namespace

float normal_stop(const Vec3& a, const Vec3& b) {
  const float cosine = std::max(0.0f, glm::dot(a, b));
  const float c4 = cosine * cosine * cosine * cosine;
  return c4 * c4;
}

float plane_stop(const LayerPixel& a, const LayerPixel& b, float reach) {
  const Vec3 way = b.position - a.position;
  const float off = std::max(std::fabs(glm::dot(way, a.normal)), std::fabs(glm::dot(way, b.normal)));
  const float allowed = 0.5f * reach * std::max(a.footprint, b.footprint);
  return allowed > 0.0f ? std::max(0.0f, 1.0f - off / allowed) : off == 0.0f ? 1.0f : 0.0f;
}

float segment_stop(float a, float b) {
  const float longer = std::max(a, b);
  return longer > 0.0f && std::isfinite(longer) ? std::max(0.0f, 1.0f - kSegment * std::fabs(a - b) / longer) : 1.0f;
}

float luminance_stop(const Rgb& a, const Rgb& b, float error) {
  const float la = luminance(a), lb = luminance(b), mean = 0.5f * (la + lb);
  if (!(mean > 0.0f)) return 1.0f;
  if (!(error > 0.0f)) return la == lb ? 1.0f : 0.0f;
  const float off = std::fabs(la - lb) / (mean * error);
  return std::max(0.0f, 1.0f - std::log(1.0f + kLuminance * off / (off + 1.0f)));
}

void filter_layer(std::span<const LayerPixel> in, uint32_t width, uint32_t height, std::span<Rgb> out, unsigned threads,
                  StopToken stop) {
  std::vector<Rgb> from(in.size());
  std::vector<uint8_t> known(in.size());
  for (size_t i = 0; i < in.size(); ++i) {
    from[i] = out[i] = in[i].light;
    known[i] = in[i].present && !in[i].hole;
  }
  for (int pass = 0; pass < kPasses && !stop.stop(); ++pass) {
    const int step = 1 << pass;
    std::vector<uint8_t> filled = known;
    parallel_blocks(
        height, 8, threads,
        [&](size_t begin, size_t end) {
          for (int y = int(begin); y < int(end); ++y)
            for (int x = 0; x < int(width); ++x) {
              const size_t p = size_t(y) * width + size_t(x);
              const LayerPixel& center = in[p];
              if (!center.present || (known[p] && !(center.error > kExact))) continue;
              Rgb sum(0.0f);
              float weights = 0.0f;
              for (int dy = -2; dy <= 2; ++dy)
                for (int dx = -2; dx <= 2; ++dx) {
                  const int i = x + dx * step, j = y + dy * step;
                  if (i < 0 || j < 0 || i >= int(width) || j >= int(height)) continue;
                  const size_t q = size_t(j) * width + size_t(i);
                  const LayerPixel& other = in[q];
                  if (!known[q]) continue;
                  float w = kKernel[std::abs(dx)] * kKernel[std::abs(dy)];
                  if (p != q) {
                    w *= normal_stop(center.normal, other.normal) *
                         plane_stop(center, other, float(step * std::max(std::abs(dx), std::abs(dy)))) *
                         segment_stop(center.segment, other.segment);
                    if (known[p] && w > 0.0f)
                      w *=
                          luminance_stop(from[p], from[q], believed(std::max(center.error, other.error)) / float(step));
                  }
                  sum += w * from[q];
                  weights += w;
                }
              if (!(weights > 0.0f)) continue;
              out[p] = sum / weights;
              filled[p] = 1;
            }
        },
        stop);
    std::copy(out.begin(), out.end(), from.begin());
    known = std::move(filled);
  }
}

}  // namespace afterglow
