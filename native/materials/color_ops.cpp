// SPDX-License-Identifier: GPL-3.0-or-later
// HSV, HSL, black bodies and single wavelengths.
#include "materials/color_ops.h"

#include <algorithm>
#include <iterator>

namespace afterglow {
namespace {

float hue_of(const Rgb& c, float high, float span) {
  if (!(span > 0.0f)) return 0.0f;
  float h;
  if (c.x == high)
    h = (c.y - c.z) / span;
  else if (c.y == high)
    h = 2.0f + (c.z - c.x) / span;
  else
    h = 4.0f + (c.x - c.y) / span;
  h /= 6.0f;
  return h < 0.0f ? h + 1.0f : h;
}

Rgb pure_hue(float h) {
  const auto ramp = [](float v) { return std::clamp(v, 0.0f, 1.0f); };
  return {ramp(std::fabs(h * 6.0f - 3.0f) - 1.0f), ramp(2.0f - std::fabs(h * 6.0f - 2.0f)),
          ramp(2.0f - std::fabs(h * 6.0f - 4.0f))};
}

// The standard observer of CIE 1931 (2°), every 10 nm from 380.
constexpr float kObserver[][3] = {
    {.001368f, .000039f, .006450f},  {.004243f, .000120f, .020050f},  {.014310f, .000396f, .067850f},
    {.043510f, .001210f, .207400f},  {.134380f, .004000f, .645600f},  {.283900f, .011600f, 1.385600f},
    {.348280f, .023000f, 1.747060f}, {.336200f, .038000f, 1.772110f}, {.290800f, .060000f, 1.669200f},
    {.195360f, .090980f, 1.287640f}, {.095640f, .139020f, .812950f},  {.032010f, .208020f, .465180f},
    {.004900f, .323000f, .272000f},  {.009300f, .503000f, .158200f},  {.063270f, .710000f, .078250f},
    {.165500f, .862000f, .042160f},  {.290400f, .954000f, .020300f},  {.433450f, .994950f, .008750f},
    {.594500f, .995000f, .003900f},  {.762100f, .952000f, .002100f},  {.916300f, .870000f, .001650f},
    {1.026300f, .757000f, .001100f}, {1.062200f, .631000f, .000800f}, {1.002600f, .503000f, .000340f},
    {.854450f, .381000f, .000190f},  {.642400f, .265000f, .000050f},  {.447900f, .175000f, .000020f},
    {.283500f, .107000f, 0.0f},      {.164900f, .061000f, 0.0f},      {.087400f, .032000f, 0.0f},
    {.046770f, .017000f, 0.0f},      {.022700f, .008210f, 0.0f},      {.011359f, .004102f, 0.0f},
    {.005790f, .002091f, 0.0f},      {.002899f, .001047f, 0.0f},      {.001440f, .000520f, 0.0f},
    {.000690f, .000249f, 0.0f},      {.000332f, .000120f, 0.0f},      {.000166f, .000060f, 0.0f},
    {.000083f, .000030f, 0.0f},      {.000042f, .000015f, 0.0f}};
constexpr int kObserverRows = int(std::size(kObserver));

Rgb xyz_to_rgb(const Vec3& c) {
  return {3.2404542f * c.x - 1.5371385f * c.y - 0.4985314f * c.z,
          -0.9692660f * c.x + 1.8760108f * c.y + 0.0415560f * c.z,
          0.0556434f * c.x - 0.2040259f * c.y + 1.0572252f * c.z};
}

}  // namespace

Vec3 observer(float nm) {
  const float at = (nm - 380.0f) / 10.0f;
  if (!(at >= 0.0f && at < float(kObserverRows - 1))) return Vec3(0.0f);
  const int k = int(at);
  const float t = at - float(k);
  const float *a = kObserver[k], *b = kObserver[k + 1];
  return {a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t, a[2] + (b[2] - a[2]) * t};
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
  for (int k = 0; k < 80; ++k) {  // Planck's law over the visible range
    const float nm = 380.0f + 5.0f * float(k), m = nm * 1e-3f;
    const float radiance = 1.0f / (std::pow(m, 5.0f) * (std::exp(std::min(14387.77f / (m * t), 80.0f)) - 1.0f));
    sum += observer(nm) * radiance;
  }
  const Rgb color = xyz_to_rgb(sum / std::fmax(sum.y, 1e-30f));
  const float scale = luminance(color);
  return color / std::fmax(scale, 1e-6f);
}

Rgb wavelength(float nanometres) { return glm::max(xyz_to_rgb(observer(nanometres)) * (1.0f / 2.52f), Rgb(0.0f)); }

}  // namespace afterglow
