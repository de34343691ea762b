// SPDX-License-Identifier: GPL-3.0-or-later
// The order of nodes, folding, liveness and registers. Nothing recurses, so that a chain of ten thousand nodes compiles
// as a short one does.
#include "materials/compiler.h"

#include <algorithm>
#include <cstring>
#include <set>

#include "materials/emitter.h"
#include "scene/effects.h"

namespace afterglow {
namespace {

bool reads_hit(Op op) { return op >= Op::kFirstHitOp && op < Op::kFirstClosure; }

const InputValue* find_input(const Node& node, const char* name) {
  const auto found = node.inputs.find(name);
  return found == node.inputs.end() ? nullptr : &found->second;
}

}  // namespace

std::unordered_map<std::string, Handler>& handlers() {
  static std::unordered_map<std::string, Handler> table = [] {
    std::unordered_map<std::string, Handler> all;
    register_math_nodes(all);
    register_input_nodes(all);
    register_texture_nodes(all);
    return all;
  }();
  return table;
}

Handler find_handler(const std::string& type) {
  const auto found = handlers().find(type);
  return found == handlers().end() ? nullptr : found->second;
}

bool Emitter::linked(const char* name) const {
  const InputValue* value = find_input(node(), name);
  return value && std::holds_alternative<Link>(*value);
}

Operand Emitter::constant(const Vec3& v) {
  const std::string bytes(reinterpret_cast<const char*>(&v), sizeof v);
  const auto [place, fresh] = constant_numbers_.try_emplace(bytes, uint32_t(constants.size()));
  if (fresh) constants.push_back(v);
  return {place->second | Operand::kConstant};
}

Operand Emitter::convert(Operand operand, Type from, Type to) {
  if (from == to || operand.none() || from == Type::kClosure || to == Type::kClosure) return operand;
  if (to == Type::kFloat) return emit(from == Type::kColor ? Op::kLuminance : Op::kAverage, {operand});
  if (from == Type::kFloat) return emit(Op::kReplicate, {operand});
  return operand;
}

Operand Emitter::resolve(const Link& link, Type type, uint32_t offset, bool& found) {
  found = false;
  if (link.node >= graph.nodes.size()) return {};
  const auto place = outputs_.find(key(link.node, offset));
  if (place == outputs_.end() || place->second.empty()) return {};
  for (const Output& output : place->second) {
    if (output.name != link.output) continue;
    found = true;
    return convert(output.value, output.type, type);
  }
  found = true;  // another name: the first output stands for it
  return convert(place->second.front().value, place->second.front().type, type);
}

Operand Emitter::input_at(const char* name, Type type, uint32_t offset, float missing) {
  const InputValue* value = find_input(node(), name);
  if (value && std::holds_alternative<Link>(*value)) {
    bool found;
    const Operand operand = resolve(std::get<Link>(*value), type, offset, found);
    if (found) return operand;
  }
  if (value && std::holds_alternative<float>(*value)) missing = std::get<float>(*value);
  return constant(missing);
}

Operand Emitter::input(const char* name, Type type, const Vec3& missing) {
  const InputValue* value = find_input(node(), name);
  if (!value) return constant(missing);
  if (const Link* link = std::get_if<Link>(value)) {
    bool found;
    const Operand operand = resolve(*link, type, current_offset, found);
    return found ? operand : constant(missing);
  }
  if (const float* number = std::get_if<float>(value)) return constant(Vec3(*number));
  const Vec3 v = std::get<Vec3>(*value);
  if (type == Type::kFloat) return constant(Vec3(v == Vec3(v.x) ? v.x : (v.x + v.y + v.z) / 3.0f));
  return constant(v);
}

Operand Emitter::linked_input(const char* name, Type type) {
  const InputValue* value = find_input(node(), name);
  const Link* link = value ? std::get_if<Link>(value) : nullptr;
  bool found = false;
  const Operand operand = link ? resolve(*link, type, current_offset, found) : Operand{};
  return found ? operand : Operand{};
}

std::string Emitter::text(const char* name, const char* missing) const {
  const auto found = node().params.find(name);
  const std::string* text = found == node().params.end() ? nullptr : std::get_if<std::string>(&found->second);
  if (!text) return missing;
  std::string lower = *text;
  for (char& c : lower) c = char(c >= 'A' && c <= 'Z' ? c + 32 : c);
  return lower;
}

double Emitter::number(const char* name, double missing) const {
  const auto found = node().params.find(name);
  if (found == node().params.end()) return missing;
  if (const double* d = std::get_if<double>(&found->second)) return *d;
  if (const int64_t* i = std::get_if<int64_t>(&found->second)) return double(*i);
  if (const bool* b = std::get_if<bool>(&found->second)) return *b ? 1.0 : 0.0;
  return missing;
}

bool Emitter::flag(const char* name, bool missing) const { return number(name, missing ? 1.0 : 0.0) != 0.0; }

const std::vector<float>* Emitter::table(const char* name) const {
  const auto found = node().params.find(name);
  return found == node().params.end() ? nullptr : std::get_if<std::vector<float>>(&found->second);
}

void Emitter::warn(const std::string& text) const {
  if (host.warn) host.warn(text);
}

Operand Emitter::emit(Op op, std::vector<Operand> inputs, std::vector<uint32_t> params) {
  return emit2(op, std::move(inputs), std::move(params)).first;
}

std::pair<Operand, Operand> Emitter::emit2(Op op, std::vector<Operand> inputs, std::vector<uint32_t> params) {
  const bool foldable = host.fold && op < Op::kFirstHitOp &&
                        std::all_of(inputs.begin(), inputs.end(), [](Operand o) { return o.none() || o.constant(); });
  Draft draft{op, {next_register, next_register + 1}, std::move(inputs), std::move(params)};
  if (!foldable) {
    next_register += 2;
    drafts.push_back(std::move(draft));
    return {{drafts.back().out[0]}, {drafts.back().out[1]}};
  }
  Program one;  // run the single instruction now
  const auto number = [&](Operand o) {
    if (o.none()) return uint32_t(kNoOperand);
    one.constants.push_back(value_of(o));
    return uint32_t(one.constants.size() - 1) | kConstantBit;
  };
  Instruction instruction{op, 0, 1, kNoOperand, kNoOperand, kNoOperand, 0};
  uint16_t* fixed[3] = {&instruction.a, &instruction.b, &instruction.c};
  for (size_t k = 0; k < draft.inputs.size(); ++k) {
    if (k < 3)
      *fixed[k] = uint16_t(number(draft.inputs[k]));
    else
      one.pool.push_back(number(draft.inputs[k]));
  }
  one.pool.insert(one.pool.end(), draft.params.begin(), draft.params.end());
  one.code.push_back(instruction);
  Vec3 registers[2] = {Vec3(0.0f), Vec3(0.0f)};
  execute(one, HitContext{}, registers, nullptr);
  return {constant(registers[0]), constant(registers[1])};
}

void Emitter::output(const char* name, Type type, Operand value) {
  outputs_[key(current, current_offset)].push_back({name, type, value});
}

/// Depth-first over links with a stack of its own; a link back into the stack closes a cycle and is cut.
void Emitter::order_nodes() {
  enum : uint8_t { kNew, kOpen, kDone };
  std::unordered_map<Key, uint8_t> state;
  struct Frame {
    Key key;
    std::vector<Key> needs;
    size_t next = 0;
  };
  const auto needs_of = [&](Key k) {
    std::vector<Key> needs;
    const Node& node = graph.nodes[k / 4];
    const uint32_t offset = uint32_t(k % 4);
    for (const auto& [name, value] : node.inputs) {
      const Link* link = std::get_if<Link>(&value);
      if (!link || link->node >= graph.nodes.size()) continue;
      if (node.type == "bump") {
        if (offset != 0 && name != "normal") continue;  // inside another bump's height: passes its normal on
        if (offset == 0 && name == "height") {
          needs.push_back(key(link->node, 1)), needs.push_back(key(link->node, 2));
          reads_offsets = true;
        }
      }
      needs.push_back(key(link->node, offset));
    }
    return needs;
  };
  if (graph.surface.node >= graph.nodes.size()) return;
  std::vector<Frame> stack;
  const Key root = key(graph.surface.node, 0);
  stack.push_back({root, needs_of(root)});
  state[root] = kOpen;
  while (!stack.empty()) {
    Frame& top = stack.back();
    if (top.next == top.needs.size()) {
      state[top.key] = kDone;
      order_.push_back(top.key);
      stack.pop_back();
      continue;
    }
    const Key need = top.needs[top.next++];
    uint8_t& seen = state[need];
    if (seen == kOpen) warn("links form a cycle at node \"" + graph.nodes[need / 4].name + "\": the link is cut");
    if (seen != kNew) continue;
    seen = kOpen;
    stack.push_back({need, needs_of(need)});
  }
}

void Emitter::write_values() {
  for (const Key k : order_) {
    current = uint32_t(k / 4), current_offset = uint32_t(k % 4);
    const Node& node = graph.nodes[current];
    if (is_closure(node.type)) continue;
    if (const Handler handler = find_handler(node.type)) {
      handler(*this);
      continue;
    }
    warn("node \"" + node.name + "\" of unknown type \"" + node.type + "\" is passed through");
    Operand stand_in{};
    for (const auto& [name, value] : node.inputs) {  // the first linked or coloured input stands for the outputs
      if (stand_in.none() ||
          (std::holds_alternative<Link>(value) && !linked_input(name.c_str(), Type::kColor).none())) {
        stand_in = input(name.c_str(), Type::kColor, 0.8f);
      }
    }
    output("", Type::kColor, stand_in.none() ? constant(0.8f) : stand_in);
  }
  current_offset = 0;
}

/// From the root down, each closure once with the sum of the weights that lead to it.
void Emitter::write_closures() {
  std::unordered_map<uint32_t, Operand> weights;
  if (graph.surface.node >= graph.nodes.size()) return;
  weights[graph.surface.node] = constant(1.0f);
  const auto give = [&](const char* input_name, Operand weight) {
    const InputValue* value = find_input(node(), input_name);
    const Link* link = value ? std::get_if<Link>(value) : nullptr;
    if (!link || link->node >= graph.nodes.size()) return;
    const auto [place, fresh] = weights.try_emplace(link->node, weight);
    if (!fresh) place->second = emit(Op::kMath, {place->second, weight, constant(0.0f)}, {0, 0});
  };
  for (size_t n = order_.size(); n-- > 0;) {
    if (order_[n] % 4 != 0) continue;
    current = uint32_t(order_[n] / 4), current_offset = 0;
    const auto place = weights.find(current);
    if (place == weights.end()) continue;
    const Operand weight = place->second;
    if (weight.constant() && !(value_of(weight).x > 0.0f)) continue;
    const std::string& type = node().type;
    if (type == "mix_shader") {
      const Operand factor = emit(Op::kClamp, {input("fac", Type::kFloat, 0.5f), constant(0.0f), constant(1.0f)}, {0});
      const Operand rest = emit(Op::kOneMinus, {factor});
      give("shader", emit(Op::kMath, {weight, rest, constant(0.0f)}, {2, 0}));
      give("shader_001", emit(Op::kMath, {weight, factor, constant(0.0f)}, {2, 0}));
    } else if (type == "add_shader") {
      give("shader", weight), give("shader_001", weight);
    } else if (is_closure(type)) {
      write_closure(weight);
    } else if (outputs_.count(key(current, 0)) && !outputs_[key(current, 0)].empty() &&
               kind != ProgramKind::kTransparency) {
      Operand color =
          convert(outputs_[key(current, 0)].front().value, outputs_[key(current, 0)].front().type, Type::kColor);
      for (const Output& output : outputs_[key(current, 0)]) {
        if (current == graph.surface.node && output.name == graph.surface.output)
          color = convert(output.value, output.type, Type::kColor);
      }
      closure(Op::kEmission, {weight, color, constant(1.0f)});
      closure_effects |= kEmissiveMesh;
    }
  }
}

Program Emitter::build() {
  order_nodes();
  write_values();
  write_closures();
  return lower();
}

/// Drops what nobody reads, then gives every live value a register until its last reader.
Program Emitter::lower() {
  Program program;
  std::vector<uint32_t> last(next_register, kNone);  // index of the last reader
  std::vector<uint8_t> keep(drafts.size(), 0);
  for (size_t k = drafts.size(); k-- > 0;) {
    const Draft& draft = drafts[k];
    const auto wanted = [&](uint32_t r) { return r != kNone && last[r] != kNone; };
    keep[k] = draft.op >= Op::kFirstClosure || wanted(draft.out[0]) || wanted(draft.out[1]);
    if (!keep[k]) continue;
    for (const Operand& o : draft.inputs) {
      if (!o.none() && !o.constant() && last[o.index] == kNone) last[o.index] = uint32_t(k);
    }
  }
  std::vector<uint16_t> place(next_register, kNoOperand);
  std::vector<uint16_t> free;
  std::vector<std::vector<uint32_t>> ends(drafts.size());
  for (uint32_t r = 0; r < next_register; ++r) {
    if (last[r] != kNone) ends[last[r]].push_back(r);
  }
  std::vector<uint32_t> constant_place(constants.size(), kNone);
  bool too_large = false;
  const auto number = [&](Operand o) -> uint32_t {
    if (o.none()) return kNoOperand;
    if (!o.constant()) return place[o.index];
    uint32_t& slot = constant_place[o.index & ~Operand::kConstant];
    if (slot == kNone) {
      slot = uint32_t(program.constants.size());
      program.constants.push_back(value_of(o));
      too_large |= slot >= kConstantBit - 1u;
    }
    return slot | kConstantBit;
  };
  const auto take = [&](uint32_t r) -> uint16_t {
    if (r == kNone || last[r] == kNone) return kNoOperand;
    if (free.empty()) {
      too_large |= program.registers >= uint32_t(kMaxRegisters);
      free.push_back(uint16_t(program.registers++));
    }
    place[r] = free.back();
    free.pop_back();
    return place[r];
  };
  for (size_t k = 0; k < drafts.size() && !too_large; ++k) {
    if (!keep[k]) continue;
    const Draft& draft = drafts[k];
    Instruction instruction{
        draft.op, kNoOperand, kNoOperand, kNoOperand, kNoOperand, kNoOperand, uint32_t(program.pool.size())};
    uint16_t* fixed[3] = {&instruction.a, &instruction.b, &instruction.c};
    for (size_t i = 0; i < draft.inputs.size(); ++i) {
      const uint32_t operand = number(draft.inputs[i]);
      if (i < 3)
        *fixed[i] = uint16_t(operand);
      else
        program.pool.push_back(operand);
    }
    program.pool.insert(program.pool.end(), draft.params.begin(), draft.params.end());
    // Outputs are taken before the inputs' places are free: an instruction may write one before it has read all.
    instruction.out = take(draft.out[0]);
    instruction.out2 = take(draft.out[1]);
    for (const uint32_t r : ends[k]) free.push_back(place[r]);
    if (reads_hit(draft.op)) program.effects |= kTextures;
    program.reads_uv |= draft.op == Op::kUv;
    if (draft.op >= Op::kFirstClosure) program.empty = false;
    program.code.push_back(instruction);
  }
  program.reads_offsets = reads_offsets;
  program.offset_scale = offset_scale;
  program.washed = washed;
  program.effects |= closure_effects;
  if (too_large) {
    warn("the node tree is too large: it is shown grey");
    Program grey;
    grey.constants = {Vec3(1.0f), Vec3(0.8f)};
    grey.pool = {kConstantBit, kConstantBit | 1u, kNoOperand, kNoOperand, 0};
    grey.code = {{Op::kDiffuse, kNoOperand, kNoOperand, kNoOperand, kNoOperand, kNoOperand, 0}};
    grey.empty = kind != ProgramKind::kSurface;
    if (grey.empty) grey.code.clear();
    return grey;
  }
  return program;
}

Program compile(const Graph& graph, ProgramKind kind, const CompileHost& host) {
  Program program = Emitter(graph, kind, host).build();
  static const SurfacePoint kPoint{{0, 0, 0}, {0, 0, 1}, {0, 0, 1}, {0, 0, 1}};
  PathContext path;
  bool folded = host.fold;
  for (const Instruction& instruction : program.code) {
    const uint32_t* pool = program.pool.data() + instruction.data;
    switch (instruction.op) {  // closures that depend on nothing but the normal
      case Op::kDiffuse:
      case Op::kTranslucent:
        folded &= pool[2] == kNoOperand;
        break;
      case Op::kTransparent:
      case Op::kEmission:
      case Op::kHoldout:
        break;
      default:
        folded = false;
    }
  }
  folded &= program.registers == 0;
  if (folded) {
    HitContext hit;
    hit.points[0] = &kPoint;
    hit.path = &path;
    program.ready.clear();
    run(program, hit, program.ready);
    program.folded = true;
  }
  return program;
}

}  // namespace afterglow
