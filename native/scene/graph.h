// SPDX-License-Identifier: GPL-3.0-or-later
// A node graph as the module receives it: what a material, a world or a light is made of, before it is compiled
// (python/afterglow/_native.pyi lists the node types). Plain data; materials/compiler turns it into a program.
#pragma once

#include <map>
#include <string>
#include <variant>
#include <vector>

#include "base/math.h"

namespace afterglow {

struct Link {
  uint32_t node = kNone;
  std::string output;
  bool operator==(const Link&) const = default;
};

using InputValue = std::variant<float, Vec3, Link>;

/// A parameter: text, number, flag or table (flat, row-major; its width is known by the node type).
using Param = std::variant<std::monostate, bool, int64_t, double, std::string, std::vector<float>>;

struct Node {
  std::string type, name;
  std::map<std::string, InputValue> inputs;
  std::map<std::string, Param> params;
  bool operator==(const Node&) const = default;
};

struct Graph {
  std::vector<Node> nodes;
  Link surface;  // node == kNone: black, nothing emitted
  bool operator==(const Graph&) const = default;
};

}  // namespace afterglow
