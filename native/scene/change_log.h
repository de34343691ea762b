// SPDX-License-Identifier: GPL-3.0-or-later
// Edits gathered by handle, and the bounded history of commits from which "changes since version N" are joined. Joining
// keeps the meaning: what was added and removed again is nothing, what was moved twice moved from the first place to
// the last.
#pragma once

#include <deque>
#include <map>

#include "scene/changes.h"

namespace afterglow {

/// Edits of one span of time. Ordered maps, so that the lists that come out never depend on hashing.
class ChangeSet {
 public:
  enum Table : uint8_t { kMesh, kInstance, kMaterial, kLight, kImage, kTables };
  enum Event : uint8_t { kAdded = 1, kEdited = 2, kDeformed = 4, kRemoved = 8 };  // kEdited of a mesh: replaced

  void note(Table, Handle, Event);
  void moved(const MovedInstance&);
  bool has(Table table, Handle handle, Event event) const;
  bool any(Table table) const { return !tables_[table].empty(); }
  /// Appends what came later.
  void join(const ChangeSet& later);
  SceneChanges list() const;
  bool empty() const;

  bool everything = false, camera = false, world = false, origin = false;
  std::vector<std::string> warnings;

 private:
  std::map<Handle, uint8_t> tables_[kTables];
  std::map<Handle, MovedInstance> moved_;
};

class ChangeLog {
 public:
  static constexpr size_t kLength = 256;
  uint64_t version() const { return version_; }
  /// Stores one commit's changes and returns the new version; an empty set keeps the version.
  uint64_t push(const ChangeSet&);
  SceneChanges since(uint64_t version) const;

 private:
  uint64_t version_ = 0;
  std::deque<ChangeSet> entries_;  // the last one led to version_
};

}  // namespace afterglow
