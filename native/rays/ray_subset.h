// SPDX-License-Identifier: GPL-3.0-or-later
// Some of a scene's objects by themselves: what was seen before these moved can be hidden by nothing else, and a ray
// through them alone is cheaper than one through everything (Debattista et al. 2009: only objects that moved are
// tested).
#pragma once

#include <memory>
#include <span>

#include "rays/ray_caster.h"

namespace afterglow {

class RaySubset {
 public:
  /// Good until the caster's next commit. Several thousand objects are not worth the while: see complete().
  RaySubset(const RayCaster&, std::span<const uint32_t> instances);
  ~RaySubset();
  RaySubset(const RaySubset&) = delete;
  /// False: some of the objects stand in the common BVH and have none of their own. Then occluded() may not be asked.
  bool complete() const { return complete_; }
  bool occluded(const Ray&) const;

 private:
  void* scene_ = nullptr;
  bool complete_ = true;
};

}  // namespace afterglow
