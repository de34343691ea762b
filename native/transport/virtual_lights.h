// SPDX-License-Identifier: GPL-3.0-or-later
// Virtual point lights (Keller 1997, "Instant Radiosity"): light paths leave every kind of light by quasi-Monte Carlo
// points and deposit a light at each diffuse surface that they meet. Path i always uses the same points and each
// (path, bounce) has its own slot, so that an unchanged scene gives the same lights and an edit changes only those
// whose path it touches. As in Keller's scheme a fixed share of the paths goes on after each bounce, whatever they
// carry: the number of light *paths* that can fill a slot's bounce normalises it.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "lights/light_emission.h"
#include "transport/path_walker.h"

namespace afterglow {

/// One light. It shines with radiant intensity front · cos⁺ on the side of its normal, back · cos⁺ on the other (what a
/// translucent surface lets through).
struct VirtualLight {
  Vec3 position{0.0f}, normal{0, 0, 1}, face_normal{0, 0, 1};
  float lift = 0.0f;  // how far above the face a ray to it ends
  Rgb front{0.0f}, back{0.0f};
  bool alive = false;  // its path came this far
  bool same_place(const VirtualLight& o) const {
    return alive == o.alive &&
           (!alive || (position == o.position && normal == o.normal && face_normal == o.face_normal && lift == o.lift));
  }
  bool same_strength(const VirtualLight& o) const { return front == o.front && back == o.back; }
  bool black() const { return !alive || (is_black(front) && is_black(back)); }
};

struct VirtualLightOptions {
  uint32_t count = 256;  // slots of all bounces together
  uint32_t bounces = 4;
  uint32_t pattern = 0;  // which points; 0 from frame to frame
  uint32_t threads = 0;
};

/// How the slots are shared out: bounce b (from 0) has paths[b] slots from first[b] on.
struct SlotPlan {
  std::vector<uint32_t> first, paths;
  uint32_t slots = 0;
};
/// Three of five paths go on after each bounce; at least one.
SlotPlan plan_slots(uint32_t count, uint32_t bounces);

/// All slots, in order of bounce, then path.
std::vector<VirtualLight> trace_virtual_lights(const WalkScene&, const LightEmission&, const VirtualLightOptions&,
                                               RayCounts&);

/// Lights as one array a value, so that a loop over them runs in vector registers. Padded to a multiple of 16 with
/// lights that never shine.
struct LightColumns {
  std::vector<float> x, y, z, nx, ny, nz;
  std::vector<float> front[3], back[3];  // intensities of each colour
  bool two_sided = false;                // any light shines backwards; else nobody reads `back`
  uint32_t padded() const { return uint32_t(x.size()); }
};
/// All slots.
struct VirtualLightColumns : LightColumns {
  std::vector<VirtualLight> lights;
  std::vector<std::array<float, 12>> rows;  // a light's numbers in the order of the columns
  uint32_t count = 0;                       // slots
  void fill(std::vector<VirtualLight>);
  /// Some of them alone, `which` padded with any slots to a multiple of four.
  void choose(std::span<const uint32_t> which, uint32_t count, LightColumns&) const;
};

/// (3) of Debattista et al. 2009: 0 below a, 1 above b, a cubic between.
inline float smooth_bound(float a, float b, float x) {
  const float t = glm::clamp((x - a) / (b - a), 0.0f, 1.0f);
  return t * t * (3.0f - 2.0f * t);
}

/// The bounded geometry term (2) of all lights seen from a point, [padded()]: cos⁺ cos / d² · f(0.8 m, 1.2 m, d).
/// Negative where the light shows its back. m = 0: no bound. Or those of some alone: `count` from slot `first` on.
void geometry_terms(const LightColumns&, const Vec3& position, const Vec3& normal, float bound, float* out,
                    uint32_t first, uint32_t count);
inline void geometry_terms(const LightColumns& lights, const Vec3& position, const Vec3& normal, float bound,
                           float* out) {
  geometry_terms(lights, position, normal, bound, out, 0, lights.padded());
}

/// What all lights together send to a place, and its derivatives: over steps along t and b (of a frame whose normal is
/// the place's), and over turns of the normal towards t and b. As in Ward and Heckbert 1992, but exact, since each
/// light is known.
struct LightSums {
  Rgb light, step_t, step_b, turn_t, turn_b;
};
LightSums sum_lights(const LightColumns&, const Vec3& position, const Frame&, float bound);

/// Whether both faces (not only the smooth normals) look at each other. front: the side that shines.
bool can_see(const Vec3& position, const Vec3& face_normal, const VirtualLight&, bool front);
/// The ray that asks whether a light is seen; from above the point's face, to above the light's.
Ray visibility_ray(const Vec3& lifted_position, const VirtualLight&);
/// Share of the light that arrives: exactly 0 or 1 where all that can be between is opaque.
Rgb visibility(const WalkScene&, const Ray&, RayCounts&);
/// The same of at most RayCaster::kTogether rays, from places side by side.
void visibility(const WalkScene&, std::span<const Ray>, std::span<Rgb>, RayCounts&);

}  // namespace afterglow
