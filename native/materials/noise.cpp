// SPDX-License-Identifier: GPL-3.0-or-later
// Hashes and gradient noise: see noise.h. Bob Jenkins, lookup3 (2006); Ken Perlin, "Improving Noise" (2002).
#include "materials/noise.h"

#include <algorithm>
#include <bit>

namespace afterglow {
namespace {

struct Lookup3 {
  uint32_t a, b, c;
  explicit Lookup3(uint32_t words) { a = b = c = 0xdeadbeefu + (words << 2) + 13u; }
  void mix() {
    a -= c, a ^= std::rotl(c, 4), c += b;
    b -= a, b ^= std::rotl(a, 6), a += c;
    c -= b, c ^= std::rotl(b, 8), b += a;
    a -= c, a ^= std::rotl(c, 16), c += b;
    b -= a, b ^= std::rotl(a, 19), a += c;
    c -= b, c ^= std::rotl(b, 4), b += a;
  }
  uint32_t finish() {
    c ^= b, c -= std::rotl(b, 14);
    a ^= c, a -= std::rotl(c, 11);
    b ^= a, b -= std::rotl(a, 25);
    c ^= b, c -= std::rotl(b, 16);
    a ^= c, a -= std::rotl(c, 4);
    b ^= a, b -= std::rotl(a, 14);
    c ^= b, c -= std::rotl(b, 24);
    return c;
  }
};

float negated_if(float v, uint32_t bit) { return bit ? -v : v; }

/// A gradient chosen by the hash, times the way from the corner.
template <int N>
float corner(uint32_t hash, const float* d) {
  if constexpr (N == 1) {
    return negated_if(1.0f + float(hash & 7u), hash & 8u) * d[0];
  } else if constexpr (N == 2) {
    const uint32_t h = hash & 7u;
    const float u = h < 4 ? d[0] : d[1], v = 2.0f * (h < 4 ? d[1] : d[0]);
    return negated_if(u, h & 1u) + negated_if(v, h & 2u);
  } else if constexpr (N == 3) {
    const uint32_t h = hash & 15u;
    const float u = h < 8 ? d[0] : d[1], v = h < 4 ? d[1] : (h == 12 || h == 14 ? d[0] : d[2]);
    return negated_if(u, h & 1u) + negated_if(v, h & 2u);
  } else {
    const uint32_t h = hash & 31u;
    const float u = h < 24 ? d[0] : d[1], v = h < 16 ? d[1] : d[2], s = h < 8 ? d[2] : d[3];
    return negated_if(u, h & 1u) + negated_if(v, h & 2u) + negated_if(s, h & 4u);
  }
}

template <int N>
float perlin(const float* p) {
  int32_t cell[N];
  float at[N], fade[N];
  for (int k = 0; k < N; ++k) {
    const float whole = std::floor(p[k]);
    cell[k] = int32_t(std::clamp(whole, -2.0e9f, 2.0e9f));
    at[k] = p[k] - whole;
    fade[k] = at[k] * at[k] * at[k] * (at[k] * (at[k] * 6.0f - 15.0f) + 10.0f);
  }
  float values[1 << N];
  for (int c = 0; c < 1 << N; ++c) {
    uint32_t word[4] = {0, 0, 0, 0};
    float d[4];
    for (int k = 0; k < N; ++k) {
      const int bit = (c >> k) & 1;
      word[k] = uint32_t(cell[k]) + uint32_t(bit);
      d[k] = at[k] - float(bit);
    }
    const uint32_t hash = N == 1   ? jenkins(word[0])
                          : N == 2 ? jenkins(word[0], word[1])
                          : N == 3 ? jenkins(word[0], word[1], word[2])
                                   : jenkins(word[0], word[1], word[2], word[3]);
    values[c] = corner<N>(hash, d);
  }
  for (int k = N - 1; k >= 0; --k) {  // the last dimension first
    for (int c = 0; c < 1 << k; ++c) values[c] += (values[c + (1 << k)] - values[c]) * fade[k];
  }
  constexpr float kScale[4] = {0.2500f, 0.6616f, 0.9820f, 0.8344f};
  const float value = values[0] * kScale[N - 1];
  return std::isfinite(value) ? value : 0.0f;
}

/// The octaves of a fractal: places that grow by the lacunarity.
struct Octaves {
  float p[4];
  int count;
  Octaves(const float* from, int n) : count(n) { std::copy(from, from + n, p); }
  float value() const { return gradient_noise(p, count); }
  void grow(float lacunarity) {
    for (int k = 0; k < count; ++k) p[k] *= lacunarity;
  }
};

float fbm(Octaves o, const NoiseShape& s) {
  float sum = 0.0f, amplitude = 1.0f, most = 0.0f;
  const int whole = int(s.detail);
  for (int k = 0; k <= whole; ++k) {
    sum += o.value() * amplitude;
    most += amplitude;
    amplitude *= s.roughness;
    o.grow(s.lacunarity);
  }
  const float rest = s.detail - std::floor(s.detail);
  const float plain = s.normalize ? 0.5f * sum / most + 0.5f : sum;
  if (rest == 0.0f) return plain;
  const float more = sum + o.value() * amplitude;
  const float fuller = s.normalize ? 0.5f * more / (most + amplitude) + 0.5f : more;
  return plain * (1.0f - rest) + fuller * rest;
}

float multifractal(Octaves o, const NoiseShape& s) {
  float value = 1.0f, power = 1.0f;
  for (int k = 0; k <= int(s.detail); ++k) {
    value *= power * o.value() + 1.0f;
    power *= s.roughness;
    o.grow(s.lacunarity);
  }
  const float rest = s.detail - std::floor(s.detail);
  return rest == 0.0f ? value : value * (rest * power * o.value() + 1.0f);
}

float hetero_terrain(Octaves o, const NoiseShape& s) {
  float power = s.roughness, value = s.offset + o.value();
  o.grow(s.lacunarity);
  for (int k = 1; k <= int(s.detail); ++k) {
    value += (o.value() + s.offset) * power * value;
    power *= s.roughness;
    o.grow(s.lacunarity);
  }
  const float rest = s.detail - std::floor(s.detail);
  return rest == 0.0f ? value : value + rest * (o.value() + s.offset) * power * value;
}

float hybrid(Octaves o, const NoiseShape& s) {
  float power = 1.0f, value = 0.0f, weight = 1.0f;
  for (int k = 0; weight > 0.001f && k <= int(s.detail); ++k) {
    weight = std::min(weight, 1.0f);
    const float signal = (o.value() + s.offset) * power;
    power *= s.roughness;
    value += weight * signal;
    weight *= s.gain * signal;
    o.grow(s.lacunarity);
  }
  const float rest = s.detail - std::floor(s.detail);
  if (rest != 0.0f && weight > 0.001f) value += rest * std::min(weight, 1.0f) * (o.value() + s.offset) * power;
  return value;
}

float ridged(Octaves o, const NoiseShape& s) {
  float power = s.roughness, signal = s.offset - std::fabs(o.value());
  signal *= signal;
  float value = signal;
  for (int k = 1; k <= int(s.detail); ++k) {
    o.grow(s.lacunarity);
    const float weight = std::clamp(signal * s.gain, 0.0f, 1.0f);
    signal = s.offset - std::fabs(o.value());
    signal *= signal * weight;
    value += signal * power;
    power *= s.roughness;
  }
  return value;
}

}  // namespace

uint32_t jenkins(uint32_t x) {
  Lookup3 h(1);
  h.a += x;
  return h.finish();
}
uint32_t jenkins(uint32_t x, uint32_t y) {
  Lookup3 h(2);
  h.a += x, h.b += y;
  return h.finish();
}
uint32_t jenkins(uint32_t x, uint32_t y, uint32_t z) {
  Lookup3 h(3);
  h.a += x, h.b += y, h.c += z;
  return h.finish();
}
uint32_t jenkins(uint32_t x, uint32_t y, uint32_t z, uint32_t w) {
  Lookup3 h(4);
  h.a += x, h.b += y, h.c += z;
  h.mix();
  h.a += w;
  return h.finish();
}

float hash_floats(const float* v, int count) {
  const auto bits = [&](int k) { return std::bit_cast<uint32_t>(v[k]); };
  const uint32_t h = count == 1   ? jenkins(bits(0))
                     : count == 2 ? jenkins(bits(0), bits(1))
                     : count == 3 ? jenkins(bits(0), bits(1), bits(2))
                                  : jenkins(bits(0), bits(1), bits(2), bits(3));
  return float(h) * (1.0f / float(0xffffffffu));
}

Vec3 hash_color(const float* v, int count) {
  if (count == 4) {
    const float second[4] = {v[2], v[0], v[3], v[1]}, third[4] = {v[3], v[2], v[1], v[0]};
    return {hash_floats(v, 4), hash_floats(second, 4), hash_floats(third, 4)};
  }
  float more[4];
  std::copy(v, v + count, more);
  more[count] = 1.0f;
  const float second = hash_floats(more, count + 1);
  more[count] = 2.0f;
  return {hash_floats(v, count), second, hash_floats(more, count + 1)};
}

void pcg(const int32_t* cell, int count, float* out) {
  uint32_t v[4];
  for (int k = 0; k < count; ++k) v[k] = uint32_t(cell[k]) * 1664525u + 1013904223u;
  const auto stir = [&] {
    if (count == 2) {
      v[0] += v[1] * 1664525u, v[1] += v[0] * 1664525u;
    } else if (count == 3) {
      v[0] += v[1] * v[2], v[1] += v[2] * v[0], v[2] += v[0] * v[1];
    } else {
      v[0] += v[1] * v[3], v[1] += v[2] * v[0], v[2] += v[0] * v[1], v[3] += v[1] * v[2];
    }
  };
  stir();
  for (int k = 0; k < count; ++k) v[k] ^= uint32_t(int32_t(v[k]) >> 16);
  stir();
  for (int k = 0; k < count; ++k) out[k] = float(v[k] & 0x7fffffffu) * (1.0f / float(0x7fffffff));
}

float gradient_noise(const float* p, int count) {
  switch (count) {
    case 1:
      return perlin<1>(p);
    case 2:
      return perlin<2>(p);
    case 3:
      return perlin<3>(p);
    default:
      return perlin<4>(p);
  }
}

float fractal_noise(const float* p, int count, const NoiseShape& shape) {
  const Octaves o(p, count);
  switch (shape.kind) {
    case NoiseKind::kMultifractal:
      return multifractal(o, shape);
    case NoiseKind::kHybrid:
      return hybrid(o, shape);
    case NoiseKind::kRidged:
      return ridged(o, shape);
    case NoiseKind::kHetero:
      return hetero_terrain(o, shape);
    default:
      return fbm(o, shape);
  }
}

}  // namespace afterglow
