// SPDX-License-Identifier: GPL-3.0-or-later
// Edits of the scene's tables and look-ups by handle: see scene.h.
#include "scene/scene.h"

#include "scene/scene_state.h"

namespace afterglow {

namespace {

Material default_grey() {
  Material grey;
  grey.name = "default";
  Node node;
  node.type = "diffuse_bsdf";
  node.name = "default";
  node.inputs["color"] = Vec3(0.8f);
  node.inputs["roughness"] = 0.0f;
  grey.graph.nodes.push_back(node);
  grey.graph.surface = {0, "shader"};
  return grey;
}

/// Blender tells of images with every frame. What a file holds may be other than it was: its name says nothing.
bool same_content(const Image& a, const Image& b) {
  if (a.name != b.name || a.colorspace != b.colorspace || a.alpha != b.alpha || a.tiles.size() != b.tiles.size())
    return false;
  for (const auto& [number, source] : a.tiles) {
    const auto other = b.tiles.find(number);
    if (other == b.tiles.end() || !source || !other->second) return false;
    const ImageSource &x = *source, &y = *other->second;
    if (!x.path.empty() || !y.path.empty() || x.encoded != y.encoded || x.pixels != y.pixels ||
        x.byte_pixels != y.byte_pixels || x.width != y.width || x.height != y.height || x.channels != y.channels)
      return false;
  }
  return !a.tiles.empty();
}

}  // namespace

Scene::Scene() : state_(std::make_unique<State>()) {
  state_->default_material = default_grey();
  slots_ = state_->slots;
}
Scene::~Scene() = default;

Handle Scene::add_image(Image image) {
  const Handle handle = state_->images.add(std::move(image));
  state_->pending.note(ChangeSet::kImage, handle, ChangeSet::kAdded);
  return handle;
}

void Scene::set_image(Handle handle, Image image) {
  if (same_content(state_->images.at(handle), image)) return;
  state_->images.at(handle) = std::move(image);
  state_->pending.note(ChangeSet::kImage, handle, ChangeSet::kEdited);
}

void Scene::remove_image(Handle handle) {
  state_->images.remove(handle);
  state_->pending.note(ChangeSet::kImage, handle, ChangeSet::kRemoved);
}

Handle Scene::add_material(Material material) {
  const Handle handle = state_->materials.add(std::move(material));
  state_->pending.note(ChangeSet::kMaterial, handle, ChangeSet::kAdded);
  return handle;
}

void Scene::set_material(Handle handle, Material material) {
  state_->materials.at(handle) = std::move(material);
  state_->pending.note(ChangeSet::kMaterial, handle, ChangeSet::kEdited);
}

void Scene::remove_material(Handle handle) {
  state_->materials.remove(handle);
  if (handle < state_->material_indices.size() && state_->material_indices[handle])
    state_->freed_materials_now.push_back(state_->material_indices[handle]);
  state_->pending.note(ChangeSet::kMaterial, handle, ChangeSet::kRemoved);
}

Handle Scene::add_mesh(Mesh mesh) {
  MeshRepairs repairs = check_mesh(mesh);
  const Handle handle = state_->meshes.add({std::move(mesh), std::move(repairs.dropped)});
  state_->pending.note(ChangeSet::kMesh, handle, ChangeSet::kAdded);
  for (std::string& text : repairs.warnings) state_->pending.warnings.push_back(std::move(text));
  return handle;
}

void Scene::set_mesh(Handle handle, Mesh mesh) {
  MeshRow& row = state_->meshes.at(handle);
  MeshRepairs repairs = check_mesh(mesh);
  const bool whole = repairs.dropped.empty() && row.dropped.empty();
  // Who gives a mesh anew without knowing whether it changed invalidates nothing that it did not.
  const MeshDifference difference = whole ? mesh_difference(row.mesh, mesh) : MeshDifference::kOther;
  if (difference == MeshDifference::kShape) {
    row.mesh.positions.assign(mesh.positions.begin(), mesh.positions.end());  // in place: the BVH knows this address
    row.mesh.previous_positions = std::move(mesh.previous_positions);
    row.mesh.corner_normals = std::move(mesh.corner_normals);
    row.mesh.vertex_normals = std::move(mesh.vertex_normals);
    row.mesh.bounds = mesh.bounds;
    state_->pending.note(ChangeSet::kMesh, handle, ChangeSet::kDeformed);
  } else if (difference == MeshDifference::kOther) {
    row = {std::move(mesh), std::move(repairs.dropped)};
    state_->pending.note(ChangeSet::kMesh, handle, ChangeSet::kEdited);
  }
  for (std::string& text : repairs.warnings) state_->pending.warnings.push_back(std::move(text));
}

void Scene::deform_mesh(Handle handle, std::vector<Vec3> positions, std::vector<Vec3> corner_normals,
                        std::vector<Vec3> vertex_normals) {
  MeshRow& row = state_->meshes.at(handle);
  Mesh& mesh = row.mesh;
  const auto expect = [&](size_t given, size_t wanted, const char* array) {
    if (given && given != wanted)
      throw InvalidInput("mesh '" + mesh.name + "': " + array + " has " + std::to_string(given) + " entries where " +
                         std::to_string(wanted) + " are needed to deform it; give all arrays to replace it");
  };
  if (positions.size() != mesh.positions.size()) expect(positions.size() | 1, mesh.positions.size(), "positions");
  const size_t corners = mesh.corner_normals.size();
  if (corners) expect(corner_normals.size(), corners, "corner_normals");
  expect(vertex_normals.size(), mesh.positions.size(), "vertex_normals");

  mesh.positions.assign(positions.begin(), positions.end());  // in place: the BVH knows this address
  if (!corner_normals.empty()) mesh.corner_normals = std::move(corner_normals);
  if (!vertex_normals.empty()) mesh.vertex_normals = std::move(vertex_normals);
  MeshRepairs repairs = check_deformed(mesh, row.dropped);
  const bool same_triangles = repairs.dropped.empty() && row.dropped.empty();
  row.dropped = std::move(repairs.dropped);
  state_->pending.note(ChangeSet::kMesh, handle, same_triangles ? ChangeSet::kDeformed : ChangeSet::kEdited);
  for (std::string& text : repairs.warnings) state_->pending.warnings.push_back(std::move(text));
}

void Scene::remove_mesh(Handle handle) {
  state_->meshes.remove(handle);
  state_->pending.note(ChangeSet::kMesh, handle, ChangeSet::kRemoved);
}

Handle Scene::add_instance(Instance instance) {
  state_->meshes.at(instance.mesh);
  InstanceRow row;
  row.instance = std::move(instance);
  const Handle handle = state_->instances.add(std::move(row));
  state_->pending.note(ChangeSet::kInstance, handle, ChangeSet::kAdded);
  return handle;
}

void Scene::set_instance(Handle handle, Instance instance) {
  InstanceRow& row = state_->instances.at(handle);
  state_->meshes.at(instance.mesh);
  if (instance.transform != row.instance.transform) row.moved = state_->transforms_touched = true;
  row.instance = std::move(instance);
  state_->pending.note(ChangeSet::kInstance, handle, ChangeSet::kEdited);
}

void Scene::set_transform(Handle handle, const DMat4& transform) {
  InstanceRow& row = state_->instances.at(handle);
  if (transform == row.instance.transform) return;
  row.instance.transform = transform;
  row.moved = state_->transforms_touched = true;
}

void Scene::remove_instance(Handle handle) {
  const InstanceRow& row = state_->instances.at(handle);
  if (row.index != kNone) state_->freed_now.push_back(row.index);
  state_->instances.remove(handle);
  state_->pending.note(ChangeSet::kInstance, handle, ChangeSet::kRemoved);
}

Handle Scene::add_light(Light light) {
  const Handle handle = state_->lights.add(std::move(light));
  state_->pending.note(ChangeSet::kLight, handle, ChangeSet::kAdded);
  return handle;
}

void Scene::set_light(Handle handle, Light light) {
  state_->lights.at(handle) = std::move(light);
  state_->pending.note(ChangeSet::kLight, handle, ChangeSet::kEdited);
}

void Scene::remove_light(Handle handle) {
  state_->lights.remove(handle);
  state_->pending.note(ChangeSet::kLight, handle, ChangeSet::kRemoved);
}

void Scene::set_world(World world) {
  state_->world = std::move(world);
  state_->pending.world = true;
}

void Scene::set_camera(Camera camera) {
  state_->camera = std::move(camera);
  state_->pending.camera = true;
}

SceneChanges Scene::changes_since(uint64_t version) const { return state_->log.since(version); }
uint64_t Scene::version() const { return state_->log.version(); }

const Mesh& Scene::mesh(Handle handle) const { return state_->meshes.at(handle).mesh; }
const Instance& Scene::instance(Handle handle) const { return state_->instances.at(handle).instance; }
const Material& Scene::material(Handle handle) const {
  return handle == 0 ? state_->default_material : state_->materials.at(handle);
}
const Light& Scene::light(Handle handle) const { return state_->lights.at(handle); }
const Image& Scene::image(Handle handle) const { return state_->images.at(handle); }
const World& Scene::world() const { return state_->world; }
const Camera& Scene::camera() const { return state_->camera; }
std::vector<Handle> Scene::mesh_handles() const { return state_->meshes.handles(); }
std::vector<Handle> Scene::light_handles() const { return state_->lights.handles(); }
std::vector<Handle> Scene::image_handles() const { return state_->images.handles(); }

uint32_t Scene::instance_index(Handle handle) const {
  const uint32_t index = state_->instances.at(handle).index;
  if (index == kNone) throw InvalidHandle("instance " + std::to_string(handle) + " is not committed yet");
  return index;
}

std::span<const Handle> Scene::material_handles() const { return state_->material_handles; }

uint32_t Scene::material_index(Handle handle) const {
  if (handle == 0) return 0;
  state_->materials.at(handle);
  return handle < state_->material_indices.size() ? state_->material_indices[handle] : 0;
}

DVec3 Scene::origin() const { return state_->origin; }
Box Scene::bounds() const { return state_->bounds; }

namespace {

template <class T>
size_t size_of(const std::vector<T>& v) {
  return v.capacity() * sizeof(T);
}

size_t size_of(const Mesh& m) {
  size_t n = sizeof m + size_of(m.positions) + size_of(m.previous_positions) + size_of(m.triangles) +
             size_of(m.corners) + size_of(m.corner_normals) + size_of(m.vertex_normals) + size_of(m.smooth) +
             size_of(m.slots) + size_of(m.faces);
  for (const UvMap& uv : m.uvs) n += size_of(uv.values);
  for (const Attribute& a : m.attributes) n += size_of(a.values);
  return n;
}

size_t size_of(const Image& image) {
  size_t n = sizeof image;
  for (const auto& [tile, source] : image.tiles)
    if (source) n += size_of(source->encoded) + size_of(source->pixels) + size_of(source->byte_pixels);
  return n;
}

}  // namespace

std::unordered_map<std::string, size_t> Scene::bytes() const {
  std::unordered_map<std::string, size_t> out;
  for (const Handle handle : state_->meshes.handles()) out["meshes"] += size_of(mesh(handle));
  for (const Handle handle : state_->images.handles()) out["images"] += size_of(image(handle));
  out["instances"] = size_of(state_->records) + size_of(state_->slots);
  for (const Handle handle : state_->instances.handles())
    out["instances"] += sizeof(InstanceRow) + size_of(instance(handle).materials);
  return out;
}

}  // namespace afterglow
