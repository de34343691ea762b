// SPDX-License-Identifier: GPL-3.0-or-later
// The questions of Python's Scene and the module's functions about itself; the parts of the HashCache.
#pragma once

#include "module/bindings.h"

namespace afterglow {

void bind_cells(py::module_&);
void bind_queries(py::module_&, py::class_<PyScene, std::shared_ptr<PyScene>>&);

}  // namespace afterglow
