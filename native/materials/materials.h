// SPDX-License-Identifier: GPL-3.0-or-later
// All compiled materials, worlds and light graphs of a committed scene, and the textures they read. shade() runs a
// program at a hit; programs that read nothing of the hit are folded into a ready Surface.
#pragma once

#include <memory>
#include <vector>

#include "materials/surface.h"
#include "rays/surface_point.h"
#include "scene/effects.h"

namespace afterglow {

class Materials {
 public:
  Materials();
  ~Materials();
  /// Compiles what changed. Unknown nodes, missing images and the like: a fallback, named once in warnings.
  void commit(const Scene&, const SceneChanges&, std::vector<std::string>& warnings);
  Effects effects() const;  // of all materials and the world
  uint32_t material_effects(uint32_t material) const;
  /// For dense material indices of a committed scene.
  const PlainMaterial& plain(uint32_t material) const { return plain_[material]; }
  bool all_plain() const { return all_plain_; }  // the path's context means nothing to any
  bool some_read_uv() const { return some_read_uv_; }
  bool reads_uv(uint32_t material) const;  // needs SurfacePoint::uv

  /// The lobes, emission and transparency at a point. material = point.material.
  void shade(const Scene&, const SurfacePoint&, const PathContext&, Surface&) const;
  /// What passes straight through for a shadow ray; 0 for opaque materials without running anything.
  Rgb transparency(const Scene&, const SurfacePoint&, const PathContext&) const;
  bool opaque(uint32_t material) const;  // to shadow rays, always
  bool emits(uint32_t material) const;   // and may be sampled as a light
  /// Mean emitted radiance, for light selection: constant programs exactly, others estimated over their textures.
  Rgb mean_emission(uint32_t material) const;
  Rgb emission(const Scene&, const SurfacePoint&, const PathContext&) const;

  Rgb world(const Vec3& direction, const PathContext&) const;
  bool world_constant() const;
  bool has_world() const;
  /// Factor on a light's colour from its graph; direction: from the light, in its local frame.
  Rgb light(Handle light, const Vec3& direction, const Vec2& uv) const;
  size_t bytes() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
  std::vector<PlainMaterial> plain_;
  bool all_plain_ = false, some_read_uv_ = false;
};

}  // namespace afterglow
