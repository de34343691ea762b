// SPDX-License-Identifier: GPL-3.0-or-later
// The discontinuity buffer: see discontinuity.h.
#include "film/discontinuity.h"

#include <algorithm>

#include "base/parallel.h"

namespace afterglow {

bool same_surface(const SharedIrradiance& a, const SharedIrradiance& b) {
  if (glm::dot(a.normal, b.normal) < 0.9f) return false;
  const Vec3 way = b.position - a.position;
  const float reach = 3.0f * std::max(a.footprint, b.footprint);
  const float off = std::max(std::fabs(glm::dot(way, a.normal)), std::fabs(glm::dot(way, b.normal)));
  return off <= 0.25f * reach + 0.1f * glm::length(way);
}

void filter_discontinuities(std::span<const SharedIrradiance> in, uint32_t width, uint32_t height, int radius,
                            std::span<Rgb> out, unsigned threads, StopToken stop) {
  parallel_blocks(
      height, 8, threads,
      [&](size_t begin, size_t end) {
        for (size_t y = begin; y < end; ++y)
          for (size_t x = 0; x < width; ++x) {
            const SharedIrradiance& center = in[y * width + x];
            Rgb sum(0.0f);
            float count = 0.0f;
            if (!center.present) {
              out[y * width + x] = sum;
              continue;
            }
            const size_t y0 = y - std::min<size_t>(y, size_t(radius)), x0 = x - std::min<size_t>(x, size_t(radius));
            const size_t y1 = std::min<size_t>(y + size_t(radius), height - 1),
                         x1 = std::min<size_t>(x + size_t(radius), width - 1);
            for (size_t j = y0; j <= y1; ++j)
              for (size_t i = x0; i <= x1; ++i) {
                const SharedIrradiance& other = in[j * width + i];
                if (!other.present || !same_surface(center, other)) continue;
                sum += other.irradiance;
                count += 1.0f;
              }
            out[y * width + x] = count > 0.0f ? sum / count : center.irradiance;
          }
      },
      stop);
}

}  // namespace afterglow
