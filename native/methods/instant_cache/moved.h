// SPDX-License-Identifier: GPL-3.0-or-later
// Which objects may stand otherwise between two points than they did, found by comparing what was placed then and is
// now: moved, turned, scaled, deformed, added, deleted, hidden, re-instanced, with other materials in the way of light.
// Each has its old and its new bounds, in its own space, so that a turned box stays tight.
#pragma once

#include <memory>
#include <unordered_map>

#include "transport/committed_scene.h"

namespace afterglow::instant_cache {

/// Boxes around the parts of a mesh, in its own space, a column for each plane, padded to a multiple of eight.
struct Parts {
  std::vector<float> lower[3], upper[3];
};

/// A box in an object's space. Empty: the object was not there.
struct Bounds {
  Affine to_object;
  Box box;                             // widened a little, against rounding
  Box world;                           // around it
  std::shared_ptr<const Parts> parts;  // null: none were made
  bool present() const { return !box.empty(); }
};

struct Moved {
  uint32_t instance = kNone;  // dense index
  Bounds before, after;
  bool keeps_places = false;  // the same triangles, elsewhere: places on them can follow
  bool in_place = false;      // nothing but what light passes changed
};

class Placement {
 public:
  void clear() { objects_.clear(); }
  /// Compares with the scene of the last call and remembers the scene of this one.
  std::vector<Moved> update(const CommittedScene&, const SceneChanges&);

 private:
  struct Object {
    Handle handle = 0, mesh = 0;
    Affine to_world;
    Bounds bounds;
    uint32_t visibility = 0;
    bool lets_light_through = false;
    std::vector<uint32_t> materials;
  };
  std::vector<Object> objects_;
};

/// One bit a light: whether the way from the point to it may cross the box. Light positions in world space. slack: how
/// far from both ends, in world space, the ray may really begin and end.
void crossing(const Bounds&, const Vec3& from, float slack, const float* x, const float* y, const float* z,
              uint32_t count, uint64_t* bits);

/// Whether the way from the point to another may cross a part of the object; true where it has none.
bool crosses_parts(const Bounds&, const Vec3& from, const Vec3& to, float slack);

/// One bit a light: whether any way from the box `from` to it may cross the box `moved`, in world space.
void crossing_from_box(const Box& moved, const Box& from, const float* x, const float* y, const float* z,
                       uint32_t count, uint64_t* bits);

}  // namespace afterglow::instant_cache
