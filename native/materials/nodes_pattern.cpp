// SPDX-License-Identifier: GPL-3.0-or-later
// Procedural texture nodes as instructions.
#include "materials/emitter.h"

namespace afterglow {

void register_pattern_nodes(std::unordered_map<std::string, Handler>&) {}

}  // namespace afterglow
