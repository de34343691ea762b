// SPDX-License-Identifier: GPL-3.0-or-later
// The upper part of the BVH: instances of meshes, and beside them one common BVH of meshes that are used once, with
// their triangles in world space. A moved instance rebuilds the top level alone.
#include <algorithm>
#include <exception>
#if defined(__SANITIZE_THREAD__)
#include <sanitizer/tsan_interface.h>
#endif

#include "base/errors.h"
#include "base/parallel.h"
#include "rays/ray_caster_state.h"

namespace afterglow {

RayCaster::State::State() : device(rtcNewDevice(nullptr)) {
  if (!device) throw Error("Embree cannot be started: error " + std::to_string(rtcGetDeviceError(nullptr)));
  if (rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED)) together = 8;
  if (rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED)) together = 16;
  rtcSetDeviceErrorFunction(
      device,
      [](void* self, RTCError code, const char* text) {
        State& state = *static_cast<State*>(self);
        const std::lock_guard lock(state.error_lock);
        if (state.error != RTC_ERROR_NONE) return;  // the first one is the cause
        state.error = code;
        state.error_text = text ? text : "";
      },
      this);
#if defined(__SANITIZE_THREAD__)
  __tsan_release(this);  // Embree's workers, which the sanitizer does not follow, are given what was built up to here
#endif
  rtcSetDeviceMemoryMonitorFunction(
      device,
      [](void* self, ssize_t bytes, bool) {
#if defined(__SANITIZE_THREAD__)
        __tsan_acquire(self);
#endif
        static_cast<State*>(self)->device_bytes += bytes;
        return true;
      },
      this);
  top = rtcNewScene(device);
  rtcSetSceneFlags(top, kSceneFlags);
  rtcCommitScene(top);
  root = top;
}

RayCaster::State::~State() {
  clear();
  if (top) rtcReleaseScene(top);
  if (device) rtcReleaseDevice(device);
}

void RayCaster::State::throw_on_error(const std::string& doing) {
  const std::lock_guard lock(error_lock);
  if (error == RTC_ERROR_NONE) return;
  const std::string text = doing + ": Embree says: " + error_text;
  const bool memory = error == RTC_ERROR_OUT_OF_MEMORY;
  error = RTC_ERROR_NONE;
  if (memory) throw OutOfMemory(text);
  throw Error(text);
}

/// Empties a place. In the common BVH nothing can be taken out: its triangles stay, but no ray's mask meets them.
void RayCaster::State::detach(uint32_t index) {
  PlacedGeometry& placed = places[index];
  if (placed.kind == PlacedGeometry::kInstance) rtcDetachGeometry(top, index + 1);
  if (placed.kind == PlacedGeometry::kFlat) rtcSetGeometryMask(placed.geometry, 0);
  if (placed.geometry) rtcReleaseGeometry(placed.geometry);
  const uint32_t changed = placed.changed;
  placed = PlacedGeometry{};
  placed.changed = changed;
}

void RayCaster::State::drop_flat() {
  for (uint32_t index = 0; index < places.size(); ++index)
    if (places[index].kind == PlacedGeometry::kFlat) detach(index);
  if (flat_instance) {
    rtcDetachGeometry(top, kFlatId);
    rtcReleaseGeometry(flat_instance);
  }
  if (flat) rtcReleaseScene(flat);
  flat = nullptr;
  flat_instance = nullptr;
  flat_triangles = 0;
}

void RayCaster::State::clear() {
  drop_flat();
  for (uint32_t index = 0; index < places.size(); ++index) detach(index);
  places.clear();
  meshes.clear();
  flat_chosen = false;
}

