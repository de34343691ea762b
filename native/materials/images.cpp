// SPDX-License-Identifier: GPL-3.0-or-later
// Filtered lookups in images and the table of images that programs number. The cubic filter is the uniform B-spline.
#include "materials/images.h"

#include <algorithm>
#include <array>
#include <cstring>
#if defined(__F16C__)
#include <immintrin.h>
#endif

#include "base/parallel.h"
#include "scene/scene.h"

namespace afterglow {
namespace {

float half_to_float(uint16_t h) {
#if defined(__F16C__)
  return _cvtsh_ss(h);
#else
  const uint32_t sign = uint32_t(h & 0x8000u) << 16, exponent = (h >> 10) & 31u, mantissa = h & 1023u;
  float v = exponent == 0    ? std::ldexp(float(mantissa), -24)
            : exponent == 31 ? (mantissa ? 0.0f : kInfinity)
                             : std::ldexp(float(mantissa + 1024u), int(exponent) - 25);
  return sign ? -v : v;
#endif
}

Vec4 texel(const Texture& t, int x, int y) {
  const size_t at = (size_t(y) * size_t(t.width) + size_t(x)) * t.channels;
  switch (t.kind) {
    case Texture::Kind::kByte: {
      const uint8_t* p = t.data.data() + at;
      constexpr float k = 1.0f / 255.0f;
      if (t.channels == 1) return Vec4(float(p[0]) * k, float(p[0]) * k, float(p[0]) * k, 1.0f);
      return Vec4(p[0], p[1], p[2], p[3]) * k;
    }
    case Texture::Kind::kHalf: {
      uint16_t h[4];
      std::memcpy(h, t.data.data() + at * 2, size_t(t.channels) * 2);
      if (t.channels == 1) return Vec4(Vec3(half_to_float(h[0])), 1.0f);
      return {half_to_float(h[0]), half_to_float(h[1]), half_to_float(h[2]), half_to_float(h[3])};
    }
    default: {
      float f[4];
      std::memcpy(f, t.data.data() + at * 4, size_t(t.channels) * 4);
      if (t.channels == 1) return Vec4(f[0], f[0], f[0], 1.0f);
      return {f[0], f[1], f[2], f[3]};
    }
  }
}

/// The texel index that stands for k; −1: outside of a clipped image.
int wrap(int k, int size, Extension extension) {
  if (unsigned(k) < unsigned(size)) return k;
  switch (extension) {
    case Extension::kRepeat: {
      const int r = k % size;
      return r < 0 ? r + size : r;
    }
    case Extension::kExtend:
      return std::clamp(k, 0, size - 1);
    case Extension::kMirror: {
      int r = k % (2 * size);
      if (r < 0) r += 2 * size;
      return r < size ? r : 2 * size - 1 - r;
    }
    default:
      return -1;
  }
}

Vec4 texel_or_nothing(const Texture& t, int x, int y) { return x < 0 || y < 0 ? Vec4(0.0f) : texel(t, x, y); }

const std::array<float, 4097>& srgb_table() {
  static const std::array<float, 4097> table = [] {
    std::array<float, 4097> all;
    for (size_t k = 0; k < all.size(); ++k) {
      const double c = double(k) / 4096.0;
      all[k] = float(c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4));
    }
    return all;
  }();
  return table;
}

constexpr float kFarthest = 1e6f;  // turns; beyond, floats hold no place within a picture

}  // namespace

float srgb_to_linear(float c) {
  if (!(c > 0.0f)) return c / 12.92f;
  if (c > 1.0f) return std::pow((c + 0.055f) / 1.055f, 2.4f);
  static const std::array<float, 4097>& table = srgb_table();
  const float f = c * 4096.0f;
  const int k = std::min(int(f), 4095);
  return table[size_t(k)] + (table[size_t(k) + 1] - table[size_t(k)]) * (f - float(k));
}

