// SPDX-License-Identifier: GPL-3.0-or-later
// Integer hashes and gradient noise: Jenkins' lookup3 over the bits of the arguments, Perlin's improved noise in one to
// four dimensions, sums of octaves (fBm, multifractals: Musgrave et al. 1989), and the PCG hashes of Jarzynski and
// Olano 2020.
#pragma once

#include "base/math.h"

namespace afterglow {

uint32_t jenkins(uint32_t);
uint32_t jenkins(uint32_t, uint32_t);
uint32_t jenkins(uint32_t, uint32_t, uint32_t);
uint32_t jenkins(uint32_t, uint32_t, uint32_t, uint32_t);
/// 0 … 1, both included, from the bits of `count` floats (1 to 4).
float hash_floats(const float* values, int count);
/// Three numbers from one place: red, green and blue of white noise.
Vec3 hash_color(const float* values, int count);

/// Signed PCG hashes of a cell, each component 0 … 1. count 2, 3 or 4.
void pcg(const int32_t* cell, int count, float* out);

/// Gradient noise, about −1 … 1. count 1 to 4.
float gradient_noise(const float* p, int count);

enum class NoiseKind : uint32_t { kFbm, kMultifractal, kHybrid, kRidged, kHetero };
struct NoiseShape {
  NoiseKind kind = NoiseKind::kFbm;
  bool normalize = true;
  float detail = 2.0f, roughness = 0.5f, lacunarity = 2.0f, offset = 0.0f, gain = 1.0f;
};
float fractal_noise(const float* p, int count, const NoiseShape&);

}  // namespace afterglow
