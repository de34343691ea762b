// SPDX-License-Identifier: GPL-3.0-or-later
// What the bounded geometry term of virtual point lights cuts away, gathered by short rays (Kollig and Keller 2004,
// "Illumination in the Presence of Weak Singularities"): from a place into the cosine's directions, no farther than the
// bound reaches. What a ray meets shines with its direct light, with that of the virtual lights as they are bounded
// there, and with what short rays from there find in their turn.
#pragma once

#include <vector>

#include "transport/virtual_lights.h"

namespace afterglow {

class ShortRays {
 public:
  /// `lights` in the slots of `plan`; `count` rays from each place, none: nothing is gathered.
  ShortRays(const WalkScene& walk, const VirtualLightColumns& lights, SlotPlan plan, float bound, uint32_t count)
      : walk_(walk), lights_(lights), plan_(std::move(plan)), bound_(bound), count_(count) {}
  /// Irradiance that the bound took from a place. The same seed, the same rays. terms: memory, [padded()] of the
  /// lights.
  Rgb gather(const Vec3& position, const Vec3& normal, const Vec3& face_normal, float error, uint32_t seed,
             std::vector<float>& terms, RayCounts&) const;

 private:
  Rgb from_lights(const SurfacePoint&, bool back, uint32_t slots, float u, std::vector<float>& terms, RayCounts&) const;
  bool from_emitters(const SurfacePoint&, const PathContext&, bool both_sides, float u_light, const Vec2& u, Rgb& light,
                     bool& back, RayCounts&) const;
  bool meet(Ray&, const Vec3& from, float u, PathContext&, SurfacePoint&, Surface&, Rgb& throughput, RayCounts&) const;

  const WalkScene& walk_;
  const VirtualLightColumns& lights_;
  SlotPlan plan_;
  float bound_;
  uint32_t count_;
};

}  // namespace afterglow
