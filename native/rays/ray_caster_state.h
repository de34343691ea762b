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

/// What stands at one place of the top level.
struct PlacedGeometry {
  enum Kind : uint8_t { kEmpty, kInstance, kFlat };
  Kind kind = kEmpty;
  RTCGeometry geometry = nullptr;
  Handle mesh = 0;
  uint32_t visibility = 0;
  Affine to_world;
};

struct RayCaster::State {
  RTCDevice device = nullptr;
  RTCScene top = nullptr;
  std::unordered_map<Handle, std::unique_ptr<MeshBvh>> meshes;
  std::vector<PlacedGeometry> places;
  std::atomic<int64_t> device_bytes{0};
  std::mutex error_lock;
  RTCError error = RTC_ERROR_NONE;
  std::string error_text;

  State();
  ~State();
  void throw_on_error(const std::string& doing);
  void clear();
  void build_meshes(const Scene&, const std::set<Handle>& rebuild, const std::set<Handle>& refit);
  bool place(const Scene&, const std::vector<bool>& flat, const std::set<Handle>& changed);
  void detach(uint32_t index);
  RTCGeometry flat_geometry(const Mesh&, const Affine&) const;
  std::vector<bool> choose_flat(const Scene&, const Options&) const;
};

}  // namespace afterglow
