// SPDX-License-Identifier: GPL-3.0-or-later
// Skies: see sky.h. The atmosphere: Rayleigh and Mie scattering and ozone's absorption along the ray and on towards the
// sun, at eleven wavelengths (Nishita et al. 1993; ozone as a layer about 25 km up). Directions are Blender's: the
// sun's rotation turns from +y towards +x.
#include "materials/sky.h"

#include <algorithm>
#include <array>

#include "materials/color_ops.h"
#include "materials/microfacet.h"

namespace afterglow {
namespace {

constexpr int kTableWidth = 64, kTableHeight = 64;
constexpr int kWavelengths = 11;  // 400, 430, … 700 nm
constexpr float kEarth = 6360e3f, kTop = 6420e3f;

Rgb xyz_to_rgb(const Vec3& c) {
  return {3.2404542f * c.x - 1.5371385f * c.y - 0.4985314f * c.z,
          -0.9692660f * c.x + 1.8760108f * c.y + 0.0415560f * c.z,
          0.0556434f * c.x - 0.2040259f * c.y + 1.0572252f * c.z};
}

float perez(const Operands& in, int at, float theta, float gamma) {
  const float c = std::cos(gamma);
  return (1.0f + in.p(at) * std::exp(in.p(at + 1) / std::cos(theta))) *
         (1.0f + in.p(at + 2) * std::exp(in.p(at + 3) * gamma) + in.p(at + 4) * c * c);
}

float perez(const float* l, float theta, float gamma) {
  const float c = std::cos(gamma);
  return (1.0f + l[0] * std::exp(l[1] / std::cos(theta))) * (1.0f + l[2] * std::exp(l[3] * gamma) + l[4] * c * c);
}

Vec3 preetham(const Vec3& d, const Operands& in) {
  const Vec3 sun(in.p(1), in.p(2), in.p(3));
  const float gamma = std::acos(std::clamp(glm::dot(d, sun), -1.0f, 1.0f));
  const float theta = std::min(std::acos(std::clamp(d.z, -1.0f, 1.0f)), 0.5f * kPi - 0.001f);
  float v[3];  // Y, x, y
  for (int k = 0; k < 3; ++k) v[k] = in.p(4 + 6 * k) * perez(in, 5 + 6 * k, theta, gamma);
  if (!(v[2] > 0.0f)) return Vec3(0.0f);
  const Vec3 xyz(v[1] / v[2] * v[0], v[0], (1.0f - v[1] - v[2]) / v[2] * v[0]);
  return glm::max(xyz_to_rgb(xyz), Rgb(0.0f));
}

using Spectrum = std::array<float, kWavelengths>;

float nanometres(int k) { return 400.0f + 30.0f * float(k); }
// Sunlight outside of the atmosphere, W/(m² nm), every 30 nm from 400 (ASTM E-490, rounded, and lessened by 14 to 17 %
// so that a clear sky is as bright as Blender 5.0's with single scattering: within 4 % over the upper half).
constexpr Spectrum kSun{1.33f, 1.37f, 1.70f, 1.63f, 1.61f, 1.60f, 1.57f, 1.50f, 1.42f, 1.31f, 1.23f};
// Ozone's absorption per metre at the layer's middle.
constexpr Spectrum kOzone{4.0e-9f, 3.0e-8f, 2.0e-7f, 4.8e-7f, 9.5e-7f, 1.5e-6f,
                          2.1e-6f, 2.3e-6f, 1.5e-6f, 8.5e-7f, 4.5e-7f};

float rayleigh(int k) { return 5.8e-6f * std::pow(680.0f / nanometres(k), 4.0f); }
constexpr float kMie = 2.0e-5f, kMieForward = 0.76f;

struct Densities {
  float air, dust, ozone;
};
Densities densities(float height) {
  const float layer = height < 25e3f ? height / 15e3f - 2.0f / 3.0f : 8.0f / 3.0f - height / 15e3f;
  return {std::exp(-height / 8e3f), std::exp(-height / 1.2e3f), saturate(layer)};
}

float to_top(const Vec3& p, const Vec3& d) {
  const float b = glm::dot(p, d), c = glm::dot(p, p) - kTop * kTop;
  return -b + std::sqrt(std::max(b * b - c, 0.0f));
}
bool hits_earth(const Vec3& p, const Vec3& d) {
  const float b = glm::dot(p, d);
  return b < 0.0f && glm::dot(p, p) - b * b < kEarth * kEarth;
}

Densities column(const Vec3& p, const Vec3& d, int steps) {
  const float step = to_top(p, d) / float(steps);
  Densities sum{0, 0, 0};
  for (int k = 0; k < steps; ++k) {
    const Densities here = densities(std::max(glm::length(p + d * (step * (float(k) + 0.5f))) - kEarth, 0.0f));
    sum.air += here.air * step, sum.dust += here.dust * step, sum.ozone += here.ozone * step;
  }
  return sum;
}

float extinction(const Densities& column, const Atmosphere& a, int k) {
  return rayleigh(k) * column.air * a.air + 1.11f * kMie * column.dust * a.dust +
         kOzone[size_t(k)] * column.ozone * a.ozone;
}

/// Light scattered once along a ray from the ground.
Spectrum scattered(const Vec3& d, const Vec3& sun, const Atmosphere& a) {
  const Vec3 eye(0.0f, 0.0f, kEarth + std::max(a.altitude, 1.0f));
  const float length = hits_earth(eye, d) ? 0.0f : to_top(eye, d), c = glm::dot(d, sun);
  const float phase_air = 3.0f / (16.0f * kPi) * (1.0f + c * c), g = kMieForward;
  const float phase_dust = 3.0f / (8.0f * kPi) * (1.0f - g * g) * (1.0f + c * c) /
                           ((2.0f + g * g) * std::pow(1.0f + g * g - 2.0f * g * c, 1.5f));
  constexpr int kSteps = 32;
  const float step = length / kSteps;
  Densities depth{0, 0, 0};
  Spectrum sum{};
  for (int s = 0; s < kSteps && step > 0.0f; ++s) {
    const Vec3 p = eye + d * (step * (float(s) + 0.5f));
    const Densities here = densities(std::max(glm::length(p) - kEarth, 0.0f));
    depth.air += here.air * step, depth.dust += here.dust * step, depth.ozone += here.ozone * step;
    if (hits_earth(p, sun)) continue;
    const Densities on = column(p, sun, 8);
    for (int k = 0; k < kWavelengths; ++k) {
      const float out = extinction({depth.air + on.air, depth.dust + on.dust, depth.ozone + on.ozone}, a, k);
      sum[size_t(k)] += std::exp(-out) * step * kSun[size_t(k)] *
                        (rayleigh(k) * here.air * a.air * phase_air + kMie * here.dust * a.dust * phase_dust);
    }
  }
  return sum;
}

Rgb to_color(const Spectrum& s) {
  Vec3 sum(0.0f);
  for (int k = 0; k < kWavelengths; ++k) sum += observer(nanometres(k)) * s[size_t(k)] * 30.0f;
  return glm::max(xyz_to_rgb(sum), Rgb(0.0f));
}

Vec3 sun_direction(float elevation, float rotation) {
  return {std::cos(elevation) * std::sin(rotation), std::cos(elevation) * std::cos(rotation), std::sin(elevation)};
}

Vec3 atmosphere(const Vec3& d, const Operands& in) {
  // sun direction (3), its half angle, its colour (3), rotation, table
  const Vec3 sun(in.p(1), in.p(2), in.p(3));
  const float half = in.p(4), angle = std::acos(std::clamp(glm::dot(d, sun), -1.0f, 1.0f));
  Rgb color(0.0f);
  if (half > 0.0f && angle < half && d.z > 0.0f) {
    const float limb = 1.0f - 0.6f * (1.0f - std::sqrt(std::max(1.0f - sqr(angle / half), 0.0f)));
    color += Rgb(in.p(5), in.p(6), in.p(7)) * limb;
  }
  const float turn = (std::atan2(d.x, d.y) - in.p(8)) * (0.5f * kInvPi);
  const float elevation = std::asin(std::clamp(d.z, -1.0f, 1.0f));
  const float fx = (turn - std::floor(turn)) * kTableWidth;
  float up = 0.0f, fade = 1.0f;
  if (elevation >= 0.0f)
    up = std::sqrt(elevation * 2.0f * kInvPi) * (kTableHeight - 1);
  else
    fade = std::max(0.0f, 1.0f + elevation * 2.5f), fade = fade * fade * fade;  // towards the dark ground
  const int x = int(fx) % kTableWidth, next = (x + 1) % kTableWidth, y = std::min(int(up), kTableHeight - 2);
  const float tx = fx - std::floor(fx), ty = up - float(y);
  const auto at = [&](int column, int row) {
    const int k = 9 + 3 * (row * kTableWidth + column);
    return Rgb(in.p(k), in.p(k + 1), in.p(k + 2));
  };
  return color + lerp(lerp(at(x, y), at(next, y), tx), lerp(at(x, y + 1), at(next, y + 1), tx), ty) * fade;
}

}  // namespace

std::vector<float> preetham_parameters(const Vec3& toward, float t) {
  const float length = glm::length(toward);
  const Vec3 sun = length > 0.0f ? toward / length : Vec3(0, 0, 1);
  const float a = std::acos(std::clamp(sun.z, -1.0f, 1.0f)), a2 = a * a, a3 = a2 * a;
  const float chi = (4.0f / 9.0f - t / 120.0f) * (kPi - 2.0f * a);
  const float zenith[3] = {((4.0453f * t - 4.9710f) * std::tan(chi) - 0.2155f * t + 2.4192f) * 0.06f,
                           (0.00166f * a3 - 0.00375f * a2 + 0.00209f * a) * t * t +
                               (-0.02903f * a3 + 0.06377f * a2 - 0.03202f * a + 0.00394f) * t +
                               (0.11693f * a3 - 0.21196f * a2 + 0.06052f * a + 0.25886f),
                           (0.00275f * a3 - 0.00610f * a2 + 0.00317f * a) * t * t +
                               (-0.04214f * a3 + 0.08970f * a2 - 0.04153f * a + 0.00516f) * t +
                               (0.15346f * a3 - 0.26756f * a2 + 0.06670f * a + 0.26688f)};
  const float shape[3][5] = {{0.1787f * t - 1.4630f, -0.3554f * t + 0.4275f, -0.0227f * t + 5.3251f,
                              0.1206f * t - 2.5771f, -0.0670f * t + 0.3703f},
                             {-0.0193f * t - 0.2592f, -0.0665f * t + 0.0008f, -0.0004f * t + 0.2125f,
                              -0.0641f * t - 0.8989f, -0.0033f * t + 0.0452f},
                             {-0.0167f * t - 0.2608f, -0.0950f * t + 0.0092f, -0.0079f * t + 0.2102f,
                              -0.0441f * t - 1.6537f, -0.0109f * t + 0.0529f}};
  std::vector<float> all{sun.x, sun.y, sun.z};
  for (int k = 0; k < 3; ++k) {
    all.push_back(zenith[k] / perez(shape[k], 0.0f, a));
    all.insert(all.end(), shape[k], shape[k] + 5);
  }
  return all;
}

std::vector<float> atmosphere_parameters(const Atmosphere& a) {
  const Vec3 sun = sun_direction(a.sun_elevation, a.sun_rotation);
  const Vec3 reference = sun_direction(a.sun_elevation, 0.0f);
  const float half = a.disc ? 0.5f * std::max(a.sun_size, 0.0f) : 0.0f;
  Rgb direct(0.0f);
  const Vec3 eye(0.0f, 0.0f, kEarth + std::max(a.altitude, 1.0f));
  if (half > 0.0f && !hits_earth(eye, sun)) {
    const Densities through = column(eye, sun, 32);
    Spectrum light;
    for (int k = 0; k < kWavelengths; ++k) light[size_t(k)] = kSun[size_t(k)] * std::exp(-extinction(through, a, k));
    direct = to_color(light) * (a.sun_intensity / (2.0f * kPi * (1.0f - std::cos(half))));
  }
  std::vector<float> all{sun.x, sun.y, sun.z, half, direct.x, direct.y, direct.z, a.sun_rotation};
  for (int y = 0; y < kTableHeight; ++y) {
    const float elevation = sqr(float(y) / (kTableHeight - 1)) * 0.5f * kPi;
    for (int x = 0; x < kTableWidth; ++x) {
      const Vec3 d = sun_direction(std::max(elevation, 1e-4f), 2.0f * kPi * float(x) / kTableWidth);
      const Rgb color = to_color(scattered(d, reference, a));
      all.insert(all.end(), {color.x, color.y, color.z});
    }
  }
  return all;
}

Vec3 run_sky(const Vec3& direction, const Operands& in) {
  const float length = glm::length(direction);
  const Vec3 d = length > 0.0f ? direction / length : Vec3(0, 0, 1);
  return in.u(0) == 0 ? preetham(d, in) : atmosphere(d, in);
}

}  // namespace afterglow
