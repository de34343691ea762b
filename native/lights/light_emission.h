// SPDX-License-Identifier: GPL-3.0-or-later
// Rays that leave the lights, for light paths (instant radiosity, Keller 1997): every light object, emissive triangle
// and world is a place and a direction to start from. Where a ray starts depends on geometry alone, not on colour or
// strength, so that a light that is dimmed or tinted sends the same paths with another flux; lights are chosen by
// classes of power a factor of 16 apart for the same reason.
#pragma once

#include "lights/emissive_mesh.h"
#include "lights/lamp.h"
#include "lights/world_map.h"
#include "materials/materials.h"

namespace afterglow {

struct EmittedRay {
  Ray ray;
  float weight = 0.0f;  // 1 / density of choice, place and direction: times arriving() it is flux
  uint32_t emitter = kNone;
  float beam = 0.0f;  // area of the beam that a ray from far away was chosen from
  Rgb flux{0.0f};     // of emissive meshes and the world, complete; lamps: see arriving()
};

class LightEmission {
 public:
  void build(const Scene&, const Materials&);
  bool empty() const { return emitters_.empty(); }
  uint32_t count() const { return uint32_t(emitters_.size()); }
  /// Whether a sun or a world shines, whose rays come from outside of the scene.
  bool far() const { return far_; }
  /// u_choice chooses the emitter, `place` a point on it (or across the scene), `way` a direction. False: nothing
  /// leaves.
  bool sample(float u_choice, const Vec2& place, const Vec2& way, EmittedRay&) const;
  /// Flux that the ray brings to a point that it reached.
  Rgb arriving(const EmittedRay&, const Vec3& position) const;

  bool shadowless(const EmittedRay& ray) const {
    const Emitter& e = emitters_[ray.emitter];
    return e.kind == Emitter::kLamp && !lamps_[e.lamp].cast_shadow;
  }
  /// Rays of one direction from outside of the scene, the one through a place; and the beam's middle and radius.
  void far_through(const Vec3& place, Ray&) const;
  bool in_beam(const Ray& ray) const {
    const Vec3 way = ray.origin - center_;
    return glm::length(way - glm::dot(way, ray.direction) * ray.direction) <= radius_;
  }

  /// A ball around the bounds, snapped to a coarse grid so that small edits do not move the rays of suns and worlds.
  static void surrounding_ball(const Box& bounds, Vec3& center, float& radius);
  /// Class of a power relative to the strongest: 1, 1/16, 1/256.
  static float power_class(float power, float strongest);

 private:
  struct Emitter {
    enum Kind : uint8_t { kLamp, kWorld, kMesh } kind;
    uint32_t lamp = 0;                // into lamps_
    uint32_t first = 0, count = 0;    // patches of one instance
    float area = 0.0f, power = 0.0f;  // mesh: of one side
    Rgb strength{1.0f};               // lamp: colour × power of its light object
  };
  bool sample_lamp_ray(const Emitter&, const Vec2& place, const Vec2& way, EmittedRay&) const;
  bool sample_mesh_ray(const Emitter&, const Vec2& place, const Vec2& way, EmittedRay&) const;
  bool sample_world_ray(const Vec2& place, const Vec2& way, EmittedRay&) const;
  void from_far(const Vec3& direction, const Vec2& place, Ray&) const;

  const Scene* scene_ = nullptr;
  const Materials* materials_ = nullptr;
  std::vector<Emitter> emitters_;
  std::vector<float> chances_, cumulative_;  // by emitter
  std::vector<Lamp> lamps_;                  // of colour 1 and power 1
  EmissiveMeshes meshes_;
  std::vector<float> patch_areas_;  // cumulative within each emitter
  WorldMap world_map_;
  Vec3 center_{0.0f};
  float radius_ = 0.0f;
  bool far_ = false;
};

}  // namespace afterglow