/// Which places stand in the common BVH from now on. Drops it when it has to be built anew.
void RayCaster::State::choose_flat(const Scene& scene, const std::set<Handle>& replaced,
                                   const std::set<Handle>& changed, std::vector<bool>& is_flat) {
  const auto records = scene.instances();
  is_flat.assign(records.size(), false);
  if (options.flatten == Flatten::kNever) return drop_flat();
  const bool still = options.flatten == Flatten::kStill;
  std::unordered_map<Handle, uint32_t> users;
  for (const InstanceRecord& record : records)
    if (record.mesh) ++users[record.mesh_handle];
  std::vector<bool> wanted(records.size(), false);
  uint64_t kept_triangles = 0;
  bool all_kept = true;
  ++flat_commits;
  for (size_t i = 0; i < records.size(); ++i) {
    const InstanceRecord& record = records[i];
    PlacedGeometry& placed = places[i];
    const bool single = record.mesh && !record.mesh->triangles.empty() && users[record.mesh_handle] == 1;
    const bool same_as_before = placed.kind != PlacedGeometry::kEmpty && placed.mesh == record.mesh_handle &&
                                !changed.contains(record.mesh_handle) && same(placed.to_world, record.to_world);
    const bool stands = placed.kind == PlacedGeometry::kFlat;
    const bool was_quiet = flat_commits - placed.changed >= kQuietCommits;
    const bool built_anyway = placed.mesh != record.mesh_handle || replaced.contains(record.mesh_handle);
    const bool quiet = stands ? same_as_before || (built_anyway && was_quiet) : was_quiet;
    if (!same_as_before && placed.kind != PlacedGeometry::kEmpty) placed.changed = flat_commits;
    is_flat[i] = stands && single && same_as_before;
    wanted[i] = single && (!still || (record.mesh->triangle_count() <= kMostStillTriangles && (!flat_chosen || quiet)));
    if (is_flat[i]) kept_triangles += record.mesh->triangle_count();
    all_kept &= is_flat[i] == wanted[i] && is_flat[i] == stands;
  }
  const bool keep = still ? flat_chosen && 2 * kept_triangles >= flat_triangles : all_kept;
  flat_chosen = true;
  if (keep) return;
  drop_flat();
  is_flat = wanted;
}

void RayCaster::State::build_flat(const Scene& scene, const std::vector<bool>& is_flat) {
  if (std::find(is_flat.begin(), is_flat.end(), true) == is_flat.end()) return;
  const auto records = scene.instances();
  flat = rtcNewScene(device);
  rtcSetSceneFlags(flat, kSceneFlags);
  flat_triangles = 0;
  std::vector<uint32_t> members;
  for (uint32_t index = 0; index < records.size(); ++index)
    if (is_flat[index]) {
      detach(index);
      members.push_back(index);
      flat_triangles += records[index].mesh->triangle_count();
    }
  parallel_blocks(members.size(), 1, [&](size_t begin, size_t end) {
    for (size_t m = begin; m < end; ++m) {
      const InstanceRecord& record = records[members[m]];
      PlacedGeometry& placed = places[members[m]];
      placed = {PlacedGeometry::kFlat, flat_geometry(*record.mesh, record.to_world),
                record.mesh_handle,    record.visibility,
                placed.changed,        record.to_world};
      rtcSetGeometryMask(placed.geometry, record.visibility);
      rtcCommitGeometry(placed.geometry);
    }
  });
  for (const uint32_t index : members) rtcAttachGeometryByID(flat, places[index].geometry, index);
  rtcCommitScene(flat);
  flat_instance = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_INSTANCE);
  rtcSetGeometryInstancedScene(flat_instance, flat);
  const Affine here;
  rtcSetGeometryTransform(flat_instance, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, &here);
  rtcSetGeometryMask(flat_instance, ~0u);
  rtcCommitGeometry(flat_instance);
  rtcAttachGeometryByID(top, flat_instance, kFlatId);
}

