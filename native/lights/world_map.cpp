// SPDX-License-Identifier: GPL-3.0-or-later
// Builds and samples the world's table. Each texel is probed at several points, so that a small sun is seen at low
// resolution, too; a floor keeps directions possible that all probes missed.
#include "lights/world_map.h"

#include <algorithm>

#include "base/parallel.h"
#include "base/sampler.h"

namespace afterglow {

namespace {

constexpr uint32_t kProbes = 4, kMinWidth = 64, kMaxWidth = 4096;

Vec3 direction_at(float x, float y) {  // x: share of the turn, y: share of the way from −z to +z, by angle
  const float theta = kPi * (y - 0.5f), phi = 2.0f * kPi * x;
  const float r = std::cos(theta);
  return {r * std::cos(phi), r * std::sin(phi), std::sin(theta)};
}

std::vector<float> probe(const WorldMap::Radiance& radiance, uint32_t width, uint32_t height) {
  std::vector<float> texels(size_t(width) * height);
  parallel_blocks(texels.size(), 256, [&](size_t begin, size_t end) {
    for (size_t texel = begin; texel < end; ++texel) {
      const uint32_t x = uint32_t(texel % width), y = uint32_t(texel / width);
      float sum = 0.0f;
      for (uint32_t k = 0; k < kProbes; ++k) {
        const uint32_t h = hash(x, y, k);
        const float dx = (float(k & 1) + float(h & 0xffff) / 65536.0f) * 0.5f;
        const float dy = (float(k >> 1) + float(h >> 16) / 65536.0f) * 0.5f;
        const float light = luminance(radiance(direction_at((x + dx) / width, (y + dy) / height)));
        sum += std::isfinite(light) ? std::max(light, 0.0f) : 0.0f;
      }
      texels[texel] = sum / kProbes;
    }
  });
  return texels;
}

float row_area(uint32_t y, uint32_t height) {  // of a texel row on the unit sphere, over 4π
  return 0.5f * (std::sin(kPi * (float(y + 1) / height - 0.5f)) - std::sin(kPi * (float(y) / height - 0.5f)));
}

/// How much of the light stands elsewhere in `fine` than `coarse` (half as wide) says: 0 to 1.
float misplaced(const std::vector<float>& fine, const std::vector<float>& coarse, uint32_t width, uint32_t height) {
  double moved = 0.0, sum = 0.0, coarse_sum = 0.0;
  for (uint32_t y = 0; y < height; ++y)
    for (uint32_t x = 0; x < width; ++x) {
      const double area = row_area(y, height);
      sum += area * fine[size_t(y) * width + x];
      coarse_sum += area * coarse[size_t(y / 2) * (width / 2) + x / 2];
    }
  if (!(sum > 0.0) || !(coarse_sum > 0.0)) return sum == coarse_sum ? 0.0f : 1.0f;
  for (uint32_t y = 0; y < height; ++y)
    for (uint32_t x = 0; x < width; ++x)
      moved += row_area(y, height) *
               std::fabs(fine[size_t(y) * width + x] / sum - coarse[size_t(y / 2) * (width / 2) + x / 2] / coarse_sum);
  return float(0.5 * moved);
}

uint32_t find(const float* cumulative, uint32_t count, float u) {  // the interval that holds u
  const float* end = cumulative + count + 1;
  const float* it = std::upper_bound(cumulative, end, u);
  return uint32_t(std::clamp<ptrdiff_t>(it - cumulative - 1, 0, ptrdiff_t(count) - 1));
}

}  // namespace

void WorldMap::clear() { *this = WorldMap{}; }

void WorldMap::build(const Radiance& radiance, uint32_t resolution) {
  clear();
  uint32_t width = resolution ? std::clamp<uint32_t>(resolution / 2 * 2, 4, 16384) : kMinWidth;
  std::vector<float> texels = probe(radiance, width, width / 2);
  while (!resolution && width < kMaxWidth) {
    std::vector<float> finer = probe(radiance, 2 * width, width);
    const float moved = misplaced(finer, texels, 2 * width, width);
    width *= 2;
    texels = std::move(finer);
    if (moved < 0.04f) break;
  }
  const uint32_t height = width / 2;
  double total = 0.0;
  for (uint32_t y = 0; y < height; ++y)
    for (uint32_t x = 0; x < width; ++x) total += double(row_area(y, height)) / width * texels[size_t(y) * width + x];
  if (!(total > 0.0)) return;
  mean_ = float(total);
  width_ = width, height_ = height;
  row_.resize(height + 1);
  column_.resize(size_t(height) * (width + 1));
  const float floor = 0.01f * mean_;
  std::vector<double> rows(height + 1, 0.0);
  for (uint32_t y = 0; y < height; ++y) {
    std::vector<double> cumulative(width + 1, 0.0);
    for (uint32_t x = 0; x < width; ++x)
      cumulative[x + 1] = cumulative[x] + std::max(texels[size_t(y) * width + x], floor);
    for (uint32_t x = 0; x <= width; ++x)
      column_[size_t(y) * (width + 1) + x] = float(cumulative[x] / cumulative[width]);
    rows[y + 1] = rows[y] + cumulative[width] * row_area(y, height);
  }
  for (uint32_t y = 0; y <= height; ++y) row_[y] = float(rows[y] / rows[height]);
}

Vec3 WorldMap::sample(const Vec2& u, float& density) const {
  const uint32_t y = find(row_.data(), height_, u.y);
  const float row_share = row_[y + 1] - row_[y];
  const float* column = &column_[size_t(y) * (width_ + 1)];
  const uint32_t x = find(column, width_, u.x);
  const float column_share = column[x + 1] - column[x];
  const float dx = column_share > 0.0f ? (u.x - column[x]) / column_share : 0.5f;
  const float dy = row_share > 0.0f ? (u.y - row_[y]) / row_share : 0.5f;
  // Uniform in solid angle within the texel: in the sine of the latitude.
  const float low = std::sin(kPi * (float(y) / height_ - 0.5f)), high = std::sin(kPi * (float(y + 1) / height_ - 0.5f));
  const float z = std::clamp(low + dy * (high - low), -1.0f, 1.0f), phi = 2.0f * kPi * (x + dx) / width_;
  const float r = std::sqrt(std::max(1.0f - z * z, 0.0f));
  density = row_share * column_share * width_ / (2.0f * kPi * (high - low));
  return {r * std::cos(phi), r * std::sin(phi), z};
}

float WorldMap::density(const Vec3& direction) const {
  const float latitude = std::asin(std::clamp(direction.z, -1.0f, 1.0f)) * kInvPi + 0.5f;
  float longitude = std::atan2(direction.y, direction.x) * (0.5f * kInvPi);
  if (longitude < 0.0f) longitude += 1.0f;
  const uint32_t y = std::min(uint32_t(latitude * height_), height_ - 1);
  const uint32_t x = std::min(uint32_t(longitude * width_), width_ - 1);
  const float* column = &column_[size_t(y) * (width_ + 1)];
  const float low = std::sin(kPi * (float(y) / height_ - 0.5f)), high = std::sin(kPi * (float(y + 1) / height_ - 0.5f));
  return (row_[y + 1] - row_[y]) * (column[x + 1] - column[x]) * width_ / (2.0f * kPi * (high - low));
}

}  // namespace afterglow
