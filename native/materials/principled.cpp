// SPDX-License-Identifier: GPL-3.0-or-later
// The Principled shader in its two meanings. Since Blender 4.0: sheen over coat over metal, glass, and a dielectric
// over diffuse, each layer taking its albedo from what lies below. Before: Burley's lobes side by side (Burley 2012,
// 2015).
#include "materials/albedo_tables.h"
#include "materials/closures.h"
#include "materials/sheen.h"

namespace afterglow {
namespace {

Rgb positive(const Rgb& c) { return glm::max(c, Rgb(0.0f)); }
/// What a layer leaves for those below.
Rgb under(const Rgb& weight, const Rgb& layer) {
  const Rgb share(weight.x > 0 ? layer.x / weight.x : 0.0f, weight.y > 0 ? layer.y / weight.y : 0.0f,
                  weight.z > 0 ? layer.z / weight.z : 0.0f);
  return weight * saturate(1.0f - max_component(share));
}

Lobe reflection(const Vec3& normal, const HitContext& hit) {
  Lobe lobe;
  lobe.kind = LobeKind::kMicrofacetReflection;
  lobe.pass = LobeClass::kGlossy;
  lobe.normal = reflecting_normal(normal, hit.points[0]->face_normal, hit.points[0]->outgoing);
  return lobe;
}

/// The Fresnel term of a dielectric layer averaged over its microfacets.
Rgb dielectric_fresnel(const Lobe& lobe, const Vec3& outgoing, const Rgb& f90) {
  const float cosine = saturate(glm::dot(lobe.normal, outgoing));
  const float roughness = std::sqrt(std::sqrt(lobe.alpha_x * lobe.alpha_y));
  return lerp(lobe.f0, f90, schlick_share(cosine, roughness, lobe.ior));
}

/// The Fresnel term of a dielectric layer averaged over cosine-weighted directions (fits of Kulla and Conty 2017).
Rgb hemispheric_fresnel(const Lobe& lobe) {
  const float n = lobe.ior, f0 = f0_from_ior(n);
  const float mean =
      n < 1.0f ? 0.997118f + n * (0.1014f - n * (0.965241f + n * 0.130607f)) : (n - 1.0f) / (4.08567f + 1.00071f * n);
  return lerp(lobe.f0, lobe.f90, saturate((mean - f0) / (1.0f - f0)));
}

/// What a layer takes from those below, as Blender reckons it: compensation counts by its darkening alone.
Rgb returned_by(const Lobe& lobe, const Vec3& outgoing) {
  return lobe.weight / lobe.energy * dielectric_fresnel(lobe, outgoing, lobe.f90);
}

}  // namespace

void add_principled(const Operands& in, const HitContext& hit, Surface& surface) {
  const SurfacePoint& point = *hit.points[0];
  const Vec3& o = point.outgoing;
  const bool no_glossy = hit.path && hit.path->drop_glossy, no_refraction = hit.path && hit.path->drop_refractive;
  const bool multi = in.u(kParamMulti) != 0;
  const float alpha = saturate(in.f(kAlpha));
  if (alpha < 1.0f) surface.transparency += Rgb(in.f(kWeight) * (1.0f - alpha));
  Rgb weight(in.f(kWeight) * alpha);
  if (!(weight.x > kLeastWeight && weight.x < 1e10f)) return;
  bool bumped, coat_bumped;
  const Vec3 normal = closure_normal(in, kNormalIn, point, bumped);
  const Vec3 coat_normal = closure_normal(in, kCoatNormal, point, coat_bumped);
  const Rgb base = positive(in.v(kBaseColor)), clamped = saturate(base), tint = positive(in.v(kSpecularTint));
  const float roughness = saturate(in.f(kRoughness));
  const float ior = std::fmin(std::fmax(in.f(kIor), 1e-5f), 1e5f);

  if (const float sheen = std::fmin(in.f(kSheenWeight), 1e3f); sheen > kLeastWeight) {
    Lobe lobe;
    lobe.kind = LobeKind::kSheen;
    const float coat = saturate(in.f(kCoatWeight));
    lobe.normal = glm::normalize(lerp(normal, coat_normal, coat));
    lobe.bumped = bumped;
    const float cosine = glm::dot(lobe.normal, o);
    if (cosine > 0.0f) {
      sheen_setup(lobe, cosine, in.f(kSheenRoughness));
      lobe.weight = weight * positive(in.v(kSheenTint)) * (sheen * sheen_albedo(cosine, in.f(kSheenRoughness)));
      lobe.sampling_weight = mean(lobe.weight);
      push_lobe(surface, lobe);
      weight = under(weight, lobe.weight);
    }
  }
  if (const float coat = std::fmin(std::fmax(in.f(kCoatWeight), 0.0f), 1e3f); coat > kLeastWeight) {
    const float coat_ior = std::fmin(std::fmax(in.f(kCoatIor), 1.0f), 1e3f);
    if (!no_glossy) {
      Lobe lobe = reflection(coat_normal, hit);
      lobe.bumped = coat_bumped;
      lobe.alpha_x = lobe.alpha_y = sqr(saturate(in.f(kCoatRoughness)));
      lobe.fresnel = Fresnel::kSchlick;
      lobe.ior = coat_ior;
      lobe.f0 = Rgb(f0_from_ior(coat_ior));
      lobe.weight = weight * coat;
      const Rgb returned = returned_by(lobe, o);
      lobe.sampling_weight = mean(returned);
      push_lobe(surface, lobe);
      weight = under(weight, returned);
    }
    const Rgb coat_tint = saturate(in.v(kCoatTint));
    if (coat_tint != Rgb(1.0f)) {
      const float cos_o = glm::dot(o, coat_normal);
      const float cos_t = std::sqrt(std::fmax(1.0f - (1.0f - cos_o * cos_o) / sqr(coat_ior), 1e-6f));
      weight *= lerp(Rgb(1.0f), glm::pow(coat_tint, Rgb(1.0f / cos_t)), saturate(coat));
    }
  }
  if (const float strength = in.f(kEmissionStrength); strength > 0.0f && std::isfinite(strength)) {
    const Rgb emitted = weight * positive(in.v(kEmissionColor)) * strength;
    if (is_finite(emitted)) surface.emission += emitted;
  }
  const bool anisotropic = in.f(kAnisotropic) > 1e-4f;
  const Vec3 tangent = !anisotropic ? Vec3(1, 0, 0) : (in.given(kTangentIn) ? in.v(kTangentIn) : default_tangent(hit));
  const auto shape = [&](Lobe& lobe) {
    lobe.bumped = bumped;
    set_anisotropy(lobe, roughness, in.f(kAnisotropic), in.f(kAnisotropicRotation), tangent, true);
  };
  if (const float metallic = saturate(in.f(kMetallicIn)); metallic > kLeastWeight) {
    if (!no_glossy) {
      Lobe lobe = reflection(normal, hit);
      shape(lobe);
      lobe.fresnel = Fresnel::kF82;
      lobe.f0 = clamped;
      lobe.f90 = f82_factor(clamped, saturate(tint));
      lobe.weight = weight * metallic;
      lobe.sampling_weight = mean(lobe.weight * fresnel(lobe, saturate(glm::dot(lobe.normal, o))));
      if (multi) compensate(lobe, o, saturate(lerp(clamped, Rgb(1.0f), 1.0f / 21.0f) - lobe.f90 * (1.0f / 126.0f)));
      push_lobe(surface, lobe);
    }
    weight *= 1.0f - metallic;
  }
  if (const float transmission = saturate(in.f(kTransmissionWeight)); transmission > kLeastWeight) {
    if (!(no_glossy && no_refraction)) {
      Lobe lobe = reflection(normal, hit);
      lobe.kind = no_glossy ? LobeKind::kMicrofacetRefraction : LobeKind::kMicrofacetGlass;
      lobe.pass = LobeClass::kTransmission;
      lobe.bumped = bumped;
      lobe.alpha_x = lobe.alpha_y = sqr(roughness);
      lobe.ior = point.backfacing ? 1.0f / ior : ior;
      if (std::fabs(lobe.ior - 1.0f) < 1e-4f) lobe.alpha_x = lobe.alpha_y = 0.0f;
      lobe.fresnel = Fresnel::kSchlick;
      lobe.f0 = f0_from_ior(ior) * tint;
      lobe.f90 = no_refraction ? Rgb(0.0f) : glm::sqrt(clamped);
      lobe.weight = weight * transmission;
      lobe.sampling_weight = mean(lobe.weight);
      if (multi && lobe.alpha_x > 0.0f) {
        const Rgb reflected = dielectric_fresnel(lobe, o, Rgb(1.0f));
        compensate(lobe, o, reflected + (Rgb(1.0f) - reflected) * glm::sqrt(clamped));
      }
      push_lobe(surface, lobe);
    }
    weight *= 1.0f - transmission;
  }
  if (!no_glossy && max_component(weight) > kLeastWeight) {
    float f0 = f0_from_ior(ior), eta = ior;
    if (const float level = std::fmin(std::fmax(in.f(kSpecularLevel), 0.0f), 1e3f); level != 0.5f) {
      f0 *= 2.0f * level;
      eta = ior_from_f0(f0);
      if (ior < 1.0f) eta = 1.0f / eta;
    }
    Lobe lobe = reflection(normal, hit);
    shape(lobe);
    lobe.fresnel = Fresnel::kSchlick;
    lobe.ior = eta;
    lobe.f0 = f0 * tint;
    lobe.weight = weight;
    if (eta != 1.0f) {
      if (multi) compensate(lobe, o, hemispheric_fresnel(lobe));
      const Rgb returned = returned_by(lobe, o);
      lobe.sampling_weight = mean(returned * lobe.energy);
      push_lobe(surface, lobe);
      weight = under(weight, returned);
    }
  }
  Lobe lobe;
  lobe.normal = normal;
  lobe.bumped = bumped;
  lobe.weight = weight * base;
  lobe.sampling_weight = mean(lobe.weight);
  if (const float rough = in.f(kDiffuseRoughness); rough > 1e-5f) {
    lobe.kind = LobeKind::kOrenNayar;
    lobe.alpha_x = saturate(rough);
    lobe.f0 = clamped;
  }
  push_lobe(surface, lobe);
}

void add_principled_v1(const Operands& in, const HitContext& hit, Surface& surface) {
  const SurfacePoint& point = *hit.points[0];
  const Vec3& o = point.outgoing;
  const bool no_glossy = hit.path && hit.path->drop_glossy, no_refraction = hit.path && hit.path->drop_refractive;
  const bool multi = in.u(kParamMulti) != 0;
  const float alpha = saturate(in.f(kAlpha));
  surface.transparency += Rgb(in.f(kWeight) * (1.0f - alpha));
  const float weight = in.f(kWeight) * alpha;
  if (!(weight > kLeastWeight)) return;
  if (const float strength = in.f(kEmissionStrength); strength > 0.0f && std::isfinite(strength)) {
    const Rgb emitted = positive(in.v(kEmissionColor)) * strength;
    if (is_finite(emitted)) surface.emission += emitted * weight;
  }
  bool bumped, coat_bumped;
  const Vec3 normal = closure_normal(in, kNormalIn, point, bumped);
  const Rgb base = positive(in.v(kBaseColor));
  const float metallic = saturate(in.f(kMetallicIn)), transmission = saturate(in.f(kTransmissionWeight));
  const float roughness = saturate(in.f(kRoughness)), ior = std::fmin(std::fmax(in.f(kIor), 1e-5f), 1e5f);
  const float through = transmission * (1.0f - metallic), diffuse = (1.0f - metallic) * (1.0f - transmission);
  const float gray = 0.3f * base.x + 0.6f * base.y + 0.1f * base.z;
  const Rgb hue = gray > 0.0f ? base / gray : Rgb(1.0f);
  const Rgb sheen_hue = luminance(base) > 0.0f ? base / luminance(base) : Rgb(1.0f);

  if (diffuse > kLeastWeight) {
    Lobe lobe;
    lobe.kind = LobeKind::kBurley;
    lobe.normal = normal, lobe.bumped = bumped;
    lobe.alpha_x = roughness;
    lobe.weight = base * (weight * diffuse);
    lobe.sampling_weight = mean(lobe.weight);
    push_lobe(surface, lobe);
    if (const float sheen = std::fmin(in.f(kSheenWeight), 1e3f); sheen > kLeastWeight) {
      lobe.kind = LobeKind::kSheenV1;
      lobe.weight = lerp(Rgb(1.0f), sheen_hue, in.f(kSheenTint)) * (weight * sheen * diffuse);
      lobe.sampling_weight = 0.05f * mean(lobe.weight);
      push_lobe(surface, lobe);
    }
  }
  const float specular = std::fmax(in.f(kSpecularLevel), 0.0f);
  const auto finish = [&](Lobe& lobe) {
    lobe.bumped = bumped;
    lobe.distribution = Distribution::kGgxSeparable;
    lobe.sampling_weight = mean(lobe.weight * fresnel(lobe, saturate(glm::dot(lobe.normal, o))));
  };
  const float specular_weight = 1.0f - through;
  if (!no_glossy && specular_weight > kLeastWeight && (specular > kLeastWeight || metallic > kLeastWeight)) {
    Lobe lobe = reflection(normal, hit);
    const bool anisotropic = in.f(kAnisotropic) > 1e-4f;
    const Vec3 tangent =
        !anisotropic ? Vec3(1, 0, 0) : (in.given(kTangentIn) ? in.v(kTangentIn) : default_tangent(hit));
    set_anisotropy(lobe, roughness, in.f(kAnisotropic), in.f(kAnisotropicRotation), tangent, true);
    lobe.fresnel = Fresnel::kSchlick;
    lobe.ior = 2.0f / (1.0f - std::sqrt(std::fmin(0.08f * specular, 0.98f))) - 1.0f;
    if (lobe.ior <= 1.0f) lobe.ior = 1.0001f;
    lobe.f0 = lerp(Rgb(1.0f), hue, in.f(kSpecularTint)) * (0.08f * specular * (1.0f - metallic)) + base * metallic;
    lobe.weight = Rgb(weight * specular_weight);
    finish(lobe);
    if (multi) {
      lobe.distribution = Distribution::kGgx;
      compensate(lobe, o, saturate(base));  // later bounces took the base colour
    }
    push_lobe(surface, lobe);
  }
  if (through > kLeastWeight && multi && roughness > 0.05f) {  // one lobe, and its whole light counts as transmission
    if (!(no_glossy && no_refraction)) {
      Lobe lobe = reflection(normal, hit);
      lobe.kind = LobeKind::kMicrofacetGlass;
      lobe.pass = LobeClass::kTransmission;
      lobe.one_pass = true, lobe.bumped = bumped;
      lobe.alpha_x = lobe.alpha_y = sqr(roughness);
      lobe.ior = point.backfacing ? 1.0f / ior : ior;
      if (std::fabs(lobe.ior - 1.0f) < 1e-4f) lobe.alpha_x = lobe.alpha_y = 0.0f;
      lobe.fresnel = Fresnel::kDielectric;
      lobe.f0 = no_glossy ? Rgb(0.0f) : lerp(Rgb(1.0f), base, in.f(kSpecularTint));
      lobe.f90 = no_refraction ? Rgb(0.0f) : base;
      lobe.weight = Rgb(weight * through);
      lobe.sampling_weight = mean(lobe.weight);
      if (lobe.alpha_x > 0.0f) compensate(lobe, o, glm::sqrt(saturate(base)));
      push_lobe(surface, lobe);
    }
  } else if (through > kLeastWeight) {
    const float eta = point.backfacing ? 1.0f / ior : ior;
    const float f = fresnel_dielectric(saturate(glm::dot(normal, o)), eta);
    if (!no_glossy) {
      Lobe lobe = reflection(normal, hit);
      lobe.alpha_x = lobe.alpha_y = sqr(roughness);
      lobe.fresnel = Fresnel::kSchlick;
      lobe.ior = eta;
      lobe.f0 = lerp(Rgb(1.0f), base, in.f(kSpecularTint));
      lobe.weight = Rgb(weight * through * f);
      finish(lobe);
      push_lobe(surface, lobe);
    }
    if (!no_refraction) {
      Lobe lobe = reflection(normal, hit);
      lobe.kind = LobeKind::kMicrofacetRefraction;
      lobe.pass = LobeClass::kTransmission;
      const float rough =
          multi ? roughness : 1.0f - (1.0f - roughness) * (1.0f - saturate(in.f(kTransmissionRoughness)));
      lobe.alpha_x = lobe.alpha_y = std::fabs(eta - 1.0f) < 1e-4f ? 0.0f : sqr(rough);
      lobe.ior = eta;
      lobe.weight = base * (weight * through * (1.0f - f));
      finish(lobe);
      push_lobe(surface, lobe);
    }
  }
  if (const float coat = std::fmin(in.f(kCoatWeight), 1e3f); coat > kLeastWeight && !no_glossy) {
    Lobe lobe = reflection(closure_normal(in, kCoatNormal, point, coat_bumped), hit);
    lobe.alpha_x = lobe.alpha_y = sqr(saturate(in.f(kCoatRoughness)));
    lobe.fresnel = Fresnel::kSchlick;
    lobe.ior = 1.5f;
    lobe.f0 = Rgb(0.04f);
    lobe.weight = Rgb(0.25f * coat * weight);
    finish(lobe);
    lobe.bumped = coat_bumped;
    lobe.distribution = Distribution::kGtr1;
    push_lobe(surface, lobe);
  }
}

}  // namespace afterglow
