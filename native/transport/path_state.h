// SPDX-License-Identifier: GPL-3.0-or-later
// What a walk carries from vertex to vertex, and the rules that end it: bounce limits as Blender's users know them,
// Russian roulette, ray kinds. Small pure functions, apart from the walk that uses them.
#pragma once

#include "materials/surface.h"
#include "rays/surface_point.h"
#include "scene/tables.h"

namespace afterglow {

/// Limits of one walk. A limit of n lets n scatterings of its kind be followed by light that is looked for; light that
/// the last ray runs into still counts.
struct WalkLimits {
  uint32_t max_bounces = 12, diffuse = 4, glossy = 4, transmission = 12, transparent = 8;
  bool caustics_reflective = true, caustics_refractive = true;
};

/// What a kernel is compiled for; without a bit, its code is not there.
enum KernelFeature : uint32_t {
  kFeatureLobes = 1,     // any lobe but diffuse reflection
  kFeatureStraight = 2,  // transparency, ray visibility, holdouts, local view
  kFeatureShapes = 4,    // lights that rays run into without a mesh
  kFeaturePasses = 8,    // a film that keeps more than the picture
  kKernelCount = 16,
};

struct RayCounts {
  uint64_t camera = 0, bounce = 0, shadow = 0, dropped = 0;
  RayCounts& operator+=(const RayCounts& o) {
    camera += o.camera, bounce += o.bounce, shadow += o.shadow, dropped += o.dropped;
    return *this;
  }
};

struct PathState {
  Ray ray;
  Rgb throughput{1.0f};
  PathContext context;   // depth: scatterings so far, straight passages not counted
  float density = 0.0f;  // of the last scattering's direction; 0: certain to be met by nothing else, no weighting
  Vec3 position{0.0f};   // of the last scattering, where lights were asked
  Vec3 light_normal{0.0f};
  float pixel_angle = 0.0f;  // between the rays of neighbouring pixels; the footprint grows by it
  bool last = false;         // limits reached: only light that is run into still counts
};

/// Moves the diffuse lobes to a surface of their own; sampling weights of what stays sum to 1 again.
inline void split_diffuse(Surface& surface, Surface& diffuse) {
  int rest = 0;
  float sum = 0.0f;
  for (int i = 0; i < surface.count; ++i) {
    if (surface.lobes[i].kind < LobeKind::kMicrofacetReflection) {
      diffuse.lobes[diffuse.count++] = surface.lobes[i];
    } else {
      sum += surface.lobes[i].sampling_weight;
      if (rest != i) surface.lobes[rest] = surface.lobes[i];
      rest++;
    }
  }
  surface.count = rest;
  const float scale = sum > 0.0f ? 1.0f / sum : 0.0f;
  for (int i = 0; i < rest; ++i) surface.lobes[i].sampling_weight *= scale;
}

/// Which rays an object shows itself to, by the kind of the ray that arrives.
inline uint32_t visibility_of(uint32_t kind) {
  uint32_t mask = 0;
  if (kind & PathContext::kCamera) mask |= kVisibleCamera;
  if (kind & PathContext::kDiffuse) mask |= kVisibleDiffuse;
  if (kind & PathContext::kGlossy) mask |= kVisibleGlossy;
  if (kind & PathContext::kTransmission) mask |= kVisibleTransmission;
  return mask;
}

/// Counts one scattering and says whether it was the last one allowed.
inline bool count_bounce(PathContext& c, const WalkLimits& limits, LobeClass pass, bool transmitted, bool delta) {
  c.depth++;
  bool last = c.depth > limits.max_bounces;
  uint32_t kind = transmitted ? PathContext::kTransmission : PathContext::kReflection;
  if (transmitted) {
    last |= ++c.transmission_depth > limits.transmission;
  } else if (pass == LobeClass::kDiffuse) {
    last |= ++c.diffuse_depth > limits.diffuse;
  } else {
    last |= ++c.glossy_depth > limits.glossy;
  }
  if (pass == LobeClass::kDiffuse)
    kind |= PathContext::kDiffuse;
  else
    kind |= PathContext::kGlossy | (delta ? uint32_t(PathContext::kSingular) : 0u);
  c.kind = kind;
  c.drop_glossy = pass == LobeClass::kDiffuse && !limits.caustics_reflective;
  c.drop_refractive = pass == LobeClass::kDiffuse && !limits.caustics_refractive;
  return last;
}

/// Of all classes of lobes, or of the diffuse one where a kernel knows no other.
template <bool kLobes>
inline Rgb total(const BsdfValue& value) {
  if constexpr (kLobes)
    return value.total();
  else
    return value.diffuse;
}

/// Probability with which a path goes on. The first bounce always does; the root is close to what a display shows of
/// the loss.
inline float survival(const Rgb& throughput, uint32_t depth, uint32_t transparent_depth) {
  if (depth <= 1 && transparent_depth <= 1) return 1.0f;
  return glm::min(1.0f, std::sqrt(max_component(throughput)));
}

/// Weight of a sample drawn with density a, when the other strategy would have drawn it with b (Veach 1995, power 2).
inline float power_heuristic(float a, float b) {
  if (!(b > 0.0f)) return 1.0f;
  const float ratio = b / a;  // no overflow: densities may be huge
  return 1.0f / (1.0f + ratio * ratio);
}

}  // namespace afterglow
