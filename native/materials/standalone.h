// SPDX-License-Identifier: GPL-3.0-or-later
// One material by itself, without a scene: for tests and researchers. z is the normal.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "materials/surface.h"
#include "rays/surface_point.h"
#include "scene/graph.h"

namespace afterglow {

struct PointSetup {
  bool backfacing = false, drop_glossy = false, drop_refractive = false;
  bool fold = true, diffuse_only = false;
  uint32_t kind = PathContext::kCamera;
};

class Standalone {
 public:
  Standalone(const Graph&, const PointSetup&);
  ~Standalone();
  BsdfValue evaluate(const Vec3& outgoing, const Vec3& incoming) const;
  BsdfSample sample(const Vec3& outgoing, float u_lobe, const Vec2& u) const;
  void shade(const SurfacePoint&, Surface&) const;
  const std::vector<std::string>& warnings() const;
  bool folded() const;
  size_t instructions() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace afterglow