Vec4 look_up(const Texture& t, float u, float v, Interpolation interpolation, Extension extension) {
  if (!(std::fabs(u) < kFarthest && std::fabs(v) < kFarthest)) return Vec4(0.0f);
  if (extension == Extension::kRepeat) u -= std::floor(u), v -= std::floor(v);
  const float x = u * float(t.width), y = v * float(t.height);
  if (interpolation == Interpolation::kClosest) {
    return texel_or_nothing(t, wrap(int(std::floor(x)), t.width, extension),
                            wrap(int(std::floor(y)), t.height, extension));
  }
  const float fx = std::floor(x - 0.5f), fy = std::floor(y - 0.5f), tx = x - 0.5f - fx, ty = y - 0.5f - fy;
  const int ix = int(fx), iy = int(fy);
  if (interpolation == Interpolation::kLinear) {
    if (ix >= 0 && iy >= 0 && ix + 1 < t.width && iy + 1 < t.height) {
      const Vec4 low = texel(t, ix, iy) * (1.0f - tx) + texel(t, ix + 1, iy) * tx;
      const Vec4 high = texel(t, ix, iy + 1) * (1.0f - tx) + texel(t, ix + 1, iy + 1) * tx;
      return low * (1.0f - ty) + high * ty;
    }
    const int x0 = wrap(ix, t.width, extension), x1 = wrap(ix + 1, t.width, extension);
    const int y0 = wrap(iy, t.height, extension), y1 = wrap(iy + 1, t.height, extension);
    const Vec4 low = texel_or_nothing(t, x0, y0) * (1.0f - tx) + texel_or_nothing(t, x1, y0) * tx;
    const Vec4 high = texel_or_nothing(t, x0, y1) * (1.0f - tx) + texel_or_nothing(t, x1, y1) * tx;
    return low * (1.0f - ty) + high * ty;
  }
  const auto weights = [](float s, float w[4]) {
    const float r = 1.0f - s;
    w[0] = r * r * r / 6.0f;
    w[1] = (3.0f * s * s * s - 6.0f * s * s + 4.0f) / 6.0f;
    w[2] = (3.0f * r * r * r - 6.0f * r * r + 4.0f) / 6.0f;
    w[3] = s * s * s / 6.0f;
  };
  float wx[4], wy[4];
  weights(tx, wx), weights(ty, wy);
  Vec4 sum(0.0f);
  for (int b = 0; b < 4; ++b) {
    const int row = wrap(iy - 1 + b, t.height, extension);
    for (int a = 0; a < 4; ++a) sum += texel_or_nothing(t, wrap(ix - 1 + a, t.width, extension), row) * (wx[a] * wy[b]);
  }
  return sum;
}

uint32_t Images::number(Handle handle) {
  if (!handle) return kNone;
  for (size_t k = 0; k < entries_.size(); ++k) {
    if (entries_[k].handle == handle) return uint32_t(k);
  }
  entries_.emplace_back().handle = handle;
  return uint32_t(entries_.size() - 1);
}

void Images::load(const Scene& scene, std::vector<std::string>& warnings) {
  const std::vector<Handle> alive = scene.image_handles();
  struct Job {
    const Image* image;
    const ImageSource* source;
    Texture* texture;
    std::string error;
  };
  std::vector<Job> jobs;
  for (Entry& entry : entries_) {
    if (std::find(alive.begin(), alive.end(), entry.handle) == alive.end()) {
      entry = Entry{entry.handle, {}, {}, {}, {}, nullptr, true};  // gone: magenta
      continue;
    }
    const Image& image = scene.image(entry.handle);
    if (!entry.tiles.empty() && entry.sources == image.tiles && entry.colorspace == image.colorspace &&
        entry.alpha == image.alpha) {
      continue;
    }
    entry.sources = image.tiles, entry.colorspace = image.colorspace, entry.alpha = image.alpha;
    entry.tiles.clear();
    for (const auto& [tile, source] : image.tiles) {
      if (source) jobs.push_back({&image, source.get(), &entry.tiles[tile], {}});
    }
  }
  parallel_blocks(jobs.size(), 1, [&](size_t begin, size_t end) {
    for (size_t k = begin; k < end; ++k)
      *jobs[k].texture = read_texture(*jobs[k].image, *jobs[k].source, jobs[k].error);
  });
  for (const Job& job : jobs) {
    if (!job.error.empty()) warnings.push_back("image \"" + job.image->name + "\": " + job.error);
  }
  for (Entry& entry : entries_) {
    entry.single =
        entry.tiles.size() == 1 && entry.tiles.begin()->first == 1001 ? &entry.tiles.begin()->second : nullptr;
    entry.missing = entry.tiles.empty();
  }
}

Vec4 Images::sample(uint32_t number, Vec2 uv, Interpolation interpolation, Extension extension,
                    bool unassociate) const {
  static const Vec4 magenta(1.0f, 0.0f, 1.0f, 1.0f);
  if (number >= entries_.size() || entries_[number].missing) return magenta;
  const Entry& entry = entries_[number];
  const Texture* texture = entry.single;
  if (!texture) {  // UDIM: a tile for each whole step of u (ten in a row) and v
    if (!(uv.x >= 0.0f && uv.x < 10.0f && uv.y >= 0.0f && uv.y < 100.0f)) return Vec4(0.0f);
    const int column = int(uv.x), row = int(uv.y);
    const auto tile = entry.tiles.find(1001 + column + 10 * row);
    if (tile == entry.tiles.end()) return magenta;
    texture = &tile->second;
    uv -= Vec2(float(column), float(row));
    extension = Extension::kExtend;
  }
  if (!texture->valid()) return magenta;
  Vec4 value = look_up(*texture, uv.x, uv.y, interpolation, extension);
  if (unassociate && value.w != 1.0f && value.w != 0.0f) value = Vec4(Vec3(value) / value.w, value.w);
  if (texture->srgb) value = {srgb_to_linear(value.x), srgb_to_linear(value.y), srgb_to_linear(value.z), value.w};
  return value;
}

size_t Images::bytes() const {
  size_t total = 0;
  for (const Entry& entry : entries_) {
    for (const auto& [tile, texture] : entry.tiles) total += texture.data.capacity();
  }
  return total;
}

}  // namespace afterglow
