// SPDX-License-Identifier: GPL-3.0-or-later
// Texture instructions that need nothing but a place: noise, cells, waves, gradients, bricks, magic and white noise,
// each with its operands taken from the program.
#include "materials/patterns.h"

#include <algorithm>

#include "materials/microfacet.h"
#include "materials/noise.h"
#include "materials/sky.h"
#include "materials/voronoi.h"

namespace afterglow {
namespace {

/// The place in the dimensions that a node uses: w alone, x y, x y z, or all four.
int place(uint32_t dimensions, const Vec3& v, float w, float* out) {
  if (dimensions == 1) {
    out[0] = w;
    return 1;
  }
  out[0] = v.x, out[1] = v.y, out[2] = v.z, out[3] = w;
  return int(std::clamp(dimensions, 2u, 4u));
}

/// Far places that look at unrelated parts of the noise, one for each seed.
void far_place(const float* p, int count, int seed, float* out) {
  for (int k = 0; k < count; ++k) {
    const float key[2] = {float(seed), float(k)};
    out[k] = p[k] + 100.0f + 100.0f * (count == 1 ? hash_floats(key, 1) : hash_floats(key, 2));
  }
}

Vec3 noise(const Vec3& v, float w, float scale, const Operands& in, bool color, Vec3* fac) {
  // detail, roughness, lacunarity, offset, gain, distortion; dimensions, kind, normalize
  float p[4], far[4];
  const int count = place(in.u(6), v * scale, w * scale, p);
  NoiseShape shape;
  shape.kind = NoiseKind(in.u(7));
  shape.normalize = in.u(8) != 0;
  shape.detail = std::clamp(in.f(0), 0.0f, 15.0f);
  shape.roughness = std::max(in.f(1), 0.0f), shape.lacunarity = in.f(2), shape.offset = in.f(3), shape.gain = in.f(4);
  if (const float distortion = in.f(5); distortion != 0.0f) {
    float moved[4];
    for (int k = 0; k < count; ++k) {
      far_place(p, count, k, far);
      moved[k] = p[k] + gradient_noise(far, count) * distortion;
    }
    std::copy(moved, moved + count, p);
  }
  const float value = fractal_noise(p, count, shape);
  *fac = Vec3(value);
  if (!color) return *fac;
  far_place(p, count, count, far);
  const float second = fractal_noise(far, count, shape);
  far_place(p, count, count + 1, far);
  return {value, second, fractal_noise(far, count, shape)};
}

Vec3 cells(const Vec3& v, float w, float scale, const Operands& in, Vec3* second) {
  // detail, roughness, lacunarity, smoothness, exponent, randomness; dimensions, feature, metric, normalize, what
  VoronoiShape s;
  s.detail = std::clamp(in.f(0), 0.0f, 15.0f), s.roughness = saturate(in.f(1)), s.lacunarity = in.f(2);
  s.smoothness = std::clamp(0.5f * in.f(3), 0.0f, 0.5f), s.exponent = in.f(4), s.randomness = saturate(in.f(5));
  s.feature = VoronoiFeature(in.u(7)), s.metric = VoronoiMetric(in.u(8)), s.normalize = in.u(9) != 0, s.scale = scale;
  float p[4];
  const int count = place(in.u(6), v * scale, w * scale, p);
  const VoronoiValue value = voronoi(p, count, s);
  if (in.u(10) == 0) {  // colour and distance
    *second = Vec3(value.distance);
    return value.color;
  }
  *second = Vec3(value.position.w);
  return Vec3(value.position);
}

float wave(Vec3 p, float distortion, const Operands& in) {
  // detail, detail scale, detail roughness, phase; rings, direction, profile
  p = (p + 0.000001f) * 0.999999f;
  const uint32_t direction = in.u(5);
  float n;
  if (!in.u(4)) {
    n = direction < 3 ? p[int(direction)] * 20.0f : (p.x + p.y + p.z) * 10.0f;
  } else {
    Vec3 ring = p;
    if (direction < 3) ring[int(direction)] = 0.0f;
    n = glm::length(ring) * 20.0f;
  }
  n += in.f(3);
  if (distortion != 0.0f) {
    NoiseShape shape;
    shape.detail = std::clamp(in.f(0), 0.0f, 15.0f), shape.roughness = saturate(in.f(2));
    const Vec3 q = p * in.f(1);
    n += distortion * (fractal_noise(&q.x, 3, shape) * 2.0f - 1.0f);
  }
  if (in.u(6) == 0) return 0.5f + 0.5f * std::sin(n - 0.5f * kPi);
  n *= 0.5f * kInvPi;
  return in.u(6) == 1 ? n - std::floor(n) : std::fabs(n - std::floor(n + 0.5f)) * 2.0f;
}

float gradient(const Vec3& p, uint32_t kind) {
  switch (kind) {
    case 0:
      return p.x;
    case 1:
      return sqr(std::max(p.x, 0.0f));
    case 2: {
      const float t = saturate(p.x);
      return t * t * (3.0f - 2.0f * t);
    }
    case 3:
      return 0.5f * (p.x + p.y);
    case 4:
      return std::atan2(p.y, p.x) * (0.5f * kInvPi) + 0.5f;
    default: {
      const float r = std::max(0.999999f - glm::length(p), 0.0f);
      return kind == 5 ? r * r : r;
    }
  }
}

/// Sines fed into one another, `depth` times over.
Vec3 magic(const Vec3& place, float scale, float distortion, uint32_t depth) {
  const float turn = 2.0f * kPi;
  const Vec3 p(std::fmod(place.x, turn), std::fmod(place.y, turn), std::fmod(place.z, turn));
  float x = std::sin((p.x + p.y + p.z) * 5.0f * scale), y = std::cos((-p.x + p.y - p.z) * 5.0f * scale),
        z = -std::cos((-p.x - p.y + p.z) * 5.0f * scale);
  if (depth > 0) {
    x *= distortion, y *= distortion, z *= distortion;
    y = -std::cos(x - y + z) * distortion;
  }
  if (depth > 1) x = std::cos(x - y - z) * distortion;
  if (depth > 2) z = std::sin(-x - y - z) * distortion;
  if (depth > 3) x = -std::cos(-x + y - z) * distortion;
  if (depth > 4) y = -std::sin(-x + y + z) * distortion;
  if (depth > 5) y = -std::cos(-x + y + z) * distortion;
  if (depth > 6) x = std::cos(x + y + z) * distortion;
  if (depth > 7) z = std::sin(x + y - z) * distortion;
  if (depth > 8) x = -std::cos(-x - y + z) * distortion;
  if (depth > 9) y = -std::sin(x - y + z) * distortion;
  if (distortion != 0.0f) x /= 2.0f * distortion, y /= 2.0f * distortion, z /= 2.0f * distortion;
  return {0.5f - x, 0.5f - y, 0.5f - z};
}

float brick_tint(uint32_t n) {  // an integer hash of the brick's number
  n = (n + 1013u) & 0x7fffffffu;
  n = (n >> 13) ^ n;
  return 0.5f * float((n * (n * n * 60493u + 19990303u) + 1376312589u) & 0x7fffffffu) / 1073741824.0f;
}

Vec3 bricks(const Vec3& p, const Rgb& color1, const Rgb& color2, const Operands& in, Vec3* fac) {
  // mortar colour, mortar size, smooth, bias, width, height; offset, frequency, squash, frequency
  const float size = in.f(1), smooth = in.f(2), height = in.f(5);
  float width = in.f(4), shift = 0.0f;
  const auto whole = [](float v) { return std::isfinite(v) ? int32_t(std::floor(std::clamp(v, -2.0e9f, 2.0e9f))) : 0; };
  const int32_t row = whole(height != 0.0f ? p.y / height : 0.0f), every = in.i(7), squash_every = in.i(9);
  if (every && squash_every) {
    if (row % squash_every == 0) width *= in.p(8);
    if (row % every == 0) shift = width * in.p(6);
  }
  const int32_t column = whole(width != 0.0f ? (p.x + shift) / width : 0.0f);
  const float x = p.x + shift - width * float(column), y = p.y - height * float(row);
  const float tint = saturate(brick_tint((uint32_t(row) << 16) + (uint32_t(column) & 0xffffu)) + in.f(3));
  const float border = std::min(std::min(x, y), std::min(width - x, height - y));
  float mortar = 0.0f;
  if (border < size) {
    mortar = 1.0f;
    if (smooth != 0.0f) {
      const float t = saturate((1.0f - border / size) / smooth);
      mortar = t * t * (3.0f - 2.0f * t);
    }
  }
  *fac = Vec3(mortar);
  return lerp(lerp(color1, color2, tint), in.v(0), mortar);
}

}  // namespace

Vec3 run_pattern(const Instruction& ins, const Vec3& a, const Vec3& b, const Vec3& c, const Operands& in,
                 Vec3* second) {
  switch (ins.op) {
    case Op::kNoise:
      return noise(a, b.x, c.x, in, ins.out != kNoOperand, second);
    case Op::kVoronoi:
      return cells(a, b.x, c.x, in, second);
    case Op::kWave:
      return *second = Vec3(wave(a * b.x, c.x, in));
    case Op::kGradient:
      return *second = Vec3(saturate(gradient(a, in.u(0))));
    case Op::kMagic: {
      const Vec3 color = magic(a, b.x, c.x, in.u(0));
      *second = Vec3(mean(color));
      return color;
    }
    case Op::kBrick:
      return bricks(a, b, c, in, second);
    case Op::kWhiteNoise: {
      float p[4];
      const int count = place(in.u(0), a, b.x, p);
      *second = Vec3(hash_floats(p, count));
      return ins.out == kNoOperand ? *second : hash_color(p, count);
    }
    case Op::kSky:
      return run_sky(a, in);
    default:
      return *second = Vec3(0.5f);
  }
}

}  // namespace afterglow
