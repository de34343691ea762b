// SPDX-License-Identifier: GPL-3.0-or-later
// What the bounded geometry term of virtual point lights cuts away, gathered by short rays (Kollig and Keller 2004,
// "Illumination in the Presence of Weak Singularities"): from a place into the cosine's directions, no farther than the
// bound reaches. What a ray meets shines with its direct light, with that of the virtual lights as they are bounded
// there, and with what short rays from there find in their turn. What each of them met can be kept: after an edit only
// the ways that it touched are asked again.
#pragma once

#include <span>
#include <vector>

#include "transport/virtual_lights.h"

namespace afterglow {

/// Where short rays begin.
struct ShortRayPlace {
  Vec3 position{0.0f}, normal{0, 0, 1}, face_normal{0, 0, 1};
  float error = 0.0f;
  uint32_t seed = 0;  // the same seed, the same rays
};

/// What a short ray met, and what is sent from there to the place that its walk began at.
struct ShortRayStop {
  enum Flags : uint8_t {
    kBack = 1,         // the walk goes on behind the surface
    kGoesOn = 2,       // a further ray left from here
    kStale = 4,        // the virtual light has to be chosen anew, or its way be asked again
    kLampStale = 32,   // the same of the lamp
    kLampKnown = 8,    // how much passes between here and lamp_end
    kLightKnown = 16,  // how much passes between here and the chosen virtual light
  };
  Vec3 position{0.0f};
  float error = 0.0f;
  uint32_t normal = 0, face_normal = 0;  // packed
  uint32_t weight[2] = {0, 0};           // packed: albedo of both sides times what came so far
  Vec3 lamp_end{0.0f};
  uint32_t chosen = kNone;
  uint32_t lamp_light = 0;      // packed: what the lamp sends
  Rgb light{0.0f};              // with it, all that is sent
  uint16_t passes[2] = {0, 0};  // of the lamp and the virtual light, packed
  uint16_t walk = 0;
  uint16_t choice = 0;  // of the groups of virtual lights
  uint8_t depth = 0;
  uint8_t left = 0;  // bounces whose virtual lights are asked
  uint8_t flags = 0;
  bool both_sides() const { return weight[1] != 0; }
};

class ShortRays {
 public:
  /// `lights` in the slots of `plan`; `count` rays from each place, none: nothing is gathered.
  ShortRays(const WalkScene& walk, const VirtualLightColumns& lights, SlotPlan plan, float bound, uint32_t count);
  uint32_t count() const { return count_; }
  float reach() const { return 1.2f * bound_; }
  /// Irradiance that the bound took from a place; `stops` tells of what.
  Rgb gather(const ShortRayPlace&, std::vector<ShortRayStop>& stops, RayCounts&) const;
  /// One of the walks; its stops are appended.
  void walk(const ShortRayPlace&, uint32_t index, std::vector<ShortRayStop>& stops, RayCounts&) const;
  /// The light of a stop, from what is known of its ways. One copy of code, so that all sums are rounded alike.
  [[gnu::noinline]] void find_light(const ShortRayPlace&, ShortRayStop&, RayCounts&) const;
  Rgb sum(std::span<const ShortRayStop>) const;
  /// The direction of the ray of this depth (from 1) of a walk. False: it is not taken.
  bool direction(const ShortRayPlace&, uint32_t index, uint32_t depth, const Vec3& around, const Vec3& face,
                 Vec3& out) const;
  /// Virtual lights come in groups of sixteen slots; those that a stop chooses from. Twice the same: one.
  static constexpr uint32_t kGroup = 16, kGroups = 2;
  void groups(const ShortRayStop&, uint32_t (&found)[kGroups]) const;

 private:
  uint32_t slots(const ShortRayStop& stop) const {
    return stop.left < plan_.first.size() ? plan_.first[stop.left] : plan_.slots;
  }
  Rgb from_lights(ShortRayStop&, float u, RayCounts&) const;
  Rgb from_emitters(const SurfacePoint&, ShortRayStop&, float u_light, const Vec2& u, RayCounts&) const;
  bool meet(Ray&, const Vec3& from, float u, PathContext&, SurfacePoint&, Surface&, Rgb& throughput, RayCounts&) const;

  const WalkScene& walk_;
  const VirtualLightColumns& lights_;
  SlotPlan plan_;
  float bound_, far_;
  uint32_t count_;
};

}  // namespace afterglow
