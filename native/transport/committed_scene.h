// SPDX-License-Identifier: GPL-3.0-or-later
// A scene made ready to be rendered: the tables, and what rays, materials and lights built from them. One commit keeps
// all of them in step. Methods and the renderer read it; only commit() writes it, and no reader may run meanwhile.
#pragma once

#include <shared_mutex>

#include "lights/lights.h"
#include "rays/ray_caster.h"
#include "scene/changes.h"
#include "scene/effects.h"
#include "scene/scene.h"
#include "transport/keepsakes.h"

namespace afterglow {

struct CommittedScene {
  Scene scene;
  RayCaster rays;
  Materials materials;
  Lights lights;
  Effects effects;
  double commit_seconds = 0.0;
  bool broken = false;  // a commit failed half-way: the next one rebuilds everything
  /// Who renders holds it shared for as long as its threads read; who edits or commits holds it alone. The module's
  /// edits do not wait for it: they tell the user to edit inside `with session.edit()`.
  mutable std::shared_mutex use;
  mutable Keepsakes kept;  // by renders, for the next one

  /// Changes since the last commit, warnings of every layer included.
  SceneChanges commit(RayCaster::Options options);
};

}  // namespace afterglow
