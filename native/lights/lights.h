// SPDX-License-Identifier: GPL-3.0-or-later
// All emitters of a committed scene behind one question: where should this point look for light, and how likely was
// that? Points, spots, suns, area lights, emissive triangles and the world; many of them are chosen through a light
// tree (Conty Estevez and Kulla 2018).
#pragma once

#include <memory>

#include "lights/emissive_mesh.h"
#include "materials/materials.h"

namespace afterglow {

struct LightSample {
  Vec3 direction{0.0f};  // unit, towards the light
  float distance = kInfinity;
  Rgb radiance{0.0f};    // arriving, unoccluded; delta lights: irradiance on a facing plane
  float density = 0.0f;  // solid angle (delta: discrete), selection included
  Vec3 margin{0.0f};     // a light that is a surface: step off it, from the sampled point to where a shadow ray ends
  bool delta = false;    // cannot be hit by a BSDF sample: no MIS
  bool cast_shadow = true;
  uint32_t visibility = kVisibleAll;  // of the light, to kinds of rays
  uint32_t light = kNone;             // dense light index, stable between commits without light changes
};

/// A light with a shape (point or spot with radius, area) that a ray runs into; emissive meshes are hit through the
/// BVH.
struct LightHit {
  float t = kInfinity;
  Rgb radiance{0.0f};
  uint32_t light = kNone;
  uint32_t visibility = kVisibleAll;
};

/// The emitter of a scene that has no other and whose whole surface shines alike: nothing is to be chosen.
struct LoneLight {
  EmissivePatch patch;
  Rgb radiance{0.0f};
  uint32_t visibility = kVisibleAll;
};

/// What LightSample says of a lone light, without what cannot be otherwise.
struct LoneSample : PatchSample {
  const Rgb& radiance;
  explicit LoneSample(const LoneLight& lone) : radiance(lone.radiance) {}
  static constexpr bool delta = false, cast_shadow = true;
};

/// Lights::sample where a lone light is all there is.
inline bool sample_lone(const LoneLight& lone, const Vec3& position, const Vec3& normal, const Vec2& u,
                        LoneSample& out) {
  return sample_patch(lone.patch, position, normal, u, out);
}

class Lights {
 public:
  Lights();
  ~Lights();
  void commit(const Scene&, const SceneChanges&, const Materials&, std::vector<std::string>& warnings);
  Effects effects() const;
  uint32_t count() const;
  size_t bytes() const;
  /// Another number, another answer of sample().
  uint64_t version() const { return version_; }

  /// normal 0: light from all sides counts (translucent surfaces). False: nothing to sample from here.
  bool sample(const Vec3& position, const Vec3& normal, float u_light, const Vec2& u, LightSample&) const;
  /// Null: there are several lights, or none. sample() asks it, too; a walk that does so first saves the call.
  const LoneLight* lone() const { return has_lone_ ? &lone_ : nullptr; }
  /// The density with which sample() at (position, normal) would have chosen this hit's direction.
  float density_of_triangle(const Vec3& position, const Vec3& normal, const SurfacePoint& emitter) const;
  float density_of_light(const Vec3& position, const Vec3& normal, const Vec3& direction, const LightHit&) const;
  float density_of_world(const Vec3& position, const Vec3& normal, const Vec3& direction) const;
  /// The nearest shaped light before t_max, or false. Suns and the world are at infinity: see escaped().
  bool intersect(const Ray&, LightHit&) const;
  /// Calls visit(LightHit) for every shaped light that the ray meets, each once, in no order of distance.
  template <class Visit>
  void for_each_hit(const Ray& ray, const Visit& visit) const {
    visit_hits(
        ray, [](const void* v, const LightHit& hit) { (*static_cast<const Visit*>(v))(hit); }, &visit);
  }
  bool has_shapes() const;
  /// Radiance of suns with an angle towards a ray that left the scene (the world is Materials::world), with each one's
  /// density.
  bool has_suns() const;
  Rgb escaped_suns(const Vec3& direction, uint32_t ray_visibility, uint32_t index, float& density, const Vec3& position,
                   const Vec3& normal) const;
  uint32_t sun_count() const;

 private:
  void visit_hits(const Ray&, void (*visit)(const void*, const LightHit&), const void* context) const;
  struct State;
  std::unique_ptr<State> state_;
  LoneLight lone_;
  bool has_lone_ = false;
  uint64_t version_ = 0;
};

}  // namespace afterglow
