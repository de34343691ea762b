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
  kSheen,
  kMicrofacetReflection,
  kMicrofacetGlass,
  kMicrofacetRefraction,
};

/// One lobe. weight: throughput factor with all layering applied; the rest by kind (materials/lobes.h).
struct Lobe {
  LobeKind kind = LobeKind::kLambert;
  LobeClass pass = LobeClass::kDiffuse;
  uint8_t fresnel = 0;  // which Fresnel term a microfacet lobe takes (materials/lobes.h)
  uint8_t distribution = 0;
  float sampling_weight = 0.0f;  // relative; sums to 1 over a Surface
  Rgb weight{0.0f};
  Vec3 normal{0, 0, 1};
  Vec3 tangent{1, 0, 0};
  float alpha_x = 0.0f, alpha_y = 0.0f;  // squared roughness; below kMirrorAlpha the lobe is a delta
  float ior = 1.5f;                      // inside over outside as the ray meets it
  Rgb f0{0.0f}, f90{1.0f};               // Fresnel end points or edge tint
  float energy = 1.0f;                   // multiple-scattering compensation (Turquin 2019)
};

struct Surface {
  static constexpr int kMaxLobes = 8;
  int count = 0;
  uint32_t effects = 0;  // bits of Effect that its lobes need
  Rgb emission{0.0f};
  Rgb transparency{0.0f};  // share of light that goes straight through
  float holdout = 0.0f;
  Lobe lobes[kMaxLobes];
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

}  // namespace afterglow
