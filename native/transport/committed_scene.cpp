// SPDX-License-Identifier: GPL-3.0-or-later
// One commit of the tables and of all that is built from them: see committed_scene.h.
#include "transport/committed_scene.h"

#include <chrono>

#include "base/memory.h"

namespace afterglow {

namespace {

bool hides_from_rays(const Scene& scene) {
  for (const InstanceRecord& record : scene.instances())
    if (record.mesh && (record.visibility != kVisibleAll || record.holdout || record.shadow_catcher)) return true;
  for (const Handle handle : scene.light_handles())
    if (const Light& light = scene.light(handle); light.visibility != kVisibleAll || !light.cast_shadow) return true;
  return scene.world().visibility != kVisibleAll;
}

Effects all_effects(const CommittedScene& s) {
  Effects effects{s.materials.effects().bits | s.lights.effects().bits};
  const Camera& camera = s.scene.camera();
  if (camera.aperture_radius > 0.0f && camera.kind != CameraKind::kPanorama) effects.add(kDepthOfField);
  if (hides_from_rays(s.scene)) effects.add(kRayVisibility);
  return effects;
}

}  // namespace

SceneChanges CommittedScene::commit(RayCaster::Options options) {
  const auto start = std::chrono::steady_clock::now();
  SceneChanges changes = scene.commit();
  changes.everything |= broken;
  broken = true;  // until all layers have followed
  // A final render is about to hold most of what it ever will: what reading the scene, and then building, left over
  // would stand on top of it.
  const bool final_render = options.flatten == RayCaster::Flatten::kAlways;
  if (final_render) release_free_memory();
  rays.commit(scene, changes, options);
  materials.commit(scene, changes, changes.warnings);
  lights.commit(scene, changes, materials, changes.warnings);
  effects = all_effects(*this);
  broken = false;
  if (final_render) release_free_memory();
  commit_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return changes;
}

}  // namespace afterglow
