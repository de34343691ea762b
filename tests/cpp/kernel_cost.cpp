// SPDX-License-Identifier: GPL-3.0-or-later
// A diffuse Cornell box by the kernel that its Effects choose (`kernel_cost chosen`), by one that holds nothing else
// (`kernel_cost bare`, bare_kernel.h) or by the kernel with everything in it (`kernel_cost full`), to be run under
// callgrind, whose counters run inside of measured() alone. Prints the picture's sum and how many rays it took.
#include <cstdio>
#include <cstring>
#include <functional>

#include "bare_kernel.h"
#include "transport/committed_scene.h"

namespace afterglow {
namespace {

using Corners = std::array<Vec3, 4>;

constexpr uint32_t kSize = 48, kSamples = 16, kSeed = 7, kBounces = 12;

Handle add_material(Scene& scene, const char* name, const char* type, const Rgb& color) {
  Node node{type, name, {{"color", Vec3(color)}}, {}};
  if (node.type == "emission") node.inputs["strength"] = 1.0f;
  Material material;
  material.name = name;
  material.graph = {{node}, {0, "shader"}};
  return scene.add_material(std::move(material));
}

void add_quads(Scene& scene, const char* name, Handle material, const std::vector<Corners>& quads) {
  Mesh mesh;
  mesh.name = name;
  for (const Corners& corners : quads) {
    const uint32_t first = uint32_t(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), corners.begin(), corners.end());
    for (const uint32_t i : {0u, 1u, 2u, 0u, 2u, 3u}) mesh.triangles.push_back(first + i);
  }
  Instance instance;
  instance.name = name;
  instance.mesh = scene.add_mesh(std::move(mesh));
  instance.materials = {material};
  scene.add_instance(std::move(instance));
}

std::vector<Corners> block(const Vec3& low, const Vec3& high) {
  const auto at = [&](int x, int y, int z) { return Vec3(x ? high.x : low.x, y ? high.y : low.y, z ? high.z : low.z); };
  return {{at(0, 0, 1), at(1, 0, 1), at(1, 1, 1), at(0, 1, 1)},
          {at(0, 0, 0), at(1, 0, 0), at(1, 0, 1), at(0, 0, 1)},
          {at(1, 1, 0), at(0, 1, 0), at(0, 1, 1), at(1, 1, 1)},
          {at(0, 1, 0), at(0, 0, 0), at(0, 0, 1), at(0, 1, 1)},
          {at(1, 0, 0), at(1, 1, 0), at(1, 1, 1), at(1, 0, 1)}};
}

/// The Cornell box (Goral et al. 1984).
void build(Scene& scene) {
  const Handle white = add_material(scene, "white", "diffuse_bsdf", {0.725f, 0.71f, 0.68f});
  const Handle red = add_material(scene, "red", "diffuse_bsdf", {0.63f, 0.065f, 0.05f});
  const Handle green = add_material(scene, "green", "diffuse_bsdf", {0.14f, 0.45f, 0.091f});
  const Handle lamp = add_material(scene, "lamp", "emission", {18.0f, 15.3f, 10.8f});
  add_quads(scene, "Room", white,
            {{Vec3(-1, -1, 0), {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}},
             {Vec3(-1, 1, 2), {1, 1, 2}, {1, -1, 2}, {-1, -1, 2}},
             {Vec3(-1, 1, 0), {1, 1, 0}, {1, 1, 2}, {-1, 1, 2}}});
  add_quads(scene, "Left", red, {{Vec3(-1, -1, 0), {-1, 1, 0}, {-1, 1, 2}, {-1, -1, 2}}});
  add_quads(scene, "Right", green, {{Vec3(1, 1, 0), {1, -1, 0}, {1, -1, 2}, {1, 1, 2}}});
  add_quads(scene, "Lamp", lamp,
            {{Vec3(-0.3f, 0.25f, 1.98f), {0.3f, 0.25f, 1.98f}, {0.3f, -0.25f, 1.98f}, {-0.3f, -0.25f, 1.98f}}});
  add_quads(scene, "Tall", white, block({-0.65f, 0.0f, 0.0f}, {-0.05f, 0.6f, 1.2f}));
  add_quads(scene, "Low", white, block({0.05f, -0.65f, 0.0f}, {0.65f, -0.05f, 0.6f}));
  Camera camera;
  camera.transform =
      DMat4(glm::dvec4(1, 0, 0, 0), glm::dvec4(0, 0, 1, 0), glm::dvec4(0, -1, 0, 0), glm::dvec4(0, -3.9, 1, 1));
  camera.window = Vec4(-0.35f, 0.35f, -0.35f, 0.35f);
  scene.set_camera(camera);
}

int report(const Film& film, const RayCounts& counts) {
  std::vector<float> image(size_t(4) * kSize * kSize);
  film.read(Pass::kCombined, image.data());
  double sum = 0.0;
  for (size_t i = 0; i < image.size(); ++i) sum += i % 4 < 3 ? double(image[i]) * double(1 + i % 97) : 0.0;
  std::printf("sum %.12g rays %llu\n", sum, (unsigned long long)(counts.camera + counts.bounce + counts.shadow));
  return 0;
}

}  // namespace
}  // namespace afterglow

using namespace afterglow;

/// Not inlined, and with a name that callgrind finds.
extern "C" [[gnu::noinline]] void measured(const std::function<void()>& work) { work(); }

int main(int count, char** arguments) {
  const char* wanted = count > 1 ? arguments[1] : "chosen";
  CommittedScene scene;
  build(scene.scene);
  scene.commit({.flatten = RayCaster::Flatten::kAlways});
  FilmSettings settings;
  settings.width = settings.height = kSize;
  Film film(completed(settings));
  const CameraRays camera(scene.scene.camera(), scene.scene.origin(), kSize, kSize);
  RayCounts counts;
  PixelRequest request;
  request.width = request.height = uint16_t(kSize);
  request.count = kSamples;
  if (!std::strcmp(wanted, "bare")) {
    const LoneLight* lamp = scene.lights.lone();
    if (!lamp) return 1;
    bare::Input input{scene, camera, film, lamp->patch, lamp->radiance, {}, {}, kBounces, kSeed};
    for (uint32_t m = 0; m < scene.scene.material_handles().size(); ++m) {
      input.albedo.push_back(scene.materials.plain(m).albedo);
      input.emission.push_back(scene.materials.plain(m).emission);
    }
    measured([&] { bare::render(input, request, counts); });
    return report(film, counts);
  }
  WalkLimits limits;
  limits.max_bounces = limits.diffuse = kBounces;
  const path_tracing::KernelInput input{.walk = {scene, limits, nullptr, false},
                                        .camera = camera,
                                        .film = film,
                                        .clamp_direct = kInfinity,
                                        .clamp_indirect = kInfinity,
                                        .seed = kSeed,
                                        .stop = {}};
  const bool full = !std::strcmp(wanted, "full");
  const uint32_t features =
      full ? kKernelCount - 1 : path_tracing::kernel_features(scene.effects, film.settings().passes, false);
  if (!full && features != 0) {
    std::printf("the effects of a diffuse box choose kernel %u\n", features);
    return 1;
  }
  const path_tracing::Kernel kernel = path_tracing::choose_kernel(features);
  measured([&] { kernel(input, request, counts); });
  return report(film, counts);
}
