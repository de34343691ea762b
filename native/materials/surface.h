// SPDX-License-Identifier: GPL-3.0-or-later
// What a material is at one hit: a few lobes, emission and transparency. Kernels evaluate, sample and ask densities of
// a Surface and never see node programs. Lobes, not surfaces, are diffuse: caches answer the diffuse ones, rays go on
// through the others.
#pragma once

#include "base/math.h"

namespace afterglow {

/// How light passes count a lobe (as Blender's: translucent counts as diffuse, glass reflection as glossy).
enum class LobeClass : uint8_t { kDiffuse, kGlossy, kTransmission };

enum class LobeKind : uint8_t {
  kLambert,
  kOrenNayar,
  kTranslucent,
  kBurley,  // Principled's diffuse before Blender 4.0
  kSheen,
  kSheenV1,  // Principled's sheen before Blender 4.0
  kMicrofacetReflection,
  kMicrofacetGlass,
  kMicrofacetRefraction,
};

/// Which Fresnel term a microfacet lobe takes, and what f0 and f90 mean to it. In a glass lobe f90 is always the tint
/// of what goes through, and the reflected end point is 1.
enum class Fresnel : uint8_t {
  kNone,        // 1
  kDielectric,  // exact, unpolarised, from ior; glass: reflection tinted by f0
  kSchlick,     // from f0 to f90 along the exact curve of ior
  kF82,         // f0, and f90 = the factor B of the Lazanyi term
  kConductor,   // f0 = index of refraction, f90 = extinction
};

/// Lobe::distribution: how masking and the distribution of normals are taken.
enum class Distribution : uint8_t {
  kGgx,           // height-correlated Smith
  kGgxSeparable,  // masking and shadowing apart, as Blender before 4.0
  kBeckmann,
  kBeckmannSeparable,
  kGtr1,  // clearcoat before 4.0
};

inline constexpr float kMirrorAlpha = 7e-4f;  // below: a delta

/// One lobe. weight: throughput factor with all layering applied; the rest by kind (enums above).
struct alignas(16) Lobe {
  LobeKind kind = LobeKind::kLambert;
  LobeClass pass = LobeClass::kDiffuse;
  Fresnel fresnel = Fresnel::kNone;
  Distribution distribution = Distribution::kGgx;
  bool one_pass = false;         // glass that counts as transmission whole: multiple scattering before Blender 4.0
  bool bumped = false;           // its normal comes from a map or a bump: diffuse light is shadowed smoothly
  float sampling_weight = 0.0f;  // relative; sums to 1 over a Surface
  Rgb weight{0.0f};
  Vec3 normal{0, 0, 1};
  Vec3 tangent{1, 0, 0};
  float alpha_x = 0.0f, alpha_y = 0.0f;  // squared roughness; below kMirrorAlpha the lobe is a delta
  float ior = 1.5f;                      // inside over outside as the ray meets it
  Rgb f0{0.0f}, f90{1.0f};               // Fresnel end points or edge tint
  float energy =
      1.0f;  // share of the weight that compensates for multiple scattering (Turquin 2019): not of the albedo
};

struct Surface {
  static constexpr int kMaxLobes = 16;
  int count = 0;
  uint32_t effects = 0;  // bits of Effect that its lobes need
  Rgb emission{0.0f};
  Rgb transparency{0.0f};  // share of light that goes straight through
  float holdout = 0.0f;
  bool needs_frame = false;  // folded: lobe normals are yet to be set from the point
  union {                    // only the first `count` are alive; the rest costs nothing
    Lobe lobes[kMaxLobes];
  };
  Surface() {}
  Surface(const Surface& other) { *this = other; }
  Surface& operator=(const Surface& other) {
    count = other.count, effects = other.effects, emission = other.emission, transparency = other.transparency;
    holdout = other.holdout, needs_frame = other.needs_frame;
    for (int i = 0; i < count; ++i) lobes[i] = other.lobes[i];
    return *this;
  }
  void clear() { count = 0, effects = 0, emission = transparency = Rgb(0.0f), holdout = 0.0f, needs_frame = false; }
};

/// BSDF × |cos| by pass class, and the solid-angle density with which sample() would choose the direction.
struct BsdfValue {
  Rgb diffuse{0.0f}, glossy{0.0f}, transmission{0.0f};
  float density = 0.0f;
  Rgb total() const { return diffuse + glossy + transmission; }
};

struct BsdfSample {
  Vec3 direction{0.0f};
  BsdfValue value;  // delta: value and density hold the discrete weights
  LobeClass pass = LobeClass::kDiffuse;
  bool delta = false, transmitted = false, valid = false;
  float roughness = 1.0f;  // of the chosen lobe, for caches and filters
};

/// What the path so far means to materials: Light Path nodes, caustics switches.
struct PathContext {
  enum Kind : uint32_t {
    kCamera = 1,
    kShadow = 2,
    kDiffuse = 4,
    kGlossy = 8,
    kSingular = 16,
    kReflection = 32,
    kTransmission = 64
  };
  uint32_t kind = kCamera;
  uint16_t depth = 0, diffuse_depth = 0, glossy_depth = 0, transmission_depth = 0, transparent_depth = 0;
  float ray_length = 0.0f;
  bool drop_glossy = false;  // caustics off after a diffuse bounce: glossy lobes are left out
  bool drop_refractive = false;
  float footprint = 0.0f;  // how far a pixel's neighbour lies from the point, across the path; 0: unknown
};

/// Lambert alone: the kernel of scenes whose Effects name nothing else.
template <bool kDiffuseOnly>
BsdfValue evaluate(const Surface&, const Vec3& face_normal, const Vec3& outgoing, const Vec3& incoming);
template <bool kDiffuseOnly>
BsdfSample sample(const Surface&, const Vec3& face_normal, const Vec3& outgoing, float u_lobe, const Vec2& u);

/// Directional albedo of the lobes by class, for the colour passes and denoisers.
struct SurfaceAlbedo {
  Rgb diffuse{0.0f}, glossy{0.0f}, transmission{0.0f};
};
SurfaceAlbedo albedo(const Surface&, const Vec3& outgoing);

template <>
BsdfValue evaluate<false>(const Surface&, const Vec3& face_normal, const Vec3& outgoing, const Vec3& incoming);
template <>
BsdfSample sample<false>(const Surface&, const Vec3& face_normal, const Vec3& outgoing, float u_lobe, const Vec2& u);

/// Emission and one Lambert lobe, or none: all that those need to know of a material who know nothing else.
struct PlainMaterial {
  Rgb albedo{0.0f}, emission{0.0f};
  bool plain = false;     // in a table: the material is so everywhere; else the above means nothing
  bool scatters = false;  // has the lobe
};

struct LambertSurface {
  const PlainMaterial& material;
  const Vec3& normal;
  const Rgb& emission = material.emission;
};

/// Density of a direction; times the albedo, it is BSDF × cosine. False: the direction does not leave the surface.
inline bool lambert_density(const Vec3& normal, const Vec3& face_normal, const Vec3& incoming, float& density) {
  const float cosine = glm::dot(normal, incoming);
  if (cosine <= 0.0f || glm::dot(face_normal, incoming) <= 0.0f) return false;
  density = cosine * kInvPi;
  return true;
}

/// Chooses a direction. False: it does not leave the surface.
inline bool sample_lambert(const Vec3& normal, const Vec3& face_normal, const Vec2& u, Vec3& direction,
                           float& density) {
  const float radius = std::sqrt(u.x), phi = 2.0f * kPi * u.y;
  const float z = std::sqrt(std::fmax(0.0f, 1.0f - u.x));
  direction = Frame(normal).to_world({radius * std::cos(phi), radius * std::sin(phi), z});
  if (z <= 0.0f || glm::dot(face_normal, direction) <= 0.0f) return false;
  density = z * kInvPi;
  return true;
}

template <>
inline BsdfValue evaluate<true>(const Surface& surface, const Vec3& face_normal, const Vec3&, const Vec3& incoming) {
  BsdfValue value;
  if (surface.count == 0) return value;
  if (lambert_density(surface.lobes[0].normal, face_normal, incoming, value.density))
    value.diffuse = surface.lobes[0].weight * value.density;
  return value;
}

template <>
inline BsdfSample sample<true>(const Surface& surface, const Vec3& face_normal, const Vec3&, float, const Vec2& u) {
  BsdfSample result;
  if (surface.count == 0) return result;
  result.valid = sample_lambert(surface.lobes[0].normal, face_normal, u, result.direction, result.value.density);
  if (result.valid) result.value.diffuse = surface.lobes[0].weight * result.value.density;
  return result;
}

}  // namespace afterglow
