// SPDX-License-Identifier: GPL-3.0-or-later
// The BVH of one mesh: built, and refitted while it deforms until its boxes have become loose.
#include <algorithm>
#include <cstring>

#include "base/parallel.h"
#include "rays/ray_caster_state.h"

namespace afterglow {

namespace {

constexpr uint32_t kMostRefits = 64;  // then the BVH is built anew
constexpr float kMostGrowth = 2.0f;   // of the bounds' surface since the last build

float half_area(const Box& box) {
  if (box.empty()) return 0.0f;
  const Vec3 s = box.size();
  return s.x * s.y + s.y * s.z + s.z * s.x;
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

RTCGeometry RayCaster::State::triangles_of(const Mesh& mesh) const {
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, mesh.triangles.data(), 0, 12,
                             mesh.triangle_count());
  rtcSetGeometryMask(geometry, ~0u);  // Embree 3 and 4 differ in what is there otherwise
  return geometry;
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
        bvh->geometry = triangles_of(*mesh);
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
  RTCGeometry geometry = triangles_of(mesh);
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

}  // namespace afterglow
