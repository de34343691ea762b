// SPDX-License-Identifier: GPL-3.0-or-later
// Scene::commit: the dense arrays that kernels read are brought in step with the tables, and the edits since the last
// commit become one entry of the change log.
#include <algorithm>
#include <map>

#include "scene/scene_state.h"

namespace afterglow {

/// Dense places of materials; index 0 stays the default grey.
void Scene::State::place_materials() {
  for (const uint32_t index : freed_materials_now) {
    material_handles[index] = 0;
    free_materials.push_back(index);
  }
  freed_materials_now.clear();
  material_indices.resize(materials.slots() + 1, 0);
  for (Handle handle = 1; handle <= materials.slots(); ++handle) {
    if (!materials.find(handle)) {
      material_indices[handle] = 0;
    } else if (material_indices[handle] == 0) {
      uint32_t index = uint32_t(material_handles.size());
      if (!free_materials.empty()) {
        index = free_materials.back();
        free_materials.pop_back();
      } else {
        material_handles.push_back(0);
      }
      material_handles[index] = handle;
      material_indices[handle] = index;
    }
  }
}

/// Gives new instances a place, decides which can be rendered, and tells of those that cannot.
void Scene::State::place_instances() {
  for (const uint32_t index : freed_now) {
    records[index] = InstanceRecord{};
    free_records.push_back(index);
  }
  freed_now.clear();
  std::sort(free_records.begin(), free_records.end(), std::greater<>());  // the lowest place first
  for (Handle handle = 1; handle <= instances.slots(); ++handle) {
    InstanceRow* row = instances.find(handle);
    if (!row) continue;
    if (row->index == kNone) {
      if (free_records.empty()) {
        row->index = uint32_t(records.size());
        records.emplace_back();
      } else {
        row->index = free_records.back();
        free_records.pop_back();
      }
    }
    const Instance& instance = row->instance;
    const bool has_mesh = meshes.find(instance.mesh);
    const bool fits = has_mesh && usable_transform(instance.transform);
    const bool touched = row->moved || pending.has(ChangeSet::kInstance, handle, ChangeSet::kAdded) ||
                         pending.has(ChangeSet::kInstance, handle, ChangeSet::kEdited);
    if (!fits && (row->placed || touched))
      pending.warnings.push_back(
          "object '" + instance.name + "' is left out: " +
          (has_mesh ? "its transform is singular or not finite; give it a scale other than 0 on every axis"
                    : "its mesh was removed"));
    if (row->placed != fits && !pending.has(ChangeSet::kInstance, handle, ChangeSet::kAdded))
      pending.note(ChangeSet::kInstance, handle, ChangeSet::kEdited);
    row->placed = fits;
  }
}

void Scene::State::choose_origin() {
  DBox box;
  for (Handle handle = 1; handle <= instances.slots(); ++handle)
    if (const InstanceRow* row = instances.find(handle); row && row->placed)
      box.extend(transformed(meshes.at(row->instance.mesh).mesh.bounds, row->instance.transform));
  const DVec3 chosen = afterglow::choose_origin(box);
  if (chosen != origin) pending.origin = true;
  origin = chosen;
  bounds = Box{};
  if (!box.empty()) bounds = {Vec3(box.lower - origin), Vec3(box.upper - origin)};
}

void Scene::State::note_moves() {
  for (Handle handle = 1; handle <= instances.slots(); ++handle) {
    InstanceRow* row = instances.find(handle);
    if (!row) continue;
    const bool deformed = pending.has(ChangeSet::kMesh, row->instance.mesh, ChangeSet::kDeformed);
    if (row->moved || deformed) pending.moved({handle, row->committed, row->instance.transform, deformed});
    row->committed = row->instance.transform;
    row->moved = false;
  }
}

/// Lists of dense material indices, equal lists shared; then the records themselves.
void Scene::State::place_slots() {
  slots.assign(1, 0);
  std::map<std::vector<uint32_t>, uint32_t> lists{{{0}, 0}};
  std::vector<uint32_t> list;
  for (Handle handle = 1; handle <= instances.slots(); ++handle) {
    const InstanceRow* row = instances.find(handle);
    if (!row) continue;
    InstanceRecord& record = records[row->index];
    record = InstanceRecord{};
    const Instance& instance = row->instance;
    record.handle = handle;
    record.mesh_handle = instance.mesh;
    if (!row->placed) continue;
    list.clear();
    for (const Handle material : instance.materials)
      list.push_back(material < material_indices.size() ? material_indices[material] : 0);
    if (list.empty()) list.push_back(0);
    const auto [place, is_new] = lists.try_emplace(list, uint32_t(slots.size()));
    if (is_new) slots.insert(slots.end(), list.begin(), list.end());
    record.first_material = place->second;
    record.slot_count = uint32_t(list.size());
    record.to_world = relative_to(instance.transform, origin);
    record.to_object = relative_from(instance.transform, origin);
    record.mesh = &meshes.at(instance.mesh).mesh;
    record.visibility = instance.visibility;
    record.object_index = instance.object_index;
    record.color = instance.color;
    record.random = instance.random;
    record.holdout = instance.holdout;
    record.shadow_catcher = instance.shadow_catcher;
    record.mirrored = is_mirrored(instance.transform);
  }
}

SceneChanges Scene::commit() {
  State& s = *state_;
  if (s.objects_touched()) {
    s.place_materials();
    s.place_instances();
    s.choose_origin();
    s.place_slots();
    s.note_moves();
    s.transforms_touched = false;
  }
  records_ = s.records;
  slots_ = s.slots;
  SceneChanges changes = s.pending.list();
  changes.version = s.log.push(s.pending);
  s.pending = ChangeSet{};
  return changes;
}

}  // namespace afterglow
