// SPDX-License-Identifier: GPL-3.0-or-later
// HashCache (Roth, Weier, Bauszat, Hinkenjann and Li 2020): the light that arrives in the cells of a hierarchy of
// grids, gathered by a few paths a frame and kept while the camera walks, read again in constant time. Cells are made
// when they are first needed.
#pragma once

#include "methods/method.h"

namespace afterglow::hash_cache {

MethodDescription describe();
std::unique_ptr<IndirectMethod> make();

}  // namespace afterglow::hash_cache
