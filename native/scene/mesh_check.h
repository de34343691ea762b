// SPDX-License-Identifier: GPL-3.0-or-later
// Looks at a mesh from outside before anything is built from it: what cannot be rendered is taken out, what contradicts
// itself is refused. One pass over each array, at the speed of memory.
#pragma once

#include "scene/tables.h"

namespace afterglow {

/// A triangle that was made harmless (three equal corners: no area, no ray meets it) and what it was.
struct DroppedTriangle {
  uint32_t triangle = 0;
  uint32_t vertices[3] = {};
};

struct MeshRepairs {
  std::vector<DroppedTriangle> dropped;
  std::vector<std::string> warnings;
};

/// Throws InvalidInput with the mesh's and the array's name where sizes do not fit together. Sets bounds; takes out
/// triangles with indices out of range or non-finite vertices and drops arrays of normals that hold non-finite values
/// only where they do.
MeshRepairs check_mesh(Mesh&);

/// The same for new positions and normals of a mesh whose topology stays: first puts back what was dropped before.
MeshRepairs check_deformed(Mesh&, const std::vector<DroppedTriangle>& dropped_before);

/// How far a checked mesh differs from another one.
enum class MeshDifference : uint8_t { kNone, kShape /* places and normals of the same triangles */, kOther };
MeshDifference mesh_difference(const Mesh&, const Mesh&);

}  // namespace afterglow
