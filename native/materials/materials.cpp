// SPDX-License-Identifier: GPL-3.0-or-later
// The compiled materials of a scene: which programs stand for which material, and how they are run for surfaces, shadow
// rays, emission, worlds and lights.
#include "materials/materials.h"

#include <algorithm>
#include <set>
#include <unordered_map>

#include "base/sampler.h"
#include "materials/attributes.h"
#include "materials/compiler.h"
#include "materials/images.h"
#include "scene/changes.h"

namespace afterglow {
namespace {

struct Compiled {
  Handle handle = 0;
  Program surface, transparency, emission;
  int32_t pass_index = 0;
  bool emission_sampling = true;
  Rgb mean_emission{0.0f};
};

Graph default_graph() {
  Graph graph;
  graph.nodes.push_back({"diffuse_bsdf", "default", {{"color", Vec3(0.8f)}}, {}});
  graph.surface = {0, "shader"};
  return graph;
}

}  // namespace

struct Materials::State {
  std::vector<Compiled> materials;  // by dense index
  Program world;
  bool has_world = false;
  std::unordered_map<Handle, Program> lights;
  AttributeTables attributes;
  Images images;
  std::set<std::string> said;

  void say(const std::string& text, std::vector<std::string>& warnings) {
    if (said.insert(text).second) warnings.push_back(text);
  }
  CompileHost host(const std::string& owner, std::vector<std::string>& warnings) {
    CompileHost host;
    host.warn = [this, owner, &warnings](const std::string& text) { say(owner + ": " + text, warnings); };
    host.attribute = [this](const std::string& name) { return attributes.number(name); };
    host.image = [this](int64_t handle) { return images.number(Handle(handle)); };
    return host;
  }
  Compiled compile_material(const Scene&, Handle, std::vector<std::string>&);
  HitContext context(const Scene& scene, const SurfacePoint& point, const PathContext& path) const {
    HitContext hit;
    hit.points[0] = &point;
    hit.path = &path;
    hit.scene = &scene;
    hit.attributes = &attributes;
    hit.images = &images;
    return hit;
  }
  const Compiled& at(uint32_t material) const { return materials[material < materials.size() ? material : 0]; }
};

namespace {

/// Emission of points spread over UV and generated coordinates: what light selection goes by.
Rgb estimate_emission(const Program& program, const Images& images) {
  if (program.empty) return Rgb(0.0f);
  if (program.folded) return program.ready.emission;
  Rgb sum(0.0f);
  const int count = 256;
  Surface surface;
  PathContext path;
  for (int k = 0; k < count; ++k) {
    const float u = (float(k) + 0.5f) / count, v = float(hash(uint32_t(k)) >> 8) * 0x1p-24f;
    SurfacePoint point{{u, v, 0.5f}, {0, 0, 1}, {0, 0, 1}, {0, 0, 1}, {u, v}};
    HitContext hit;
    hit.points[0] = &point;
    hit.path = &path;
    hit.images = &images;
    surface.clear();
    run(program, hit, surface);
    sum += surface.emission;
  }
  return sum / float(count);
}

PlainMaterial plain_of(const Program& program) {
  const Surface& s = program.ready;
  if (!program.folded || s.count > 1 || s.holdout > 0.0f || !is_black(s.transparency)) return {};
  if (s.count && s.lobes[0].kind != LobeKind::kLambert) return {};
  return {s.count ? s.lobes[0].weight : Rgb(0.0f), s.emission, true, s.count > 0};
}

}  // namespace

Compiled Materials::State::compile_material(const Scene& scene, Handle handle, std::vector<std::string>& warnings) {
  static const Graph grey = default_graph();
  const Material* material = handle ? &scene.material(handle) : nullptr;
  const Graph& graph = material ? material->graph : grey;
  const CompileHost compile_host =
      host(material ? "material \"" + material->name + "\"" : "default material", warnings);
  Compiled result;
  result.handle = handle;
  result.surface = compile(graph, ProgramKind::kSurface, compile_host);
  result.transparency = compile(graph, ProgramKind::kTransparency, compile_host);
  result.emission = compile(graph, ProgramKind::kEmission, compile_host);
  if (material) result.pass_index = material->pass_index, result.emission_sampling = material->emission_sampling;
  return result;
}

Materials::Materials() : state_(std::make_unique<State>()) {}
Materials::~Materials() = default;

void Materials::commit(const Scene& scene, const SceneChanges& changes, std::vector<std::string>& warnings) {
  State& s = *state_;
  const auto handles = scene.material_handles();
  const size_t attributes_before = s.attributes.names.size();
  const bool everything = changes.everything || s.materials.empty() || !changes.images_edited.empty();
  const std::set<Handle> edited(changes.materials_edited.begin(), changes.materials_edited.end());
  s.materials.resize(handles.size());
  std::vector<bool> fresh(handles.size(), false);
  for (size_t k = 0; k < handles.size(); ++k) {
    if (everything || s.materials[k].handle != handles[k] || edited.count(handles[k]) ||
        s.materials[k].surface.code.empty()) {
      s.materials[k] = s.compile_material(scene, handles[k], warnings);
      fresh[k] = true;
    }
  }
  if (everything || changes.world) {
    const World& world = scene.world();
    s.has_world = world.graph.has_value();
    s.world = s.has_world ? compile(*world.graph, ProgramKind::kEmission, s.host("world", warnings)) : Program{};
    s.has_world &= !s.world.empty;
  }
  if (everything || !changes.lights_added.empty() || !changes.lights_edited.empty() ||
      !changes.lights_removed.empty()) {
    s.lights.clear();
    for (const Handle handle : scene.light_handles()) {
      const Light& light = scene.light(handle);
      if (!light.graph) continue;
      s.lights[handle] =
          compile(*light.graph, ProgramKind::kEmission, s.host("light \"" + light.name + "\"", warnings));
    }
  }
  s.images.load(scene, warnings);
  for (size_t k = 0; k < handles.size(); ++k) {
    Compiled& m = s.materials[k];
    if (everything || fresh[k]) m.mean_emission = estimate_emission(m.emission, s.images);
  }
  plain_.assign(handles.size(), {});
  all_plain_ = true, some_read_uv_ = false;
  for (size_t k = 0; k < handles.size(); ++k) {
    plain_[k] = plain_of(s.materials[k].surface);
    all_plain_ &= plain_[k].plain;
    some_read_uv_ |= s.materials[k].surface.reads_uv;
  }
  const bool geometry = !changes.meshes_added.empty() || !changes.meshes_replaced.empty() ||
                        !changes.meshes_removed.empty() || !changes.meshes_deformed.empty() ||
                        !changes.instances_added.empty() || !changes.instances_removed.empty() ||
                        !changes.instances_edited.empty();
  if (everything || geometry || s.attributes.names.size() != attributes_before) s.attributes.resolve(scene);
}

Effects Materials::effects() const {
  Effects effects;
  for (const Compiled& m : state_->materials) effects.bits |= m.surface.effects;
  if (state_->has_world) effects.add(state_->world.folded ? kWorldConstant : kWorldVarying);
  return effects;
}

uint32_t Materials::material_effects(uint32_t material) const { return state_->at(material).surface.effects; }
bool Materials::reads_uv(uint32_t material) const { return state_->at(material).surface.reads_uv; }

void Materials::shade(const Scene& scene, const SurfacePoint& point, const PathContext& path, Surface& out) const {
  const Compiled& material = state_->at(point.material);
  const Program& program = material.surface;
  if (program.folded) {
    out = program.ready;
    for (int k = 0; k < out.count; ++k) out.lobes[k].normal = point.normal;
    return;
  }
  out.clear();
  HitContext hit = state_->context(scene, point, path);
  hit.material_index = material.pass_index;
  run(program, hit, out);
}

Rgb Materials::transparency(const Scene& scene, const SurfacePoint& point, const PathContext& path) const {
  const Compiled& material = state_->at(point.material);
  const Program& program = material.transparency;
  if (program.empty) return Rgb(0.0f);
  if (program.folded) return program.ready.transparency;
  Surface out;
  HitContext hit = state_->context(scene, point, path);
  hit.material_index = material.pass_index;
  run(program, hit, out);
  return out.transparency;
}

bool Materials::opaque(uint32_t material) const {
  const Program& program = state_->at(material).transparency;
  return program.empty || (program.folded && is_black(program.ready.transparency));
}

bool Materials::emits(uint32_t material) const {
  const Compiled& compiled = state_->at(material);
  const Program& program = compiled.emission;
  return compiled.emission_sampling && !program.empty && !(program.folded && is_black(program.ready.emission));
}

Rgb Materials::mean_emission(uint32_t material) const { return state_->at(material).mean_emission; }

Rgb Materials::emission(const Scene& scene, const SurfacePoint& point, const PathContext& path) const {
  const Compiled& material = state_->at(point.material);
  const Program& program = material.emission;
  if (program.empty) return Rgb(0.0f);
  if (program.folded) return program.ready.emission;
  Surface out;
  HitContext hit = state_->context(scene, point, path);
  hit.material_index = material.pass_index;
  run(program, hit, out);
  return out.emission;
}

namespace {

Rgb run_direction(const Program& program, HitContext& hit, const Vec3& direction, const Vec2& uv) {
  SurfacePoint point{direction, -direction, -direction, -direction, uv};
  hit.points[0] = &point;
  hit.background = true;
  Surface out;
  run(program, hit, out);
  return out.emission;
}

}  // namespace

Rgb Materials::world(const Vec3& direction, const PathContext& path) const {
  if (!state_->has_world) return Rgb(0.0f);
  if (state_->world.folded) return state_->world.ready.emission;
  HitContext hit;
  hit.path = &path;
  hit.images = &state_->images;
  return run_direction(state_->world, hit, direction, Vec2(0.0f));
}

bool Materials::world_constant() const { return state_->has_world && state_->world.folded; }
bool Materials::has_world() const { return state_->has_world; }

Rgb Materials::light(Handle light, const Vec3& direction, const Vec2& uv) const {
  const auto found = state_->lights.find(light);
  if (found == state_->lights.end()) return Rgb(1.0f);
  if (found->second.folded) return found->second.ready.emission;
  if (found->second.empty) return Rgb(0.0f);
  PathContext path;
  HitContext hit;
  hit.path = &path;
  hit.images = &state_->images;
  return run_direction(found->second, hit, direction, uv);
}

size_t Materials::bytes() const {
  size_t total = sizeof(State);
  const auto of = [](const Program& p) {
    return p.code.size() * sizeof(Instruction) + p.constants.size() * sizeof(Vec3) + p.pool.size() * 4 + sizeof p;
  };
  for (const Compiled& m : state_->materials) total += of(m.surface) + of(m.transparency) + of(m.emission);
  return total + of(state_->world) + state_->images.bytes();
}

}  // namespace afterglow
