// SPDX-License-Identifier: GPL-3.0-or-later
// Evaluation, sampling and densities of a Surface with any lobes. One lobe is chosen by its sampling weight; the
// density is the mixture's, so that next-event light and sampled directions agree. Microfacets: Walter et al. 2007,
// Heitz 2014; diffuse with roughness: Portsmouth, Kutz and Hill 2024 (energy-preserving Oren–Nayar); Burley 2015.
#include "materials/albedo_tables.h"
#include "materials/microfacet.h"
#include "materials/sheen.h"

namespace afterglow {
namespace {

struct LobeValue {
  Rgb value{0.0f};  // × |cos|
  float density = 0.0f;
};

bool is_delta(const Lobe& lobe) {
  return lobe.kind >= LobeKind::kMicrofacetReflection && lobe.alpha_x * lobe.alpha_y <= kMirrorAlpha * kMirrorAlpha;
}

Vec3 cosine_sample(const Vec2& u) {
  const float r = std::sqrt(u.x);
  const Vec2 around = sincos_turns(u.y);
  return {r * around.y, r * around.x, std::sqrt(std::fmax(0.0f, 1.0f - u.x))};
}

/// Normals that do not bend with the surface let light in at angles where the surface itself (`smooth`: its shading
/// normal) is turned away. The bumps are taken for a rough surface and mask each other (Conty Estevez et al. 2019, "A
/// Microfacet-Based Shadowing Function to Solve the Bump Terminator Problem").
float bump_masking(const Vec3& smooth, const Vec3& normal, const Vec3& direction) {
  const float cos_i = glm::dot(smooth, direction), cos_d = glm::dot(smooth, normal);
  if (cos_i * cos_d < 0.0f) return 0.0f;
  if (std::fabs(cos_d) >= 1.0f || std::fabs(cos_i) >= 1.0f) return 1.0f;
  if (std::fabs(cos_i) < 1e-6f) return 0.0f;
  const float alpha2 = saturate(0.125f * (1.0f / sqr(std::fmax(std::fabs(cos_d), 1e-6f)) - 1.0f));
  return 2.0f / (1.0f + std::sqrt(1.0f + alpha2 * (1.0f / sqr(cos_i) - 1.0f)));
}

/// The same before Blender 4.3: the smooth shadowing of Chiang et al. 2019 ("Taming the Shadow Terminator").
float bump_shadowing(const Vec3& smooth, const Vec3& normal, const Vec3& direction) {
  const float bottom = glm::dot(normal, direction) * glm::dot(smooth, normal);
  const float g = bottom != 0.0f ? glm::dot(smooth, direction) / bottom : 0.0f;
  if (g >= 1.0f) return 1.0f;
  return g <= 0.0f ? 0.0f : g * (1.0f + g - g * g);
}

/// Integral of the Fujii-style single scattering lobe over directions, less its constant part (Portsmouth et al. 2024).
float oren_nayar_integral(float cosine) {
  if (cosine < 1e-6f) return kPi / 2.0f - 2.0f / 3.0f - cosine;
  const float sine = std::sqrt(saturate(1.0f - cosine * cosine));
  const float theta = std::acos(std::fmin(cosine, 1.0f));
  return sine * (theta - 2.0f / 3.0f - sine * cosine) + 2.0f / 3.0f * (sine / cosine) * (1.0f - sine * sine * sine);
}

/// f0 holds the albedo; alpha_x the roughness. alpha_y > 0: without multiple scattering, as Blender before 4.3.
Rgb oren_nayar(const Lobe& lobe, const Vec3& o, const Vec3& i, float cos_o, float cos_i) {
  const float a = 1.0f / (kPi + lobe.alpha_x * (kPi / 2.0f - 2.0f / 3.0f));
  const bool old = lobe.alpha_y > 0.0f;
  const float scale = old ? 1.0f / (kPi + (3.0f * kPi - 4.0f) / 6.0f * lobe.alpha_x) : a;
  const float b = lobe.alpha_x * scale;
  float t = glm::dot(o, i) - cos_o * cos_i;
  if (t > 0.0f) t /= std::fmax(std::fmax(cos_o, cos_i), 1e-20f);
  Rgb value(scale + b * t);
  if (!old) {
    const float mean_e = a * kPi + (2.0f * kPi - 5.6f) / 3.0f * b;
    const float missing =
        (1.0f - (a * kPi + b * oren_nayar_integral(cos_o))) * (1.0f - (a * kPi + b * oren_nayar_integral(cos_i)));
    // Blender takes the albedo squared here, on top of the weight: darker colours stay a little darker than the
    // paper's.
    const Rgb bounced = lobe.f0 * lobe.f0 * (mean_e / (1.0f - mean_e)) / (Rgb(1.0f) - lobe.f0 * (1.0f - mean_e));
    value += bounced * (std::fmax(missing, 0.0f) * kInvPi);
  }
  return value * cos_i;
}

/// Burley's diffuse lobe with retro-reflection (2015 course notes); alpha_x: perceptual roughness.
float burley(const Lobe& lobe, const Vec3& o, const Vec3& i, float cos_o, float cos_i) {
  const float fo = fifth(1.0f - cos_o), fi = fifth(1.0f - cos_i);
  const float rr = lobe.alpha_x * (1.0f + glm::dot(o, i));
  return kInvPi * cos_i * ((1.0f - 0.5f * fo) * (1.0f - 0.5f * fi) + rr * (fo + fi + fo * fi * (rr - 1.0f)));
}

float masking(const Lobe& lobe, const Vec3& o, const Vec3& i, float lambda_o) {
  if (lobe.distribution == Distribution::kGtr1) {  // fixed roughness of the masking, as its authors had it
    return 1.0f / ((1.0f + ggx_lambda(o, 0.0625f, 0.0625f)) * (1.0f + ggx_lambda(i, 0.0625f, 0.0625f)));
  }
  const float lambda_i = is_beckmann(lobe.distribution) ? beckmann_lambda(i, lobe.alpha_x, lobe.alpha_y)
                                                        : ggx_lambda(i, lobe.alpha_x, lobe.alpha_y);
  if (lobe.distribution == Distribution::kGgxSeparable || lobe.distribution == Distribution::kBeckmannSeparable)
    return 1.0f / ((1.0f + lambda_o) * (1.0f + lambda_i));
  return 1.0f / (1.0f + lambda_o + lambda_i);
}

/// Chance of reflection against refraction at a microfacet of glass.
float reflect_chance(const Lobe& lobe, const Rgb& reflected, Rgb& r, Rgb& t) {
  r = lobe.fresnel == Fresnel::kDielectric ? reflected * lobe.f0 : reflected;
  t = (Rgb(1.0f) - reflected) * lobe.f90;
  const float sum = mean(r) + mean(t);
  return sum > 0.0f ? mean(r) / sum : 0.0f;
}

Frame frame_of(const Lobe& lobe) {
  if (lobe.alpha_x == lobe.alpha_y) return Frame(lobe.normal);
  Vec3 t = lobe.tangent - lobe.normal * glm::dot(lobe.tangent, lobe.normal);
  const float length = glm::length(t);
  if (!(length > 1e-6f)) return Frame(lobe.normal);
  t /= length;
  return Frame(t, glm::cross(lobe.normal, t), lobe.normal);
}

LobeValue microfacet_value(const Lobe& lobe, const Vec3& outgoing, const Vec3& incoming, bool transmitted) {
  LobeValue result;
  const bool refraction = lobe.kind == LobeKind::kMicrofacetRefraction;
  if (is_delta(lobe) || (transmitted ? lobe.kind == LobeKind::kMicrofacetReflection : refraction)) return result;
  const Frame frame = frame_of(lobe);
  const Vec3 o = frame.to_local(outgoing), i = frame.to_local(incoming);
  if (o.z <= 0.0f || (transmitted ? i.z >= 0.0f : i.z <= 0.0f)) return result;
  Vec3 h = transmitted ? -(o + lobe.ior * i) : o + i;
  const float length = glm::length(h);
  if (!(length > 1e-8f)) return result;
  h /= length;
  if (h.z < 0.0f) h = -h;
  const float oh = glm::dot(o, h), ih = glm::dot(i, h);
  if (oh <= 0.0f || (transmitted && ih >= 0.0f)) return result;
  const bool beckmann = is_beckmann(lobe.distribution), gtr1 = lobe.distribution == Distribution::kGtr1;
  const float lambda_o =
      beckmann ? beckmann_lambda(o, lobe.alpha_x, lobe.alpha_y) : ggx_lambda(o, lobe.alpha_x, lobe.alpha_y);
  const float d = gtr1       ? gtr1_distribution(h.z, lobe.alpha_x)
                  : beckmann ? beckmann_distribution(h, lobe.alpha_x, lobe.alpha_y)
                             : ggx_distribution(h, lobe.alpha_x, lobe.alpha_y);
  const float jacobian = transmitted ? oh * sqr(lobe.ior) * -ih / sqr(oh + lobe.ior * ih) : 0.25f;
  const float common = d * jacobian / o.z;
  Rgb f = fresnel(lobe, oh);
  float chance = 1.0f;
  if (lobe.kind == LobeKind::kMicrofacetGlass) {
    Rgb r, t;
    chance = reflect_chance(lobe, f, r, t);
    if (transmitted) chance = 1.0f - chance;
    f = transmitted ? t : r;
  } else if (refraction) {
    f = lobe.fresnel == Fresnel::kNone ? lobe.f90 : (Rgb(1.0f) - f) * lobe.f90;
  }
  result.value = f * (common * masking(lobe, o, i, lambda_o));
  // Without visible normals the density is D cos: `common` holds jacobian × oh / o.z.
  result.density = chance * (gtr1 || beckmann ? common * h.z * o.z / oh : common / (1.0f + lambda_o));
  return result;
}

/// Value × cosine and density of one lobe, its weight left out. side: incoming over face normal, positive: reflected.
LobeValue lobe_value(const Lobe& lobe, const Vec3& face, const Vec3& o, const Vec3& i, bool transmitted) {
  LobeValue result;
  switch (lobe.kind) {
    case LobeKind::kLambert:
    case LobeKind::kOrenNayar:
    case LobeKind::kBurley:
    case LobeKind::kSheen:
    case LobeKind::kSheenV1: {
      const float cos_i = glm::dot(lobe.normal, i), cos_o = std::fmax(glm::dot(lobe.normal, o), 0.0f);
      if (transmitted || cos_i <= 0.0f) return result;
      if (lobe.kind == LobeKind::kSheen) {
        result.density = sheen_density(lobe, o, i);
        result.value = Rgb(result.density);
        return result;
      }
      result.density = cos_i * kInvPi;
      if (lobe.kind == LobeKind::kLambert) result.value = Rgb(result.density);
      if (lobe.kind == LobeKind::kOrenNayar) result.value = oren_nayar(lobe, o, i, cos_o, cos_i);
      if (lobe.kind == LobeKind::kBurley) result.value = Rgb(burley(lobe, o, i, cos_o, cos_i));
      if (lobe.kind == LobeKind::kSheenV1) {
        const Vec3 h = o + i;
        const float length = glm::length(h);
        result.value = Rgb(length > 1e-6f ? cos_i * fifth(saturate(1.0f - glm::dot(i, h) / length)) : 0.0f);
      }
      if (lobe.bumped)
        result.value *= lobe.kind == LobeKind::kSheenV1           ? bump_shadowing(face, lobe.normal, i)
                        : lobe.distribution == Distribution::kGgx ? bump_masking(lobe.tangent, lobe.normal, i)
                                                                  : bump_shadowing(lobe.tangent, lobe.normal, i);
      return result;
    }
    case LobeKind::kTranslucent: {
      const float cos_i = -glm::dot(lobe.normal, i);
      if (!transmitted || cos_i <= 0.0f) return result;
      result.density = cos_i * kInvPi;
      result.value = Rgb(result.density);
      return result;
    }
    default:
      return microfacet_value(lobe, o, i, transmitted);
  }
}

LobeClass pass_of(const Lobe& lobe, bool transmitted) {
  return lobe.kind == LobeKind::kMicrofacetGlass && !lobe.one_pass
             ? (transmitted ? LobeClass::kTransmission : LobeClass::kGlossy)
             : lobe.pass;
}

void add(BsdfValue& total, LobeClass pass, const Rgb& value) {
  if (pass == LobeClass::kDiffuse)
    total.diffuse += value;
  else if (pass == LobeClass::kGlossy)
    total.glossy += value;
  else
    total.transmission += value;
}

/// What sampling one lobe gave: direction, and for a delta the weight (Fresnel over the chance of the choice).
struct Choice {
  Vec3 direction{0.0f};
  Rgb delta_weight{0.0f};
  float chance = 1.0f;
  bool transmitted = false, delta = false, valid = false;
};

Choice sample_microfacet(const Lobe& lobe, const Vec3& outgoing, float u_lobe, const Vec2& u) {
  Choice choice;
  const Frame frame = frame_of(lobe);
  const Vec3 o = frame.to_local(outgoing);
  if (o.z <= 0.0f) return choice;
  choice.delta = is_delta(lobe);
  Vec3 h(0.0f, 0.0f, 1.0f);
  if (lobe.distribution == Distribution::kGtr1 && !choice.delta) {
    const float a2 = sqr(lobe.alpha_x), phi = 2.0f * kPi * u.x;
    const float c2 = a2 >= 1.0f ? u.y : (1.0f - std::pow(a2, 1.0f - u.y)) / (1.0f - a2);
    const float s = std::sqrt(saturate(1.0f - c2));
    h = {s * std::cos(phi), s * std::sin(phi), std::sqrt(saturate(c2))};
  } else if (!choice.delta && is_beckmann(lobe.distribution)) {
    h = beckmann_sample(lobe.alpha_x, lobe.alpha_y, u);
  } else if (!choice.delta) {
    h = ggx_sample(o, lobe.alpha_x, lobe.alpha_y, u);
  }
  const float oh = glm::dot(o, h);
  if (oh <= 0.0f) return choice;
  Rgb f = fresnel(lobe, oh);
  choice.transmitted = lobe.kind == LobeKind::kMicrofacetRefraction;
  choice.delta_weight = f;
  if (lobe.kind == LobeKind::kMicrofacetGlass) {
    Rgb r, t;
    const float chance = reflect_chance(lobe, f, r, t);
    choice.transmitted = u_lobe >= chance;
    choice.chance = choice.transmitted ? 1.0f - chance : chance;
    choice.delta_weight = choice.transmitted ? t : r;
  } else if (choice.transmitted) {
    choice.delta_weight = lobe.fresnel == Fresnel::kNone ? lobe.f90 : (Rgb(1.0f) - f) * lobe.f90;
  }
  Vec3 i;
  if (choice.transmitted) {
    const float inverse = 1.0f / lobe.ior;
    const float cos2 = 1.0f - sqr(inverse) * (1.0f - oh * oh);
    if (cos2 <= 0.0f) return choice;
    i = h * (inverse * oh - std::sqrt(cos2)) - o * inverse;
    if (i.z >= 0.0f) return choice;
  } else {
    i = h * (2.0f * oh) - o;
    if (i.z <= 0.0f) return choice;
  }
  choice.direction = glm::normalize(frame.to_world(i));
  choice.valid = true;
  return choice;
}

Choice sample_lobe(const Lobe& lobe, const Vec3& outgoing, float u_lobe, const Vec2& u) {
  Choice choice;
  switch (lobe.kind) {
    case LobeKind::kTranslucent:
      choice.direction = Frame(-lobe.normal).to_world(cosine_sample(u));
      choice.transmitted = choice.valid = true;
      return choice;
    case LobeKind::kSheen:
      choice.direction = sheen_sample(lobe, outgoing, u);
      choice.valid = glm::dot(choice.direction, lobe.normal) > 0.0f;
      return choice;
    case LobeKind::kLambert:
    case LobeKind::kOrenNayar:
    case LobeKind::kBurley:
    case LobeKind::kSheenV1:
      choice.direction = Frame(lobe.normal).to_world(cosine_sample(u));
      choice.valid = true;
      return choice;
    default:
      return sample_microfacet(lobe, outgoing, u_lobe, u);
  }
}

}  // namespace

Rgb fresnel_conductor(float cosine, const Rgb& n, const Rgb& k) {
  const float c2 = cosine * cosine;
  const Rgb both = n * n + k * k, twice = n * (2.0f * cosine);
  const Rgb parallel = (both * c2 - twice + 1.0f) / (both * c2 + twice + 1.0f);
  const Rgb perpendicular = (both - twice + c2) / (both + twice + c2);
  return 0.5f * (parallel + perpendicular);
}

namespace {

bool lambert_alone(const Surface& surface) {
  return surface.count == 1 && surface.lobes[0].kind == LobeKind::kLambert && !surface.lobes[0].bumped;
}

}  // namespace

template <>
BsdfValue evaluate<false>(const Surface& surface, const Vec3& face, const Vec3& outgoing, const Vec3& incoming) {
  if (lambert_alone(surface)) return evaluate<true>(surface, face, outgoing, incoming);
  BsdfValue total;
  const bool transmitted = glm::dot(face, incoming) < 0.0f;
  for (int k = 0; k < surface.count; ++k) {
    const Lobe& lobe = surface.lobes[k];
    const LobeValue one = lobe_value(lobe, face, outgoing, incoming, transmitted);
    if (!(one.density > 0.0f)) continue;
    total.density += lobe.sampling_weight * one.density;
    add(total, pass_of(lobe, transmitted), lobe.weight * one.value);
  }
  return total;
}

template <>
BsdfSample sample<false>(const Surface& surface, const Vec3& face, const Vec3& outgoing, float u_lobe, const Vec2& u) {
  if (lambert_alone(surface)) return sample<true>(surface, face, outgoing, u_lobe, u);
  BsdfSample result;
  int chosen = 0;
  for (; chosen < surface.count - 1 && u_lobe >= surface.lobes[chosen].sampling_weight; ++chosen) {
    u_lobe -= surface.lobes[chosen].sampling_weight;
  }
  if (chosen >= surface.count) return result;
  const Lobe& lobe = surface.lobes[chosen];
  if (!(lobe.sampling_weight > 0.0f)) return result;
  const Choice choice = sample_lobe(lobe, outgoing, std::fmin(u_lobe / lobe.sampling_weight, 0.99999994f), u);
  const float side = glm::dot(face, choice.direction);
  if (!choice.valid || (choice.transmitted ? side >= 0.0f : side <= 0.0f)) return result;
  result.direction = choice.direction;
  result.transmitted = choice.transmitted;
  result.pass = pass_of(lobe, choice.transmitted);
  result.delta = choice.delta;
  if (choice.delta) {
    result.roughness = 0.0f;
    result.value.density = lobe.sampling_weight * choice.chance;
    add(result.value, result.pass, lobe.weight * choice.delta_weight);
    result.valid = result.value.density > 0.0f;
    return result;
  }
  if (lobe.kind >= LobeKind::kMicrofacetReflection)
    result.roughness = std::sqrt(std::sqrt(lobe.alpha_x * lobe.alpha_y));
  result.value = evaluate<false>(surface, face, outgoing, choice.direction);
  result.valid = result.value.density > 0.0f;
  return result;
}

namespace {

/// The Fresnel term averaged over the microfacets that are seen, as Blender's colour passes have it.
Rgb mean_fresnel(const Lobe& lobe, float cosine) {
  if (lobe.fresnel == Fresnel::kNone) return Rgb(1.0f);
  if (lobe.kind == LobeKind::kMicrofacetReflection && lobe.distribution == Distribution::kGgxSeparable)
    return Rgb(1.0f);
  if (lobe.fresnel == Fresnel::kConductor || lobe.distribution != Distribution::kGgx) return fresnel(lobe, cosine);
  const float roughness = std::sqrt(std::sqrt(lobe.alpha_x * lobe.alpha_y));
  if (lobe.fresnel == Fresnel::kF82) return lerp(lobe.f0, Rgb(1.0f), schlick_share(cosine, roughness, 1.5f));
  if (lobe.ior < 1.0f) return fresnel(lobe, cosine);
  const Rgb start = lobe.fresnel == Fresnel::kDielectric ? Rgb(f0_from_ior(lobe.ior)) : lobe.f0;
  const Rgb end = lobe.kind == LobeKind::kMicrofacetReflection ? lobe.f90 : Rgb(1.0f);
  return lerp(start, end, schlick_share(cosine, roughness, lobe.ior));
}

}  // namespace

SurfaceAlbedo albedo(const Surface& surface, const Vec3& outgoing) {
  SurfaceAlbedo result;
  for (int k = 0; k < surface.count; ++k) {
    const Lobe& lobe = surface.lobes[k];
    if (lobe.kind < LobeKind::kMicrofacetReflection) {
      result.diffuse += lobe.weight;
      continue;
    }
    const Rgb weight = lobe.weight / lobe.energy;
    const Rgb f = mean_fresnel(lobe, saturate(glm::dot(lobe.normal, outgoing)));
    if (lobe.kind == LobeKind::kMicrofacetReflection) {
      result.glossy += weight * f;
    } else if (lobe.kind == LobeKind::kMicrofacetRefraction) {
      result.transmission += weight * (lobe.fresnel == Fresnel::kNone ? lobe.f90 : (Rgb(1.0f) - f) * lobe.f90);
    } else {
      Rgb r, t;
      if (lobe.one_pass) {
        result.transmission += weight * lobe.f90;
        continue;
      }
      reflect_chance(lobe, f, r, t);
      result.glossy += weight * r;
      reflect_chance(lobe, fresnel(lobe, saturate(glm::dot(lobe.normal, outgoing))), r, t);
      result.transmission += weight * t;
    }
  }
  return result;
}

}  // namespace afterglow
