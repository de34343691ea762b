// SPDX-License-Identifier: GPL-3.0-or-later
// Which objects may stand otherwise between two points than they did, found by comparing what was placed then and is
// now: moved, turned, scaled, deformed, added, deleted, hidden, re-instanced, with other materials in the way of light.
// Each has its old and its new bounds, in its own space, so that a turned box stays tight.
#pragma once

#include <memory>
#include <unordered_map>

#include "transport/committed_scene.h"
#include "transport/virtual_lights.h"

namespace afterglow::instant_cache {

/// Boxes around the parts of a mesh, in its own space: middles and half sizes, padded to a multiple of 16.
struct Parts {
  std::vector<float> middle[3], half[3];
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
  bool opaque = false;        // as it stood before, wholly
  bool opaque_now = false;    // as it stands
};

class Placement {
 public:
  void clear() { objects_.clear(); }
  /// Compares with the scene of the last call and remembers the scene of this one.
  std::vector<Moved> update(const CommittedScene&, const SceneChanges&);
  /// After update(): where objects stand that may look otherwise, or pass other light.
  std::vector<Bounds> repainted(const CommittedScene&, const SceneChanges&) const;

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

/// Which ways to lights may cross an object as it stood or stands. The lights' places are taken into its space once.
/// The segment test has no division (separating axes of box and segment; Gottschalk et al. 1996), and its roundings are
/// allowed for.
class Crossing {
 public:
  /// slack: how far from both ends, in world space, the ray may really begin and end.
  Crossing(const Bounds&, float slack, const VirtualLightColumns&);
  /// One bit a light, of those `among`: whether any way from the points within `spread` of `from` may cross the box.
  /// False: none.
  bool box(const Vec3& from, const Vec3& spread, const uint64_t* among, uint64_t* crosses) const;
  /// Of those bits, clears the ones whose way from the point itself misses every part; without parts all stay.
  void parts(const Vec3& from, uint64_t* crosses) const;

 private:
  bool meets_part(const Vec3& from, const Vec3& to, float rounding) const;
  float rounding(const Vec3& from) const;

  Affine to_object_;  // its middle is the origin
  Vec3 half_, reach_;
  const Parts* parts_;
  Vec3 middle_;
  float far_ = 0.0f;  // of the lights from the middle
  uint32_t words_;
  std::vector<float> x_, y_, z_;
};

}  // namespace afterglow::instant_cache
