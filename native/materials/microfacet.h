// SPDX-License-Identifier: GPL-3.0-or-later
// The GGX distribution of normals with Smith's masking (Walter et al. 2007; Heitz 2014), sampling of its visible
// normals by spherical caps (Dupuy and Benyoub 2023), and Fresnel terms. All directions in the frame of the normal, z
// up.
#pragma once

#include "materials/surface.h"

namespace afterglow {

inline float sqr(float x) { return x * x; }
inline float saturate(float x) { return x > 0.0f ? (x < 1.0f ? x : 1.0f) : 0.0f; }  // NaN: 0
inline Rgb saturate(const Rgb& c) { return {saturate(c.x), saturate(c.y), saturate(c.z)}; }
inline Rgb lerp(const Rgb& a, const Rgb& b, float t) { return a + (b - a) * t; }
inline float mean(const Rgb& c) { return (c.x + c.y + c.z) * (1.0f / 3.0f); }

/// Sine and cosine of 2π × turns by polynomials within an eighth of a turn; error below 1e-6. Much cheaper than libm's.
inline Vec2 sincos_turns(float turns) {
  const float quarters = turns * 4.0f, whole = std::floor(quarters + 0.5f);
  const float r = (quarters - whole) * (0.5f * kPi), r2 = r * r;
  const float s = r * (1.0f + r2 * (-1.0f / 6.0f + r2 * (1.0f / 120.0f - r2 * (1.0f / 5040.0f))));
  const float c = 1.0f + r2 * (-0.5f + r2 * (1.0f / 24.0f + r2 * (-1.0f / 720.0f + r2 * (1.0f / 40320.0f))));
  switch (int(whole) & 3) {
    case 0:
      return {s, c};
    case 1:
      return {c, -s};
    case 2:
      return {-s, -c};
    default:
      return {-c, s};
  }
}

/// Exact unpolarised reflectance; cosine ≥ 0 on the incident side, eta = other side over incident side.
inline float fresnel_dielectric(float cosine, float eta) {
  const float g2 = eta * eta - 1.0f + cosine * cosine;
  if (g2 <= 0.0f) return 1.0f;
  const float g = std::sqrt(g2);
  const float a = (g - cosine) / (g + cosine);
  const float b = (cosine * (g + cosine) - 1.0f) / (cosine * (g - cosine) + 1.0f);
  return 0.5f * a * a * (1.0f + b * b);
}
inline float f0_from_ior(float ior) { return sqr((ior - 1.0f) / (ior + 1.0f)); }
inline float ior_from_f0(float f0) {
  const float root = std::sqrt(saturate(f0) < 0.99f ? saturate(f0) : 0.99f);
  return (1.0f + root) / (1.0f - root);
}
inline float fifth(float x) { return sqr(sqr(x)) * x; }
Rgb fresnel_conductor(float cosine, const Rgb& n, const Rgb& k);

/// Reflected share at a microfacet, by the lobe's Fresnel term. ior as the ray meets the surface.
inline Rgb fresnel(const Lobe& lobe, float cosine) {
  switch (lobe.fresnel) {
    case Fresnel::kNone:
      return Rgb(1.0f);
    case Fresnel::kDielectric:
      return Rgb(fresnel_dielectric(cosine, lobe.ior));
    case Fresnel::kSchlick: {
      const float start = f0_from_ior(lobe.ior);
      const float share = saturate((fresnel_dielectric(cosine, lobe.ior) - start) / (1.0f - start));
      const Rgb end = lobe.kind == LobeKind::kMicrofacetReflection ? lobe.f90 : Rgb(1.0f);
      return lerp(lobe.f0, end, share);
    }
    case Fresnel::kF82: {
      const float x = saturate(1.0f - cosine);
      return saturate(lerp(lobe.f0, Rgb(1.0f), fifth(x)) - lobe.f90 * (cosine * fifth(x) * x));
    }
    case Fresnel::kConductor:
      return fresnel_conductor(cosine, lobe.f0, lobe.f90);
  }
  return Rgb(1.0f);
}
/// The factor B of Lazanyi's term, so that the reflectance at about 82° is f82 × Schlick's (Kutz et al. 2021).
inline Rgb f82_factor(const Rgb& f0, const Rgb& f82) {
  const float cosine = 1.0f / 7.0f, x = 6.0f / 7.0f;
  return lerp(f0, Rgb(1.0f), fifth(x)) * (Rgb(1.0f) - f82) / (cosine * fifth(x) * x);
}

inline float ggx_lambda(const Vec3& v, float ax, float ay) {
  const float t = (sqr(ax * v.x) + sqr(ay * v.y)) / sqr(v.z);
  return 0.5f * (std::sqrt(1.0f + t) - 1.0f);
}
inline float ggx_distribution(const Vec3& h, float ax, float ay) {
  const float s = sqr(h.x / ax) + sqr(h.y / ay) + sqr(h.z);
  return kInvPi / (ax * ay * s * s);
}
/// Beckmann's distribution, and its masking by the rational fit of Walter et al. 2007.
inline float beckmann_distribution(const Vec3& h, float ax, float ay) {
  const float c2 = sqr(h.z);
  if (!(c2 > 1e-12f)) return 0.0f;
  return std::exp(-(sqr(h.x / ax) + sqr(h.y / ay)) / c2) * kInvPi / (ax * ay * c2 * c2);
}
inline float beckmann_lambda(const Vec3& v, float ax, float ay) {
  const float t = (sqr(ax * v.x) + sqr(ay * v.y)) / sqr(v.z);
  if (t < 0.390625f) return 0.0f;
  const float a = 1.0f / std::sqrt(t);
  return (1.0f - a * (1.259f - 0.396f * a)) / (a * (3.535f + 2.181f * a));
}
/// A normal with density D(h) cos(h).
inline Vec3 beckmann_sample(float ax, float ay, const Vec2& u) {
  const float r = std::sqrt(-std::log(std::fmax(1.0f - u.y, 1e-7f)));
  const Vec2 around = sincos_turns(u.x);
  return glm::normalize(Vec3(ax * r * around.y, ay * r * around.x, 1.0f));
}
inline bool is_beckmann(Distribution d) {
  return d == Distribution::kBeckmann || d == Distribution::kBeckmannSeparable;
}

/// A visible normal for the direction o (o.z > 0), with density G1(o) D(h) (o·h) / o.z.
inline Vec3 ggx_sample(const Vec3& o, float ax, float ay, const Vec2& u) {
  const Vec3 w = glm::normalize(Vec3(ax * o.x, ay * o.y, o.z));
  const Vec2 around = sincos_turns(u.x);
  const float z = (1.0f - u.y) * (1.0f + w.z) - w.z;
  const float r = std::sqrt(saturate(1.0f - z * z));
  const Vec3 h = Vec3(r * around.y, r * around.x, z) + w;
  return glm::normalize(Vec3(ax * h.x, ay * h.y, std::fmax(h.z, 1e-7f)));
}
/// Burley's generalised Trowbridge–Reitz distribution with exponent 1.
inline float gtr1_distribution(float cosine, float alpha) {
  if (alpha >= 1.0f) return kInvPi;
  const float a2 = alpha * alpha;
  return (a2 - 1.0f) / (kPi * std::log(a2) * (1.0f + (a2 - 1.0f) * sqr(cosine)));
}

}  // namespace afterglow
