// SPDX-License-Identifier: GPL-3.0-or-later
// From a node graph to a program: nodes in dependency order, what needs no hit computed at once, closures collected
// with their weights from the root down, what nobody reads dropped, registers shared.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "materials/program.h"
#include "scene/graph.h"

namespace afterglow {

/// What the compiler asks of its surroundings.
struct CompileHost {
  /// Number of an image; kNone: none such (magenta).
  std::function<uint32_t(int64_t handle)> image;
  std::function<uint32_t(const std::string& name)> attribute;  // a number for a mesh attribute or UV map of this name
  std::function<void(const std::string& text)> warn;           // may be called often with the same text
  bool fold = true;                                            // off: everything runs at the hit (tests)
};

enum class ProgramKind { kSurface, kTransparency, kEmission };

Program compile(const Graph&, ProgramKind, const CompileHost&);

}  // namespace afterglow
