// SPDX-License-Identifier: GPL-3.0-or-later
// Lobes from the inputs of shader nodes: layering, Fresnel set-up, compensation and sampling weights.
#pragma once

#include "materials/microfacet.h"
#include "materials/program.h"

namespace afterglow {

inline constexpr float kLeastWeight = 1e-5f;

/// Adds a lobe; equal diffuse ones are merged. full: the faintest makes room and its light is lost.
void push_lobe(Surface&, const Lobe&);
/// The normal of a closure: the point's when none is linked.
Vec3 closure_normal(const Operands&, int k, const SurfacePoint&, bool& bumped);
/// Bends a normal so far that the mirror direction leaves the surface (for microfacets on bent normals).
Vec3 reflecting_normal(const Vec3& normal, const Vec3& face_normal, const Vec3& outgoing);
/// Lets `lobe` return what a single bounce between microfacets loses. mean_fresnel: the Fresnel term's average.
void compensate(Lobe&, const Vec3& outgoing, const Rgb& mean_fresnel);
void add_principled(const Operands&, const HitContext&, Surface&);
void add_principled_v1(const Operands&, const HitContext&, Surface&);
/// alpha_x, alpha_y and the tangent from roughness and anisotropy. rotation: turns.
void set_anisotropy(Lobe&, float roughness, float anisotropy, float rotation, const Vec3& tangent, bool principled);
/// Tangent along the active UV map's u, or around z of the generated coordinates.
Vec3 default_tangent(const HitContext&);

/// Principled's operands, in this order, after the weight.
enum PrincipledInput {
  kWeight,
  kBaseColor,
  kMetallicIn,
  kRoughness,
  kIor,
  kAlpha,
  kNormalIn,
  kDiffuseRoughness,
  kSpecularLevel,
  kSpecularTint,
  kAnisotropic,
  kAnisotropicRotation,
  kTangentIn,
  kTransmissionWeight,
  kTransmissionRoughness,
  kCoatWeight,
  kCoatRoughness,
  kCoatIor,
  kCoatTint,
  kCoatNormal,
  kSheenWeight,
  kSheenRoughness,
  kSheenTint,
  kEmissionColor,
  kEmissionStrength,
  kPrincipledInputs,
  kParamMulti = kPrincipledInputs,  // parameter: compensation
  kParamVersion,
};

}  // namespace afterglow
