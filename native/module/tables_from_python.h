// SPDX-License-Identifier: GPL-3.0-or-later
// Keyword arguments of Scene's methods written into rows of its tables. Each function changes only what is given, so
// that the same one serves "add" (over defaults) and "set" (over the present row).
#pragma once

#include "module/bindings.h"

namespace afterglow {

void read_image(Image&, const py::handle& source, const py::dict& arguments);
void read_material(Material&, const py::handle& graph, const py::dict& arguments);
void read_light(Light&, const py::dict& arguments);
void read_world(World&, const py::handle& graph, const py::dict& arguments);
void read_camera(Camera&, const py::dict& arguments);
/// What all instances of one call share: everything but transforms, randoms and previous transforms.
void read_instance(Instance&, const py::dict& arguments);

/// Throws InvalidInput when a keyword is not among the known ones.
void expect_keywords(const py::dict& arguments, std::initializer_list<const char*> known, const std::string& function);

}  // namespace afterglow
