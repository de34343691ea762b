// SPDX-License-Identifier: GPL-3.0-or-later
// What a RayCaster holds: Embree's device and scenes. Internal to native/rays.
#pragma once

#include <atomic>
#include <mutex>
#include <set>
#include <string>
#include <unordered_map>

#include "rays/embree.h"
#include "rays/ray_caster.h"

namespace afterglow {

/// The BVH of one mesh, for the instances that share it.
struct MeshBvh {
  RTCScene scene = nullptr;
  RTCGeometry geometry = nullptr;
  uint32_t refits = 0;      // since the last build from nothing
  bool refitting = false;   // built so that it can be refitted
  float first_area = 0.0f;  // half surface of the bounds when it was built
  ~MeshBvh();
};

/// What stands at one place, that is, at one dense instance index.
struct PlacedGeometry {
  enum Kind : uint8_t { kEmpty, kInstance, kFlat };
  Kind kind = kEmpty;
  RTCGeometry geometry = nullptr;  // of the top level (kInstance) or of the common BVH (kFlat)
  Handle mesh = 0;
  uint32_t visibility = 0;
  uint32_t changed = 0;  // State::flat_commits when its mesh or place changed last
  Affine to_world;
};

/// The common BVH of flattened meshes has the id 0 in the top level, the instance at place i the id i + 1. In the
/// common BVH, the id is the place.
inline constexpr uint32_t kFlatId = 0;
/// Flatten::kStill: what changed within so many commits is not built into a new common BVH, because it may go on so.
inline constexpr uint32_t kQuietCommits = 8;
/// Flatten::kStill: larger meshes have a BVH of their own from the beginning, so that their first move is instant, too.
inline constexpr size_t kMostStillTriangles = 100'000;

struct RayCaster::State {
  RTCDevice device = nullptr;
  size_t together = 4;  // rays that one vector of this processor holds
  RTCScene top = nullptr;
  RTCScene flat = nullptr;              // common BVH, or none
  RTCGeometry flat_instance = nullptr;  // it in the top level
  RTCScene root = nullptr;  // where rays start: the top level, or the common BVH where there is nothing else
  std::unordered_map<Handle, std::unique_ptr<MeshBvh>> meshes;
  std::vector<PlacedGeometry> places;
  uint64_t flat_triangles = 0;  // when the common BVH was built
  uint32_t flat_commits = kQuietCommits;
  bool flat_chosen = false;  // a common BVH was looked for in this mode
  Options options;
  std::atomic<int64_t> device_bytes{0};
  std::mutex error_lock;
  RTCError error = RTC_ERROR_NONE;
  std::string error_text;

  State();
  ~State();
  void throw_on_error(const std::string& doing);
  void clear();

  // mesh_bvh.cpp
  RTCGeometry triangles_of(const Mesh&) const;
  RTCGeometry flat_geometry(const Mesh&, const Affine&) const;
  void build_meshes(const Scene&, const std::set<Handle>& rebuild, const std::set<Handle>& refit);

  // bvh_build.cpp
  void choose_flat(const Scene&, const std::set<Handle>& replaced, const std::set<Handle>& changed,
                   std::vector<bool>& is_flat);
  void drop_flat();
  void build_flat(const Scene&, const std::vector<bool>& is_flat);
  void place_instances(const Scene&, const std::vector<bool>& is_flat, const std::set<Handle>& changed);
  void detach(uint32_t index);
};

constexpr RTCSceneFlags kSceneFlags = RTC_SCENE_FLAG_ROBUST;  // watertight: a fifth slower, but walls must not leak

inline bool same(const Affine& a, const Affine& b) { return a.x == b.x && a.y == b.y && a.z == b.z && a.p == b.p; }

}  // namespace afterglow
