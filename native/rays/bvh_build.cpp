// SPDX-License-Identifier: GPL-3.0-or-later
// Building and mending the two-level BVH: one scene a mesh, one place of the top level an instance. A moved instance
// rebuilds the top level alone; a deformed mesh is refitted until its boxes have become loose.
#include <algorithm>
#include <cstring>
#include <exception>

#include "base/errors.h"
#include "base/parallel.h"
#include "rays/ray_caster_state.h"

namespace afterglow {

namespace {

constexpr uint32_t kMostRefits = 64;                          // then the BVH is built anew
constexpr float kMostGrowth = 2.0f;                           // of the bounds' surface since the last build
constexpr RTCSceneFlags kSceneFlags = RTC_SCENE_FLAG_ROBUST;  // watertight: thin walls must not leak

float half_area(const Box& box) {
  if (box.empty()) return 0.0f;
  const Vec3 s = box.size();
  return s.x * s.y + s.y * s.z + s.z * s.x;
}

bool same(const Affine& a, const Affine& b) { return a.x == b.x && a.y == b.y && a.z == b.z && a.p == b.p; }

RTCGeometry triangles_of(RTCDevice device, const Mesh& mesh) {
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, mesh.triangles.data(), 0, 12,
                             mesh.triangle_count());
  rtcSetGeometryMask(geometry, ~0u);
  return geometry;
}

void share_positions(RTCGeometry geometry, const Mesh& mesh) {
  rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, mesh.positions.data(), 0, 12,
                             mesh.positions.size());
}

}  // namespace

MeshBvh::~MeshBvh() {
  if (geometry) rtcReleaseGeometry(geometry);
  if (scene) rtcReleaseScene(scene);
}

RayCaster::State::State() : device(rtcNewDevice(nullptr)) {
  if (!device) throw Error("Embree cannot be started: error " + std::to_string(rtcGetDeviceError(nullptr)));
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
  rtcSetDeviceMemoryMonitorFunction(
      device,
      [](void* self, ssize_t bytes, bool) {
        static_cast<State*>(self)->device_bytes += bytes;
        return true;
      },
      this);
  top = rtcNewScene(device);
  rtcSetSceneFlags(top, kSceneFlags);
  rtcCommitScene(top);
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

void RayCaster::State::detach(uint32_t index) {
  PlacedGeometry& placed = places[index];
  if (placed.geometry) {
    rtcDetachGeometry(top, index);
    rtcReleaseGeometry(placed.geometry);
  }
  placed = PlacedGeometry{};
}

void RayCaster::State::clear() {
  for (uint32_t index = 0; index < places.size(); ++index) detach(index);
  places.clear();
  meshes.clear();
}

/// Which places hold their mesh's triangles themselves: those whose mesh nobody else uses, when asked for.
std::vector<bool> RayCaster::State::choose_flat(const Scene& scene, const Options& options) const {
  const auto records = scene.instances();
  std::vector<bool> flat(records.size(), false);
  if (!options.flatten) return flat;
  std::unordered_map<Handle, uint32_t> users;
  for (const InstanceRecord& record : records)
    if (record.mesh) ++users[record.mesh_handle];
  for (size_t i = 0; i < records.size(); ++i) flat[i] = records[i].mesh && users[records[i].mesh_handle] == 1;
  return flat;
}

void RayCaster::State::build_meshes(const Scene& scene, const std::set<Handle>& rebuild,
                                    const std::set<Handle>& refit) {
  struct Job {
    const Mesh* mesh;
    MeshBvh* bvh;
    bool refit;
  };
  std::vector<Job> jobs;
  for (const Handle handle : rebuild) {
    auto& bvh = meshes[handle] = std::make_unique<MeshBvh>();
    jobs.push_back({&scene.mesh(handle), bvh.get(), false});
  }
  for (const Handle handle : refit)
    if (!rebuild.contains(handle)) jobs.push_back({&scene.mesh(handle), meshes.at(handle).get(), true});
  // Large meshes first, so that no thread is left with one at the end.
  std::stable_sort(jobs.begin(), jobs.end(),
                   [](const Job& a, const Job& b) { return a.mesh->triangles.size() > b.mesh->triangles.size(); });
  parallel_blocks(jobs.size(), 1, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      const auto& [mesh, bvh, again] = jobs[i];
      if (!bvh->scene) {
        bvh->scene = rtcNewScene(device);
        rtcSetSceneFlags(bvh->scene, kSceneFlags);
      }
      const bool loose =
          again && (bvh->refits >= kMostRefits || half_area(mesh->bounds) > kMostGrowth * bvh->first_area);
      if (again && bvh->refitting && !loose) {
        rtcUpdateGeometryBuffer(bvh->geometry, RTC_BUFFER_TYPE_VERTEX, 0);
        ++bvh->refits;
      } else {
        if (bvh->geometry) {
          rtcDetachGeometry(bvh->scene, 0);
          rtcReleaseGeometry(bvh->geometry);
        }
        bvh->geometry = triangles_of(device, *mesh);
        share_positions(bvh->geometry, *mesh);
        if (again) {  // it moves: from now on a BVH that can follow
          rtcSetSceneFlags(bvh->scene, RTCSceneFlags(kSceneFlags | RTC_SCENE_FLAG_DYNAMIC));
          rtcSetSceneBuildQuality(bvh->scene, RTC_BUILD_QUALITY_LOW);
          rtcSetGeometryBuildQuality(bvh->geometry, RTC_BUILD_QUALITY_REFIT);
        }
        bvh->refitting = again;
        bvh->refits = 0;
        bvh->first_area = half_area(mesh->bounds);
        rtcAttachGeometryByID(bvh->scene, bvh->geometry, 0);
      }
      rtcCommitGeometry(bvh->geometry);
      rtcCommitScene(bvh->scene);
    }
  });
  throw_on_error("building the BVH of a mesh");
}

