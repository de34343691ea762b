// SPDX-License-Identifier: GPL-3.0-or-later
// The scene as its users edit it: tables by handle, a log of changes, one commit at a time. After a commit, dense
// arrays (one record an instance, in 32-bit floats relative to an origin near the scene) are what kernels read.
#pragma once

#include <memory>
#include <span>
#include <unordered_map>

#include "scene/changes.h"
#include "scene/tables.h"

namespace afterglow {

/// What kernels read of one instance. Index: dense, the geometry id in the top-level BVH; stable until it is removed.
struct InstanceRecord {
  Affine to_world, to_object;  // relative to Scene::origin()
  const Mesh* mesh = nullptr;  // null: a free place (removed, or left out with a warning)
  Handle handle = 0, mesh_handle = 0;
  uint32_t first_material = 0;  // into Scene::material_slots(): dense material indices, one a slot
  uint32_t slot_count = 0;      // at least 1
  uint32_t visibility = kVisibleAll;
  int32_t object_index = 0;
  Vec4 color{1.0f};
  float random = 0.0f;
  bool holdout = false, shadow_catcher = false, mirrored = false;  // mirrored: negative determinant
};

class Scene {
 public:
  Scene();
  ~Scene();
  Scene(const Scene&) = delete;

  Handle add_image(Image);
  void set_image(Handle, Image);
  void remove_image(Handle);
  Handle add_material(Material);
  void set_material(Handle, Material);
  void remove_material(Handle);
  Handle add_mesh(Mesh);  // checks and repairs: indices, non-finite vertices, bounds; warns
  void set_mesh(Handle, Mesh);
  void deform_mesh(Handle, std::vector<Vec3> positions, std::vector<Vec3> corner_normals,
                   std::vector<Vec3> vertex_normals);
  void remove_mesh(Handle);
  Handle add_instance(Instance);
  void set_instance(Handle, Instance);
  void set_transform(Handle, const DMat4&);
  void remove_instance(Handle);
  Handle add_light(Light);
  void set_light(Handle, Light);
  void remove_light(Handle);
  void set_world(World);
  void set_camera(Camera);

  /// Makes the edits visible to readers: dense records, origin, change log. No reader may run meanwhile.
  SceneChanges commit();
  SceneChanges changes_since(uint64_t version) const;
  uint64_t version() const;

  // Read side, valid between commits. Lookup by handle throws InvalidHandle.
  const Mesh& mesh(Handle) const;
  const Instance& instance(Handle) const;
  const Material& material(Handle) const;
  const Light& light(Handle) const;
  const Image& image(Handle) const;
  const World& world() const;
  const Camera& camera() const;
  std::vector<Handle> mesh_handles() const;
  std::vector<Handle> light_handles() const;
  std::vector<Handle> image_handles() const;

  std::span<const InstanceRecord> instances() const { return records_; }
  uint32_t instance_index(Handle) const;
  /// Dense index → material handle; index 0 is the default grey that stands for missing materials.
  std::span<const Handle> material_handles() const;
  uint32_t material_index(Handle) const;
  std::span<const uint32_t> material_slots() const { return slots_; }
  /// World position that kernels' coordinates are relative to: 0 unless the scene is far from it.
  DVec3 origin() const;
  Box bounds() const;  // of all instances, relative to origin()
  std::unordered_map<std::string, size_t> bytes() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
  std::span<const InstanceRecord> records_;  // asked at every hit, so not through a call
  std::span<const uint32_t> slots_;
};

}  // namespace afterglow