/// Brings all places that are not in the common BVH in step with the records.
void RayCaster::State::place_instances(const Scene& scene, const std::vector<bool>& is_flat,
                                       const std::set<Handle>& changed) {
  const auto records = scene.instances();
  for (uint32_t index = 0; index < records.size(); ++index) {
    const InstanceRecord& record = records[index];
    PlacedGeometry& placed = places[index];
    if (is_flat[index]) {
      if (placed.visibility != record.visibility) rtcSetGeometryMask(placed.geometry, record.visibility);
      placed.visibility = record.visibility;
      continue;
    }
    if (!record.mesh || record.mesh->triangles.empty()) {
      detach(index);
      continue;
    }
    const bool anew = placed.kind != PlacedGeometry::kInstance || placed.mesh != record.mesh_handle;
    if (!anew && !changed.contains(record.mesh_handle) && same(placed.to_world, record.to_world) &&
        placed.visibility == record.visibility)
      continue;
    if (anew) {
      detach(index);
      placed.geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_INSTANCE);
      rtcAttachGeometryByID(top, placed.geometry, index + 1);
    }
    placed = {PlacedGeometry::kInstance, placed.geometry, record.mesh_handle,
              record.visibility,         placed.changed,  record.to_world};
    static_assert(sizeof(Affine) == 48);
    rtcSetGeometryInstancedScene(placed.geometry, meshes.at(record.mesh_handle)->scene);
    rtcSetGeometryTransform(placed.geometry, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, &record.to_world);
    rtcSetGeometryMask(placed.geometry, record.visibility);
    rtcCommitGeometry(placed.geometry);
  }
}

std::string ray_library_version() { return RTC_VERSION_STRING; }

RayCaster::RayCaster() : state_(std::make_unique<State>()) {}
RayCaster::~RayCaster() = default;

namespace {

bool touches_geometry(const SceneChanges& c) {
  return c.everything || c.origin || !c.meshes_added.empty() || !c.meshes_deformed.empty() ||
         !c.meshes_replaced.empty() || !c.meshes_removed.empty() || !c.instances_added.empty() ||
         !c.instances_edited.empty() || !c.instances_moved.empty() || !c.instances_removed.empty();
}

}  // namespace

void RayCaster::commit(const Scene& scene, const SceneChanges& changes, Options options) {
  State& s = *state_;
  if (!touches_geometry(changes) && options.flatten == s.options.flatten) return;
  const FlushDenormals flush;
  if (options.flatten != s.options.flatten) s.flat_chosen = false;
  s.options = options;
  if (changes.everything) s.clear();
  const auto records = scene.instances();
  const std::set<Handle> replaced(changes.meshes_replaced.begin(), changes.meshes_replaced.end());
  std::set<Handle> changed = replaced;
  changed.insert(changes.meshes_deformed.begin(), changes.meshes_deformed.end());
  for (uint32_t index = uint32_t(records.size()); index < s.places.size(); ++index) s.detach(index);

  s.places.resize(records.size());
  std::vector<bool> is_flat;
  s.choose_flat(scene, replaced, changed, is_flat);
  std::set<Handle> instanced, rebuild, refit;
  for (size_t i = 0; i < records.size(); ++i)
    if (records[i].mesh && !is_flat[i] && !records[i].mesh->triangles.empty()) instanced.insert(records[i].mesh_handle);
  for (const Handle handle : instanced)
    if (!s.meshes.contains(handle)) rebuild.insert(handle);
  for (const Handle handle : changes.meshes_replaced)
    if (instanced.contains(handle)) rebuild.insert(handle);
  for (const Handle handle : changes.meshes_deformed)
    if (instanced.contains(handle) && !rebuild.contains(handle)) refit.insert(handle);
  s.build_meshes(scene, rebuild, refit);
  if (!s.flat) s.build_flat(scene, is_flat);
  s.place_instances(scene, is_flat, changed);
  std::erase_if(s.meshes, [&](const auto& entry) { return !instanced.contains(entry.first); });
  s.root = instanced.empty() && s.flat ? s.flat : s.top;
  rtcCommitScene(s.top);  // at once done when nothing there changed
  s.throw_on_error("building the BVH of the scene");
}

size_t RayCaster::bytes() const { return size_t(std::max<int64_t>(0, state_->device_bytes)); }

}  // namespace afterglow
