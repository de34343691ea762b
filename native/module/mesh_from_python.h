// SPDX-License-Identifier: GPL-3.0-or-later
// Keyword arguments of add_mesh and set_mesh to a Mesh.
#pragma once

#include "module/bindings.h"

namespace afterglow {

/// All arrays of a new mesh. Copies without the GIL. Throws InvalidInput with the mesh's and the array's name.
Mesh mesh_from_python(const py::dict& arguments, const std::string& name);

/// True when the arguments only move vertices: positions, normals and what goes with them.
bool only_deforms(const py::dict& arguments);

struct Deformation {
  std::vector<Vec3> positions, corner_normals, vertex_normals;
};
Deformation deformation_from_python(const py::dict& arguments, const std::string& name);

}  // namespace afterglow
