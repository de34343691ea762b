// SPDX-License-Identifier: GPL-3.0-or-later
// HSV, HSL, black bodies and single wavelengths. The observer is the analytic one of Wyman, Sloan and Shirley 2013.
#include "materials/color_ops.h"

#include <algorithm>

namespace afterglow {
namespace {

float hue_of(const Rgb& c, float high, float span) {
  if (!(span > 0.0f)) return 0.0f;
  float h;
  if (c.x == high) h = (c.y - c.z) / span;
  else if (c.y == high) h = 2.0f + (c.z - c.x) / span;
  else h = 4.0f + (c.x - c.y) / span;
  h /= 6.0f;
  return h < 0.0f ? h + 1.0f : h;
}

Rgb pure_hue(float h) {
  const auto ramp = [](float v) { return std::clamp(v, 0.0f, 1.0f); };
  return {ramp(std::fabs(h * 6.0f - 3.0f) - 1.0f), ramp(2.0f - std::fabs(h * 6.0f - 2.0f)),
          ramp(2.0f - std::fabs(h * 6.0f - 4.0f))};
}

float bell(float x, float centre, float left, float right) {
  const float t = (x - centre) * (x < centre ? left : right);
  return std::exp(-0.5f * t * t);
}

Rgb xyz_to_rgb(const Vec3& c) {
  return {3.2404542f * c.x - 1.5371385f * c.y - 0.4985314f * c.z, -0.9692660f * c.x + 1.8760108f * c.y + 0.0415560f * c.z,
          0.0556434f * c.x - 0.2040259f * c.y + 1.0572252f * c.z};
}

}  // namespace

Vec3 observer(float nm) {
  return {1.056f * bell(nm, 599.8f, 0.0264f, 0.0323f) + 0.362f * bell(nm, 442.0f, 0.0624f, 0.0374f) -
              0.065f * bell(nm, 501.1f, 0.0490f, 0.0382f),
          0.821f * bell(nm, 568.8f, 0.0213f, 0.0247f) + 0.286f * bell(nm, 530.9f, 0.0613f, 0.0322f),
          1.217f * bell(nm, 437.0f, 0.0845f, 0.0278f) + 0.681f * bell(nm, 459.0f, 0.0385f, 0.0725f)};
}

Vec3 rgb_to_hsv(const Rgb& c) {
  const float high = max_component(c), low = std::fmin(c.x, std::fmin(c.y, c.z)), span = high - low;
  return {hue_of(c, high, span), high != 0.0f ? span / high : 0.0f, high};
}

Rgb hsv_to_rgb(const Vec3& c) {
  if (c.y == 0.0f) return Rgb(c.z);
  const float h = c.x - std::floor(c.x);
  return ((pure_hue(h) - 1.0f) * c.y + 1.0f) * c.z;
}

Vec3 rgb_to_hsl(const Rgb& c) {
  const float high = max_component(c), low = std::fmin(c.x, std::fmin(c.y, c.z)), span = high - low;
  const float l = std::fmin(1.0f, 0.5f * (high + low));
  if (span == 0.0f) return {0.0f, 0.0f, l};
  return {hue_of(c, high, span), l > 0.5f ? span / (2.0f - high - low) : span / (high + low), l};
}

Rgb hsl_to_rgb(const Vec3& c) {
  const float chroma = (1.0f - std::fabs(2.0f * c.z - 1.0f)) * c.y;
  return (pure_hue(c.x - std::floor(c.x)) - 0.5f) * chroma + c.z;
}

Rgb blackbody(float kelvin) {
  const float t = std::clamp(kelvin, 800.0f, 12000.0f);
  Vec3 sum(0.0f);
  for (int k = 0; k < 45; ++k) {  // Planck's law over the visible range
    const float nm = 380.0f + 9.0f * float(k), m = nm * 1e-3f;
    const float radiance = 1.0f / (std::pow(m, 5.0f) * (std::exp(std::min(14387.77f / (m * t), 80.0f)) - 1.0f));
    sum += observer(nm) * radiance;
  }
  const Rgb color = xyz_to_rgb(sum / std::fmax(sum.y, 1e-30f));
  const float scale = luminance(color);
  return color / std::fmax(scale, 1e-6f);
}

Rgb wavelength(float nanometres) { return glm::max(xyz_to_rgb(observer(nanometres)) * (1.0f / 2.52f), Rgb(0.0f)); }

}  // namespace afterglow
