// SPDX-License-Identifier: GPL-3.0-or-later
// What changed between two versions of a scene. Every cache, viewport and final render remembers its own version and
// asks the scene for the changes since; a log too short answers "everything".
#pragma once

#include <string>
#include <vector>

#include "base/math.h"
#include "scene/tables.h"

namespace afterglow {

/// An instance whose place or form changed: both bounds in world space (64-bit, absolute).
struct MovedInstance {
  Handle instance = 0;
  DMat4 from{1.0}, to{1.0};
  bool deformed = false;
};

struct SceneChanges {
  uint64_t version = 0;  // after these changes
  bool everything = false;
  bool camera = false, world = false, origin = false;
  std::vector<Handle> meshes_added, meshes_deformed, meshes_replaced, meshes_removed;
  std::vector<Handle> instances_added, instances_removed, instances_edited;  // edited: materials, flags, colours
  std::vector<MovedInstance> instances_moved;
  std::vector<Handle> materials_added, materials_edited, materials_removed;
  std::vector<Handle> lights_added, lights_edited, lights_removed;
  std::vector<Handle> images_edited;
  std::vector<std::string> warnings;
  bool empty() const;
};

}  // namespace afterglow
