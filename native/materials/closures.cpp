// SPDX-License-Identifier: GPL-3.0-or-later
// Lobes of the single shader nodes, as Blender's users know them: roughness is squared to alpha, the index of
// refraction turns over at a back face, glossy and refracting lobes are left out where the path's caustics are off.
#include "materials/closures.h"

#include "materials/albedo_tables.h"
#include "materials/sheen.h"
#include "scene/effects.h"

namespace afterglow {

namespace {

constexpr float kMostWeight = 1e10f;  // above, products of lobes would overflow

/// Nothing that is no number, or so large that it soon would be none.
bool usable(const Lobe& lobe) {
  const float sum = lobe.weight.x + lobe.weight.y + lobe.weight.z;
  const float shape = lobe.alpha_x + lobe.alpha_y + lobe.ior + lobe.f0.x + lobe.f0.y + lobe.f0.z + lobe.f90.x +
                      lobe.f90.y + lobe.f90.z + lobe.sampling_weight + lobe.normal.x + lobe.tangent.x;
  return max_component(lobe.weight) > kLeastWeight && sum < kMostWeight && std::fabs(shape) < kMostWeight &&
         std::isfinite(lobe.energy);
}

}  // namespace

void push_lobe(Surface& surface, const Lobe& lobe) {
  if (!usable(lobe)) return;
  if (lobe.kind == LobeKind::kLambert || lobe.kind == LobeKind::kTranslucent) {
    for (int k = 0; k < surface.count; ++k) {
      Lobe& other = surface.lobes[k];
      if (other.kind != lobe.kind || other.normal != lobe.normal) continue;
      other.weight += lobe.weight;
      other.sampling_weight += lobe.sampling_weight;
      return;
    }
  }
  if (lobe.kind != LobeKind::kLambert) surface.effects |= kGlossy;
  if (lobe.kind == LobeKind::kTranslucent || lobe.kind >= LobeKind::kMicrofacetGlass) surface.effects |= kTransmission;
  if (surface.count < Surface::kMaxLobes) {
    surface.lobes[surface.count++] = lobe;
    return;
  }
  int faintest = 0;
  for (int k = 1; k < surface.count; ++k) {
    if (surface.lobes[k].sampling_weight < surface.lobes[faintest].sampling_weight) faintest = k;
  }
  if (surface.lobes[faintest].sampling_weight < lobe.sampling_weight) surface.lobes[faintest] = lobe;
}

Vec3 closure_normal(const Operands& in, int k, const SurfacePoint& point, bool& bumped) {
  bumped = false;
  if (!in.given(k)) return point.normal;
  const Vec3& n = in.v(k);
  const float length = glm::length(n);
  if (!(length > 1e-6f) || !std::isfinite(length)) return point.normal;
  bumped = true;
  return n / length;
}

Vec3 reflecting_normal(const Vec3& n, const Vec3& face, const Vec3& o) {
  const float cos_o = glm::dot(face, o), least = std::fmin(0.9f * cos_o, 0.01f);
  if (2.0f * glm::dot(n, o) * glm::dot(n, face) - cos_o >= least) return n;
  // In the plane of n and face: 2 (n'·o)(n'·face) − o·face = least, solved for the angle of n' from face.
  const Vec3 side = n - face * glm::dot(n, face);
  const float length = glm::length(side);
  if (!(length > 1e-6f)) return face;
  const Vec3 x = side / length;
  const float ox = glm::dot(o, x), size = std::sqrt(ox * ox + cos_o * cos_o);
  if (!(size > 1e-6f)) return face;
  const float angle = 0.5f * (std::atan2(ox, cos_o) + std::acos(std::fmin(std::fmax(least / size, -1.0f), 1.0f)));
  return face * std::cos(angle) + x * std::sin(angle);
}

void compensate(Lobe& lobe, const Vec3& outgoing, const Rgb& mean_fresnel) {
  const float cosine = saturate(glm::dot(lobe.normal, outgoing));
  const float roughness = std::sqrt(std::sqrt(lobe.alpha_x * lobe.alpha_y));
  const bool glass = lobe.kind == LobeKind::kMicrofacetGlass || lobe.kind == LobeKind::kMicrofacetRefraction;
  const float e = std::fmax(glass ? glass_albedo(cosine, roughness, lobe.ior) : ggx_albedo(cosine, roughness), 0.05f);
  const float mean_e = glass ? glass_mean_albedo(roughness, lobe.ior) : ggx_mean_albedo(roughness);
  const Rgb bounced = mean_fresnel * mean_e / (Rgb(1.0f) - mean_fresnel * (1.0f - mean_e));
  lobe.energy = 1.0f / e;
  lobe.weight *= Rgb(1.0f) + bounced * ((1.0f - e) / e);
}

void set_anisotropy(Lobe& lobe, float roughness, float anisotropy, float rotation, const Vec3& tangent,
                    bool principled) {
  const float alpha = sqr(saturate(roughness));
  lobe.alpha_x = lobe.alpha_y = alpha;
  if (principled) {
    anisotropy = saturate(anisotropy);
    if (anisotropy < 1e-4f) return;
    const float aspect = std::sqrt(1.0f - 0.9f * anisotropy);
    lobe.alpha_x = alpha / aspect, lobe.alpha_y = alpha * aspect;
  } else {
    anisotropy = std::fmin(std::fmax(anisotropy, -0.99f), 0.99f);
    if (std::fabs(anisotropy) < 1e-4f) return;
    if (anisotropy < 0.0f)
      lobe.alpha_x = alpha / (1.0f + anisotropy), lobe.alpha_y = alpha * (1.0f + anisotropy);
    else
      lobe.alpha_x = alpha * (1.0f - anisotropy), lobe.alpha_y = alpha / (1.0f - anisotropy);
  }
  lobe.alpha_x = std::fmin(lobe.alpha_x, 1.0f), lobe.alpha_y = std::fmin(lobe.alpha_y, 1.0f);
  lobe.tangent = tangent;
  if (rotation != 0.0f) {  // Rodrigues, about the lobe's normal
    const float angle = 2.0f * kPi * rotation, c = std::cos(angle), s = std::sin(angle);
    const Vec3& n = lobe.normal;
    lobe.tangent = tangent * c + glm::cross(n, tangent) * s + n * (glm::dot(n, tangent) * (1.0f - c));
  }
}

namespace {

Rgb positive(const Rgb& c) { return glm::max(c, Rgb(0.0f)); }

struct Common {
  float weight;
  Rgb color;
  const SurfacePoint& point;
  const HitContext& hit;
  Surface& surface;
};

void add_diffuse(const Operands& in, const Common& c, LobeKind kind) {
  Lobe lobe;
  lobe.kind = kind;
  lobe.normal = closure_normal(in, 2, c.point, lobe.bumped);
  lobe.weight = c.color * c.weight;
  lobe.sampling_weight = mean(lobe.weight);
  if (kind == LobeKind::kLambert && in.given(3) && in.f(3) > 1e-5f) {
    lobe.kind = LobeKind::kOrenNayar;
    lobe.alpha_x = saturate(in.f(3));
    lobe.alpha_y = in.u(4) == 1 ? 1.0f : 0.0f;
    lobe.f0 = saturate(c.color);
  }
  push_lobe(c.surface, lobe);
}

void set_distribution(Lobe& lobe, uint32_t which, uint32_t version) {
  if (which == 3)
    lobe.distribution = version == 1 ? Distribution::kBeckmannSeparable : Distribution::kBeckmann;
  else if (version == 1 && which != 1)
    lobe.distribution = Distribution::kGgxSeparable;
}

/// weight, colour, normal, roughness, anisotropy, rotation; distribution, version
void add_glossy(const Operands& in, const Common& c) {
  if (c.hit.path && c.hit.path->drop_glossy) return;
  Lobe lobe;
  lobe.kind = LobeKind::kMicrofacetReflection;
  lobe.pass = LobeClass::kGlossy;
  lobe.normal = closure_normal(in, 2, c.point, lobe.bumped);
  lobe.normal = reflecting_normal(lobe.normal, c.point.face_normal, c.point.outgoing);
  lobe.weight = c.color * c.weight;
  const float roughness = in.u(7) == 2 ? 0.0f : in.f(3);
  set_anisotropy(lobe, roughness, in.f(4), in.f(5), in.given(6) ? in.v(6) : Vec3(1, 0, 0), false);
  if (lobe.alpha_x != lobe.alpha_y && !in.given(6)) {
    set_anisotropy(lobe, roughness, in.f(4), in.f(5), default_tangent(c.hit), false);
  }
  set_distribution(lobe, in.u(7), in.u(8));
  if (in.u(7) == 1 && roughness > 0.0f) compensate(lobe, c.point.outgoing, saturate(c.color));
  lobe.sampling_weight = mean(lobe.weight);
  push_lobe(c.surface, lobe);
}

/// Rough glass before Blender 4.0: reflection and refraction apart, shared by the Fresnel of the smooth surface.
void split_glass(Surface& surface, Lobe lobe, const Vec3& outgoing) {
  const float share = fresnel_dielectric(saturate(glm::dot(lobe.normal, outgoing)), lobe.ior);
  const Rgb weight = lobe.weight, reflected = lobe.f0, refracted = lobe.f90;
  lobe.fresnel = Fresnel::kNone;
  lobe.f0 = lobe.f90 = Rgb(1.0f);
  for (const bool through : {false, true}) {
    lobe.kind = through ? LobeKind::kMicrofacetRefraction : LobeKind::kMicrofacetReflection;
    lobe.pass = through ? LobeClass::kTransmission : LobeClass::kGlossy;
    lobe.weight = weight * (through ? refracted * (1.0f - share) : reflected * share);
    lobe.sampling_weight = mean(lobe.weight);
    if (lobe.sampling_weight > 0.0f) push_lobe(surface, lobe);
  }
}

/// weight, colour, normal, roughness, ior; distribution, version
void add_glass(const Operands& in, const Common& c, bool refraction_only) {
  const bool no_reflection = refraction_only || (c.hit.path && c.hit.path->drop_glossy);
  const bool no_refraction = c.hit.path && (refraction_only ? c.hit.path->drop_glossy || c.hit.path->drop_refractive
                                                            : c.hit.path->drop_refractive);
  if (no_reflection && no_refraction) return;
  Lobe lobe;
  lobe.kind = refraction_only ? LobeKind::kMicrofacetRefraction : LobeKind::kMicrofacetGlass;
  lobe.pass = LobeClass::kTransmission;
  lobe.normal = closure_normal(in, 2, c.point, lobe.bumped);
  if (!refraction_only) lobe.normal = reflecting_normal(lobe.normal, c.point.face_normal, c.point.outgoing);
  const float roughness = in.u(5) == 2 ? 0.0f : in.f(3);
  lobe.alpha_x = lobe.alpha_y = sqr(saturate(roughness));
  const float ior = std::fmin(std::fmax(in.f(4), 1e-5f), 1e5f);
  lobe.ior = c.point.backfacing ? 1.0f / ior : ior;
  if (std::fabs(lobe.ior - 1.0f) < 1e-4f) lobe.alpha_x = lobe.alpha_y = 0.0f;  // nothing bends: straight on
  lobe.weight = Rgb(c.weight);
  if (refraction_only) {
    lobe.f90 = c.color;
  } else {
    lobe.fresnel = Fresnel::kDielectric;
    lobe.f0 = no_reflection ? Rgb(0.0f) : c.color;
    lobe.f90 = no_refraction ? Rgb(0.0f) : c.color;
    if (in.u(5) == 1 && lobe.alpha_x > 0.0f) compensate(lobe, c.point.outgoing, saturate(c.color));
  }
  set_distribution(lobe, in.u(5), in.u(6));
  lobe.one_pass = in.u(5) == 1 && in.u(6) == 1;
  lobe.sampling_weight = mean(lobe.weight) * std::fmax(mean(c.color), 1e-3f);
  if (lobe.kind == LobeKind::kMicrofacetGlass && in.u(6) == 1 && in.u(5) != 1 && lobe.alpha_x > 0.0f)
    return split_glass(c.surface, lobe, c.point.outgoing);
  push_lobe(c.surface, lobe);
}

/// weight, base colour, normal, roughness, anisotropy, rotation, tangent, edge tint, n, k; distribution, physical
void add_metallic(const Operands& in, const Common& c) {
  if (c.hit.path && c.hit.path->drop_glossy) return;
  Lobe lobe;
  lobe.kind = LobeKind::kMicrofacetReflection;
  lobe.pass = LobeClass::kGlossy;
  lobe.normal = closure_normal(in, 2, c.point, lobe.bumped);
  lobe.normal = reflecting_normal(lobe.normal, c.point.face_normal, c.point.outgoing);
  lobe.weight = Rgb(c.weight);
  set_anisotropy(lobe, in.f(3), in.f(4), in.f(5), in.given(6) ? in.v(6) : default_tangent(c.hit), true);
  Rgb mean_fresnel;
  if (in.u(11)) {
    lobe.fresnel = Fresnel::kConductor;
    lobe.f0 = positive(in.v(8)), lobe.f90 = positive(in.v(9));
    mean_fresnel = fresnel_conductor(0.6f, lobe.f0, lobe.f90);
  } else {
    lobe.fresnel = Fresnel::kF82;
    lobe.f0 = saturate(c.color);
    lobe.f90 = f82_factor(lobe.f0, saturate(in.v(7)));
    mean_fresnel = saturate(lerp(lobe.f0, Rgb(1.0f), 1.0f / 21.0f) - lobe.f90 * (1.0f / 126.0f));
  }
  lobe.sampling_weight = mean(lobe.weight * fresnel(lobe, saturate(glm::dot(lobe.normal, c.point.outgoing))));
  set_distribution(lobe, in.u(10), 2);
  if (in.u(10) == 1) compensate(lobe, c.point.outgoing, mean_fresnel);
  push_lobe(c.surface, lobe);
}

void add_sheen(const Operands& in, const Common& c) {
  Lobe lobe;
  lobe.kind = LobeKind::kSheen;
  lobe.normal = closure_normal(in, 2, c.point, lobe.bumped);
  const float cosine = glm::dot(lobe.normal, c.point.outgoing);
  if (cosine <= 0.0f) return;
  sheen_setup(lobe, cosine, in.f(3));
  lobe.weight = c.color * (c.weight * sheen_albedo(cosine, in.f(3)));
  lobe.sampling_weight = mean(lobe.weight);
  push_lobe(c.surface, lobe);
}

}  // namespace

void add_closure(Op op, const Operands& in, const HitContext& hit, Surface& surface) {
  const float weight = in.f(0);
  if (!(weight > kLeastWeight && weight < kMostWeight)) return;
  const SurfacePoint& point = *hit.points[0];
  if (op == Op::kPrincipled) {
    if (in.u(kParamVersion) == 1)
      add_principled_v1(in, hit, surface);
    else
      add_principled(in, hit, surface);
    return;
  }
  if (op == Op::kHoldout) {
    surface.holdout += weight;
    return;
  }
  const Rgb color = positive(in.v(1));
  if (!is_finite(color)) return;
  const Common common{weight, color, point, hit, surface};
  switch (op) {
    case Op::kDiffuse:
      return add_diffuse(in, common, LobeKind::kLambert);
    case Op::kTranslucent:
      return add_diffuse(in, common, LobeKind::kTranslucent);
    case Op::kGlossy:
      return add_glossy(in, common);
    case Op::kGlass:
      return add_glass(in, common, false);
    case Op::kRefraction:
      return add_glass(in, common, true);
    case Op::kMetallic:
      return add_metallic(in, common);
    case Op::kSheenLobe:
      return add_sheen(in, common);
    case Op::kTransparent:
      if (max_component(color) * weight < kMostWeight) surface.transparency += color * weight;
      return;
    case Op::kEmission: {
      const float strength = in.f(2);
      const Rgb light = color * (weight * strength);
      if (strength > 0.0f && is_finite(light)) surface.emission += light;
      return;
    }
    default:
      return;
  }
}

}  // namespace afterglow
