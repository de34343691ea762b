// SPDX-License-Identifier: GPL-3.0-or-later
// Edits by handle and the history of commits: see change_log.h.
#include "scene/change_log.h"

namespace afterglow {

bool SceneChanges::empty() const {
  return !(everything || camera || world || origin) && meshes_added.empty() && meshes_deformed.empty() &&
         meshes_replaced.empty() && meshes_removed.empty() && instances_added.empty() && instances_removed.empty() &&
         instances_edited.empty() && instances_moved.empty() && materials_added.empty() && materials_edited.empty() &&
         materials_removed.empty() && lights_added.empty() && lights_edited.empty() && lights_removed.empty() &&
         images_edited.empty();
}

void ChangeSet::note(Table table, Handle handle, Event event) {
  uint8_t& bits = tables_[table][handle];
  if (event == kRemoved) {
    const bool was_new = bits & kAdded;
    if (table == kInstance) moved_.erase(handle);
    if (was_new)
      tables_[table].erase(handle);
    else
      bits = kRemoved;
  } else if (event == kDeformed) {
    if (!(bits & (kAdded | kEdited))) bits |= kDeformed;
  } else if (event == kEdited) {
    if (!(bits & kAdded)) bits = kEdited;
  } else {
    bits = event;
  }
}

void ChangeSet::moved(const MovedInstance& move) {
  if (has(kInstance, move.instance, kAdded)) return;
  const auto [place, is_new] = moved_.try_emplace(move.instance, move);
  if (is_new) return;
  place->second.to = move.to;
  place->second.deformed |= move.deformed;
}

bool ChangeSet::has(Table table, Handle handle, Event event) const {
  const auto found = tables_[table].find(handle);
  return found != tables_[table].end() && (found->second & event);
}

void ChangeSet::join(const ChangeSet& later) {
  for (uint8_t table = 0; table < kTables; ++table)
    for (const auto& [handle, bits] : later.tables_[table])
      for (const Event event : {kAdded, kEdited, kDeformed, kRemoved})
        if (bits & event) note(Table(table), handle, event);
  for (const auto& [handle, move] : later.moved_) moved(move);
  everything |= later.everything;
  camera |= later.camera;
  world |= later.world;
  origin |= later.origin;
  warnings.insert(warnings.end(), later.warnings.begin(), later.warnings.end());
}

bool ChangeSet::empty() const {
  for (const auto& table : tables_)
    if (!table.empty()) return false;
  return moved_.empty() && !(everything || camera || world || origin);
}

SceneChanges ChangeSet::list() const {
  SceneChanges out;
  out.everything = everything;
  out.camera = camera;
  out.world = world;
  out.origin = origin;
  out.warnings = warnings;
  const auto sort = [](const std::map<Handle, uint8_t>& table, std::vector<Handle>* added, std::vector<Handle>& edited,
                       std::vector<Handle>* deformed, std::vector<Handle>* removed) {
    for (const auto& [handle, bits] : table) {
      if (added && (bits & kAdded)) added->push_back(handle);
      if (bits & kEdited) edited.push_back(handle);
      if (deformed && (bits & kDeformed)) deformed->push_back(handle);
      if (removed && (bits & kRemoved)) removed->push_back(handle);
    }
  };
  sort(tables_[kMesh], &out.meshes_added, out.meshes_replaced, &out.meshes_deformed, &out.meshes_removed);
  sort(tables_[kInstance], &out.instances_added, out.instances_edited, nullptr, &out.instances_removed);
  sort(tables_[kMaterial], &out.materials_added, out.materials_edited, nullptr, &out.materials_removed);
  sort(tables_[kLight], &out.lights_added, out.lights_edited, nullptr, &out.lights_removed);
  for (const auto& [handle, bits] : tables_[kImage]) out.images_edited.push_back(handle);
  for (const auto& [handle, move] : moved_) out.instances_moved.push_back(move);
  return out;
}

uint64_t ChangeLog::push(const ChangeSet& changes) {
  if (changes.empty()) return version_;
  entries_.push_back(changes);
  entries_.back().warnings.clear();  // said once, by the commit itself
  if (entries_.size() > kLength) entries_.pop_front();
  return ++version_;
}

SceneChanges ChangeLog::since(uint64_t version) const {
  SceneChanges out;
  if (version > version_ || version_ - version > entries_.size()) {
    out.everything = true;
  } else if (version < version_) {
    ChangeSet joined;
    for (size_t k = entries_.size() - size_t(version_ - version); k < entries_.size(); ++k) joined.join(entries_[k]);
    out = joined.list();
  }
  out.version = version_;
  return out;
}

}  // namespace afterglow