RTCGeometry RayCaster::State::flat_geometry(const Mesh& mesh, const Affine& to_world) const {
  RTCGeometry geometry = triangles_of(device, mesh);
  if (same(to_world, Affine{})) {
    share_positions(geometry, mesh);
    return geometry;
  }
  auto* vertices = static_cast<float*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, mesh.positions.size()));
  if (!vertices) return geometry;  // the error function knows
  for (size_t v = 0; v < mesh.positions.size(); ++v) {
    const Vec3 p = to_world.point(mesh.positions[v]);
    std::memcpy(vertices + 3 * v, &p.x, 12);
  }
  return geometry;
}

/// Brings the top level in step with the records; true when anything there changed.
bool RayCaster::State::place(const Scene& scene, const std::vector<bool>& flat, const std::set<Handle>& changed) {
  const auto records = scene.instances();
  bool any = false;
  for (uint32_t index = uint32_t(records.size()); index < places.size(); ++index) {
    any |= places[index].geometry != nullptr;
    detach(index);
  }
  places.resize(records.size());
  for (uint32_t index = 0; index < records.size(); ++index) {
    const InstanceRecord& record = records[index];
    PlacedGeometry& placed = places[index];
    const auto kind = !record.mesh || record.mesh->triangles.empty() ? PlacedGeometry::kEmpty
                      : flat[index]                                  ? PlacedGeometry::kFlat
                                                                     : PlacedGeometry::kInstance;
    const bool mesh_changed = kind != PlacedGeometry::kEmpty && changed.contains(record.mesh_handle);
    const bool moved = kind != PlacedGeometry::kEmpty && !same(placed.to_world, record.to_world);
    const bool anew = placed.kind != kind || placed.mesh != (kind ? record.mesh_handle : 0) ||
                      (kind == PlacedGeometry::kFlat && (mesh_changed || moved));
    if (!anew && kind == PlacedGeometry::kEmpty) continue;
    if (!anew && !moved && !mesh_changed && placed.visibility == record.visibility) continue;
    any = true;
    if (anew) {
      detach(index);
      if (kind == PlacedGeometry::kEmpty) continue;
      placed.geometry = kind == PlacedGeometry::kFlat ? flat_geometry(*record.mesh, record.to_world)
                                                      : rtcNewGeometry(device, RTC_GEOMETRY_TYPE_INSTANCE);
      rtcAttachGeometryByID(top, placed.geometry, index);
      placed.kind = kind;
      placed.mesh = record.mesh_handle;
    }
    if (kind == PlacedGeometry::kInstance) {
      static_assert(sizeof(Affine) == 48);
      rtcSetGeometryInstancedScene(placed.geometry, meshes.at(record.mesh_handle)->scene);
      rtcSetGeometryTransform(placed.geometry, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, &record.to_world);
    }
    rtcSetGeometryMask(placed.geometry, record.visibility);
    placed.to_world = record.to_world;
    placed.visibility = record.visibility;
    rtcCommitGeometry(placed.geometry);
  }
  return any;
}

std::string ray_library_version() { return RTC_VERSION_STRING; }

RayCaster::RayCaster() : state_(std::make_unique<State>()) {}
RayCaster::~RayCaster() = default;

void RayCaster::commit(const Scene& scene, const SceneChanges& changes, Options options) {
  State& s = *state_;
  const FlushDenormals flush;
  if (changes.everything) s.clear();
  const std::vector<bool> flat = s.choose_flat(scene, options);
  std::set<Handle> changed(changes.meshes_replaced.begin(), changes.meshes_replaced.end());
  std::set<Handle> rebuild, refit;
  for (const Handle handle : changes.meshes_deformed) changed.insert(handle);
  std::set<Handle> instanced;
  const auto records = scene.instances();
  for (size_t i = 0; i < records.size(); ++i)
    if (records[i].mesh && !flat[i] && !records[i].mesh->triangles.empty()) instanced.insert(records[i].mesh_handle);
  for (const Handle handle : changes.meshes_replaced)
    if (instanced.contains(handle)) rebuild.insert(handle);
  for (const Handle handle : instanced)
    if (!s.meshes.contains(handle)) rebuild.insert(handle);
  for (const Handle handle : changes.meshes_deformed)
    if (instanced.contains(handle) && !rebuild.contains(handle)) refit.insert(handle);
  s.build_meshes(scene, rebuild, refit);
  const bool any = s.place(scene, flat, changed);
  std::erase_if(s.meshes, [&](const auto& entry) { return !instanced.contains(entry.first); });
  if (any) rtcCommitScene(s.top);
  s.throw_on_error("building the BVH of the scene");
}

size_t RayCaster::bytes() const { return size_t(std::max<int64_t>(0, state_->device_bytes)); }

}  // namespace afterglow
