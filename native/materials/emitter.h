// SPDX-License-Identifier: GPL-3.0-or-later
// What node handlers use to write a program: typed inputs with Blender's implicit conversions, parameters with
// defaults, instructions that are computed at once when nothing of the hit is read.
#pragma once

#include <unordered_map>

#include "materials/compiler.h"

namespace afterglow {

enum class Type : uint8_t { kFloat, kColor, kVector, kClosure };

/// A value of the program that is being written: a virtual register or a constant.
struct Operand {
  static constexpr uint32_t kConstant = 0x80000000u;
  uint32_t index = kNone;
  bool none() const { return index == kNone; }
  bool constant() const { return index != kNone && (index & kConstant); }
};

struct Output {
  std::string name;
  Type type;
  Operand value;
};

struct Draft {  // an instruction before its registers are known
  Op op;
  uint32_t out[2] = {kNone, kNone};
  std::vector<Operand> inputs;
  std::vector<uint32_t> params;
};

class Emitter {
 public:
  Emitter(const Graph& graph, ProgramKind kind, const CompileHost& host) : graph(graph), kind(kind), host(host) {}

  // For handlers: the current node.
  const Node& node() const { return graph.nodes[current]; }
  uint32_t offset() const { return current_offset; }  // 0, or 1 and 2 inside a bump's height
  bool linked(const char* name) const;
  Operand input(const char* name, Type type, const Vec3& missing);
  Operand input(const char* name, Type type, float missing) { return input(name, type, Vec3(missing)); }
  /// The operand of a linked input, or none.
  Operand linked_input(const char* name, Type type);
  /// A bump's height at one of the three points.
  Operand input_at(const char* name, Type type, uint32_t offset, float missing);
  std::string text(const char* name, const char* missing) const;
  double number(const char* name, double missing) const;
  bool flag(const char* name, bool missing) const;
  const std::vector<float>* table(const char* name) const;
  void warn(const std::string& text) const;
  /// 1: what the node meant before Blender 4.0.
  uint32_t version() const { return number("version", 2) == 1 ? 1u : 2u; }

  Operand constant(const Vec3&);
  Operand constant(float v) { return constant(Vec3(v)); }
  Vec3 value_of(Operand o) const { return constants[o.index & ~Operand::kConstant]; }
  Operand emit(Op, std::vector<Operand> inputs, std::vector<uint32_t> params = {});
  std::pair<Operand, Operand> emit2(Op, std::vector<Operand> inputs, std::vector<uint32_t> params = {});
  Operand convert(Operand, Type from, Type to);
  void output(const char* name, Type type, Operand value);
  uint32_t attribute(const std::string& name) { return host.attribute ? host.attribute(name) : kNone; }
  static uint32_t bits(float v) { return std::bit_cast<uint32_t>(v); }

  Program build();

  const Graph& graph;
  ProgramKind kind;
  const CompileHost& host;
  std::vector<Vec3> constants;
  std::vector<Draft> drafts;
  uint32_t next_register = 0;
  uint32_t current = 0, current_offset = 0;
  bool reads_offsets = false;
  float offset_scale = 1.0f;
  bool washed = false;
  uint32_t closure_effects = 0;

 private:
  using Key = uint64_t;  // node and offset
  static Key key(uint32_t node, uint32_t offset) { return uint64_t(node) * 4 + offset; }
  void order_nodes();
  void write_values();
  void write_closures();
  void write_closure(Operand weight);
  void write_principled(Operand weight);
  void closure(Op, std::vector<Operand> inputs, std::vector<uint32_t> params = {});
  uint32_t distribution(const char* missing) const;
  Operand resolve(const Link&, Type, uint32_t offset, bool& found);
  Program lower();

  std::unordered_map<Key, std::vector<Output>> outputs_;
  std::vector<Key> order_;  // dependencies first
  std::map<std::string, uint32_t> constant_numbers_;
};

using Handler = void (*)(Emitter&);
/// Value nodes by type; null: unknown.
Handler find_handler(const std::string& type);
bool is_closure(const std::string& type);
std::unordered_map<std::string, Handler>& handlers();
void register_math_nodes(std::unordered_map<std::string, Handler>&);
void register_input_nodes(std::unordered_map<std::string, Handler>&);
void register_texture_nodes(std::unordered_map<std::string, Handler>&);
void register_pattern_nodes(std::unordered_map<std::string, Handler>&);
/// Where a texture looks when nothing is linked: generated coordinates, or the UV map; then the node's own mapping.
Operand texture_coordinates(Emitter&, bool uv);

}  // namespace afterglow
