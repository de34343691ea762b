// SPDX-License-Identifier: GPL-3.0-or-later
// What a Scene holds. Internal to native/scene: scene.cpp edits the tables, commit.cpp makes the dense records.
#pragma once

#include "base/errors.h"
#include "scene/change_log.h"
#include "scene/mesh_check.h"
#include "scene/placement.h"
#include "scene/scene.h"

namespace afterglow {

/// Rows by handle. Handles grow and are never given twice; rows keep their address until removed.
template <class Row>
class Table {
 public:
  explicit Table(const char* kind) : kind_(kind) {}
  Handle add(Row row) {
    rows_.push_back(std::make_unique<Row>(std::move(row)));
    return Handle(rows_.size());
  }
  void remove(Handle handle) {
    at(handle);
    rows_[handle - 1].reset();
  }
  Row* find(Handle handle) const { return handle >= 1 && handle <= rows_.size() ? rows_[handle - 1].get() : nullptr; }
  Row& at(Handle handle) const {
    if (Row* row = find(handle)) return *row;
    throw InvalidHandle(std::string("no ") + kind_ + " has the handle " + std::to_string(handle));
  }
  std::vector<Handle> handles() const {
    std::vector<Handle> out;
    for (size_t i = 0; i < rows_.size(); ++i)
      if (rows_[i]) out.push_back(Handle(i + 1));
    return out;
  }
  size_t slots() const { return rows_.size(); }

 private:
  const char* kind_;
  std::vector<std::unique_ptr<Row>> rows_;
};

/// A mesh and what its repairs took out.
struct MeshRow {
  Mesh mesh;
  std::vector<DroppedTriangle> dropped;
};

/// An instance and its dense place.
struct InstanceRow {
  Instance instance;
  uint32_t index = kNone;
  bool placed = false;   // its record can be rendered
  DMat4 committed{1.0};  // transform at the last commit
  bool moved = false;
};

struct Scene::State {
  Table<Image> images{"image"};
  Table<Material> materials{"material"};
  Table<MeshRow> meshes{"mesh"};
  Table<InstanceRow> instances{"instance"};
  Table<Light> lights{"light"};
  World world;
  Camera camera;
  Material default_material;

  ChangeSet pending;
  ChangeLog log;

  // Dense, made by commit().
  std::vector<InstanceRecord> records;
  std::vector<uint32_t> free_records, freed_now;
  std::vector<Handle> material_handles{0};
  std::vector<uint32_t> material_indices;  // by handle
  std::vector<uint32_t> free_materials, freed_materials_now;
  std::vector<uint32_t> slots{0};
  DVec3 origin{0.0};
  Box bounds;
  bool transforms_touched = false;

  bool objects_touched() const {
    return transforms_touched || !freed_now.empty() || pending.any(ChangeSet::kMesh) ||
           pending.any(ChangeSet::kInstance) || pending.any(ChangeSet::kMaterial) || !freed_materials_now.empty();
  }
  void place_materials();
  void place_instances();
  void place_slots();
  void choose_origin();
  void note_moves();
};

}  // namespace afterglow
