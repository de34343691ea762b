// SPDX-License-Identifier: GPL-3.0-or-later
// Where light matters to the camera: how much importance, the light's adjoint (Veach 1997, section 4.6), that diffuse
// surfaces near the camera send out passes through each cell of a coarse grid. Light paths of suns and skies begin with
// rays through places where there is much of it, for most of all their rays end on roofs. It depends on forms and
// places alone, not on colours, and on the camera's place to within a grid of its own, so that lights stay where they
// are while a view turns or goes a step.
#pragma once

#include <vector>

#include "transport/path_walker.h"

namespace afterglow {

/// What the importance is measured from: the camera's place, snapped to a grid's point that it sees.
struct Viewpoint {
  Vec3 position{0.0f}, center{0.0f};  // center and radius of the scene's ball
  float radius = 0.0f;
  bool operator==(const Viewpoint&) const = default;
};
Viewpoint snapped_viewpoint(const CommittedScene&);

class LightImportance {
 public:
  /// Traces a few thousand rays. Where these say too little, it stays empty: every place counts the same.
  void build(const WalkScene&, const Viewpoint&, uint32_t threads, RayCounts&);
  bool empty() const { return chance_.empty(); }
  /// A place in the scene's air for a path, with a density in proportion to importance: the first of its own even
  /// places that is taken, so that where importance changes a little, nearly all paths keep theirs. False: none was.
  bool sample(uint32_t seed, uint32_t path, Vec3& place) const;
  /// The integral of that density along a line: how dense lines through sampled places are, an area across them.
  float along(const Vec3& origin, const Vec3& direction, float length) const;

  /// How much light matters on a surface, on the side of its normal: 1, 1/2, 1/4.
  float at(const Vec3& position, const Vec3& normal) const;

 private:
  size_t cell(const Vec3&) const;
  std::vector<float> chance_;   // to be taken, of each cell: 1, 1/4, …
  std::vector<float> reached_;  // what at() says
  float density_ = 0.0f;        // a volume, where the chance is 1
  Vec3 lower_{0.0f};
  float size_ = 1.0f;  // of a cell
};

}  // namespace afterglow
