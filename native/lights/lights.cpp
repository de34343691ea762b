// SPDX-License-Identifier: GPL-3.0-or-later
// All lights of a scene. Finite ones (light objects, emissive triangles) are leaves of one light tree; suns and the
// world stand beside it, each with its own share. What sample() does with probability p, the density_of functions
// report as p: both go through the same two steps, share() and the light's own density.
#include "lights/lights.h"

#include <algorithm>

#include "lights/lamp.h"
#include "lights/lamp_bvh.h"
#include "lights/light_tree.h"
#include "lights/world_map.h"

namespace afterglow {

namespace {

/// Part of each choice that goes evenly to all groups of lights that can shine at all: estimates know no shadows.
constexpr float kEvenShare = 0.2f;
/// A constant world is found as well by the surface's own samples: it wants few shadow rays beside other lights.
constexpr float kConstantWorldWeight = 0.25f;

enum Group { kTree, kSuns, kWorld, kGroups };

struct Shares {
  float weight[kGroups] = {};  // then: probability
  bool normalize() {
    float sum = 0.0f;
    int alive = 0;
    for (float w : weight) sum += w, alive += w > 0.0f;
    if (!(sum > 0.0f)) return false;
    for (float& w : weight)
      if (w > 0.0f) w = alive == 1 ? 1.0f : (1.0f - kEvenShare) * w / sum + kEvenShare / float(alive);
    return true;
  }
};

LightBounds bounds_of(const Lamp& lamp, float factor) {
  LightBounds b;
  b.axis = lamp.axis;
  const float light = luminance(lamp.radiance) * factor;
  if (lamp.shape == LampShape::kRectangle || lamp.shape == LampShape::kEllipse) {
    const Vec3 u = 0.5f * lamp.edge_u, v = 0.5f * lamp.edge_v;
    for (const Vec3& corner : {u + v, u - v, -u + v, -u - v}) b.box.extend(lamp.position + corner);
    b.cos_normals = 1.0f;
    b.cos_emission = lamp.spread ? 1.0f / std::sqrt(1.0f + lamp.tan_half_spread * lamp.tan_half_spread) : 0.0f;
    b.intensity = light * lamp.area * (lamp.spread ? lamp.tan_half_spread * lamp.spread_scale : 1.0f);
  } else {
    b.box.extend(lamp.position - Vec3(lamp.radius));
    b.box.extend(lamp.position + Vec3(lamp.radius));
    b.intensity = lamp.shape == LampShape::kPoint ? light : light * lamp.area;
    // An elliptic cone (uneven scale) is taken for all directions; a radius widens the cone near the lamp, which the
    // box's own angle covers.
    const bool even = std::fabs(glm::length(lamp.local_x) / glm::length(lamp.local_z) - 1.0f) < 1e-3f &&
                      std::fabs(glm::length(lamp.local_y) / glm::length(lamp.local_z) - 1.0f) < 1e-3f;
    b.cos_normals = -1.0f;
    if (lamp.spot && even && lamp.cos_spot > 0.0f) b.cos_normals = 1.0f, b.cos_emission = lamp.cos_spot;
  }
  if (!std::isfinite(b.intensity)) b.intensity = std::numeric_limits<float>::max() / 1e6f;
  return b;
}

float sun_weight(const Lamp& sun, const Vec3& normal) {
  const float light = luminance(sun.radiance);
  const float full = sun.shape == LampShape::kDirection
                         ? light
                         : light * kPi * sun.one_minus_cos * (2.0f - sun.one_minus_cos);  // radiance · π sin²
  if (glm::dot(normal, normal) == 0.0f) return full;
  const float cosine = -glm::dot(sun.axis, normal), cos_disk = 1.0f - sun.one_minus_cos;
  if (cosine >= cos_disk) return full;
  const float sin_disk = std::sqrt(std::max(1.0f - cos_disk * cos_disk, 0.0f));
  return full * std::max(cosine * cos_disk + std::sqrt(std::max(1.0f - cosine * cosine, 0.0f)) * sin_disk, 0.0f);
}

const PathContext kEmissionContext{0, 0, 0, 0, 0, 0, 0.0f, false, false};

}  // namespace

struct Lights::State {
  const Scene* scene = nullptr;
  const Materials* materials = nullptr;
  std::vector<Lamp> lamps, suns;
  LampBvh lamp_bvh;  // those of the lamps that rays can hit
  EmissiveMeshes meshes;
  struct Emission {
    Rgb mean{0.0f};
    bool constant = true;
  };
  std::vector<Emission> emission;  // by dense material
  LightTree tree;
  WorldMap world_map;
  bool has_world = false, world_constant = false;
  uint32_t world_visibility = kVisibleAll;
  Rgb world_radiance{0.0f};
  float world_weight = 0.0f;

  uint32_t finite() const { return uint32_t(lamps.size() + meshes.patches().size()); }

  void collect_lamps(std::vector<std::string>& warnings);
  float graph_factor(const Lamp&) const;
  void collect_emission();
  void build_tree();
  void build_world();
  bool find_lone(LoneLight&) const;

  bool shares(const Vec3& position, const Vec3& normal, Shares&) const;
  float suns_weight(const Vec3& normal) const;
  Rgb emission_of(const EmissivePatch&, const Vec3& position, const PatchSample&) const;
  Rgb with_graph(const Lamp& lamp, const Rgb& radiance, const Vec3& direction, const Vec2& uv) const {
    return lamp.has_graph ? radiance * materials->light(lamp.handle, lamp_local(lamp, -direction), uv) : radiance;
  }
  bool hit_lamp(uint32_t index, const Ray&, float t_max, LightHit&, Vec2& uv) const;
  bool sample_finite(uint32_t light, const Vec3&, const Vec3&, const Vec2&, LightSample&) const;
  bool sample_sun(float u, const Vec3& position, const Vec3& normal, const Vec2&, LightSample&) const;
  bool sample_world(const Vec3& normal, const Vec2&, LightSample&) const;
  float world_density(const Vec3& normal, const Vec3& direction) const;
};

void Lights::State::collect_lamps(std::vector<std::string>& warnings) {
  lamps.clear(), suns.clear();
  for (Handle handle : scene->light_handles()) {
    const Light& light = scene->light(handle);
    std::string problem;
    const auto lamp = make_lamp(light, handle, scene->origin(), problem);
    if (!problem.empty()) warnings.push_back("Light \"" + light.name + "\" is left out: " + problem);
    if (lamp) (lamp->infinite() ? suns : lamps).push_back(*lamp);
  }
  lamp_bvh.build(lamps);
}

/// Mean of a light's graph over directions, for the choice of lights; a little above zero where all probes are black.
float Lights::State::graph_factor(const Lamp& lamp) const {
  if (!lamp.has_graph) return 1.0f;
  constexpr int kProbes = 64;
  float sum = 0.0f;
  for (int i = 0; i < kProbes; ++i) {
    const Vec2 u((i + 0.5f) / kProbes, std::fmod(i * 0.61803398875f, 1.0f));
    Vec3 direction = square_to_sphere(u);
    if (lamp.shape == LampShape::kRectangle || lamp.shape == LampShape::kEllipse)
      direction = -square_to_cosine_hemisphere(u);
    const float light = luminance(materials->light(lamp.handle, direction, u));
    if (std::isfinite(light)) sum += std::max(light, 0.0f);
  }
  return std::max(sum / kProbes, 1e-3f);
}

void Lights::State::collect_emission() {
  meshes.collect(*scene, *materials);
  const auto handles = scene->material_handles();
  emission.assign(handles.size(), {});
  for (uint32_t m = 0; m < emission.size(); ++m) {
    if (!materials->emits(m)) continue;
    emission[m].mean = glm::max(materials->mean_emission(m), Rgb(0.0f));
    emission[m].constant = !(materials->material_effects(m) & kTextures);
  }
}

void Lights::State::build_tree() {
  std::vector<LightBounds> bounds;
  bounds.reserve(finite());
  for (const Lamp& lamp : lamps) bounds.push_back(bounds_of(lamp, graph_factor(lamp)));
  for (uint32_t i = 0; i < meshes.patches().size(); ++i)
    bounds.push_back(meshes.bounds(i, emission[meshes.patches()[i].material].mean));
  tree.build(bounds);
}

void Lights::State::build_world() {
  world_map.clear();
  world_weight = 0.0f;
  world_radiance = Rgb(0.0f);
  has_world = materials->has_world();
  world_visibility = scene->world().visibility;
  if (!has_world) return;
  world_constant = materials->world_constant();
  if (world_constant) {
    world_radiance = materials->world(Vec3(0, 0, 1), kEmissionContext);
    world_weight = kPi * luminance(world_radiance) * kConstantWorldWeight;
  } else {
    const uint32_t resolution = uint32_t(std::max(scene->world().importance_resolution, 0));
    world_map.build([this](const Vec3& d) { return materials->world(d, kEmissionContext); }, resolution);
    world_weight = kPi * world_map.mean();
  }
  if (!(world_weight > 0.0f) || !std::isfinite(world_weight)) world_weight = 0.0f;
}

bool Lights::State::find_lone(LoneLight& lone) const {
  if (!lamps.empty() || !suns.empty() || world_weight > 0.0f || meshes.patches().size() != 1) return false;
  const EmissivePatch& patch = meshes.patches()[0];
  const Emission& e = emission[patch.material];
  if (!e.constant || !is_finite(e.mean) || is_black(e.mean)) return false;
  lone = {patch, e.mean, scene->instances()[patch.instance].visibility};
  return true;
}

float Lights::State::suns_weight(const Vec3& normal) const {
  float sum = 0.0f;
  for (const Lamp& sun : suns) sum += sun_weight(sun, normal);
  return sum;
}

bool Lights::State::shares(const Vec3& position, const Vec3& normal, Shares& s) const {
  if (suns.empty() && !(world_weight > 0.0f)) {  // nothing to choose between
    s.weight[kTree] = finite() ? 1.0f : 0.0f;
    return finite() > 0;
  }
  s.weight[kTree] = tree.importance(position, normal);
  s.weight[kSuns] = suns_weight(normal);
  s.weight[kWorld] = world_weight;
  return s.normalize();
}

Rgb Lights::State::emission_of(const EmissivePatch& t, const Vec3& position, const PatchSample& s) const {
  const Emission& e = emission[t.material];
  if (e.constant) return e.mean;
  const Ray ray{position, 0.0f, s.direction, kInfinity, kVisibleAll};
  const Hit hit{s.distance, s.barycentric.x, s.barycentric.y, t.instance, s.triangle};
  const SurfacePoint point = surface_point(*scene, ray, hit, materials->reads_uv(t.material));
  return materials->emission(*scene, point, kEmissionContext);
}

bool Lights::State::sample_finite(uint32_t light, const Vec3& position, const Vec3& normal, const Vec2& u,
                                  LightSample& out) const {
  if (light < lamps.size()) {
    const Lamp& lamp = lamps[light];
    LampSample s;
    if (!sample_lamp(lamp, position, normal, u, s)) return false;
    out.direction = s.direction, out.distance = s.distance, out.density = s.density;
    out.radiance = with_graph(lamp, s.radiance, s.direction, s.uv);
    out.delta = !lamp.hittable;
    out.cast_shadow = lamp.cast_shadow;
    out.visibility = lamp.visibility;
    return true;
  }
  const EmissivePatch& t = meshes.patches()[light - lamps.size()];
  PatchSample s;
  if (!sample_patch(t, position, normal, u, s)) return false;
  out.direction = s.direction, out.distance = s.distance, out.density = s.density;
  out.radiance = emission_of(t, position, s);
  out.margin = s.margin;
  out.visibility = scene->instances()[t.instance].visibility;
  return true;
}

bool Lights::State::sample_sun(float u, const Vec3& position, const Vec3& normal, const Vec2& v,
                               LightSample& out) const {
  const float sum = suns_weight(normal);
  float target = u * sum, weight = 0.0f;
  uint32_t chosen = kNone;
  for (uint32_t i = 0; i < suns.size(); ++i) {
    const float w = sun_weight(suns[i], normal);
    if (!(w > 0.0f)) continue;
    chosen = i, weight = w;
    if (target < w) break;
    target -= w;
  }
  if (chosen == kNone) return false;
  const Lamp& sun = suns[chosen];
  LampSample s;
  if (!sample_lamp(sun, position, normal, v, s)) return false;
  out.direction = s.direction, out.distance = s.distance;
  out.density = s.density * weight / sum;
  out.radiance = with_graph(sun, s.radiance, s.direction, s.uv);
  out.delta = !sun.hittable;
  out.cast_shadow = sun.cast_shadow, out.visibility = sun.visibility;
  out.light = finite() + chosen;
  return true;
}

float Lights::State::world_density(const Vec3& normal, const Vec3& direction) const {
  if (!world_constant) return world_map.empty() ? 0.0f : world_map.density(direction);
  if (glm::dot(normal, normal) == 0.0f) return 0.25f * kInvPi;
  return std::max(glm::dot(normal, direction), 0.0f) * kInvPi;
}

bool Lights::State::sample_world(const Vec3& normal, const Vec2& u, LightSample& out) const {
  if (world_constant) {
    const bool facing = glm::dot(normal, normal) > 0.0f;
    out.direction = facing ? Frame(normal).to_world(square_to_cosine_hemisphere(u)) : square_to_sphere(u);
    out.density = world_density(normal, out.direction);
    out.radiance = world_radiance;
  } else {
    if (world_map.empty()) return false;
    out.direction = world_map.sample(u, out.density);
    out.radiance = materials->world(out.direction, kEmissionContext);
  }
  out.distance = kInfinity;
  out.visibility = world_visibility;
  out.light = finite() + uint32_t(suns.size());
  return out.density > 0.0f;
}

Lights::Lights() : state_(std::make_unique<State>()) {}
Lights::~Lights() = default;

void Lights::commit(const Scene& scene, const SceneChanges& changes, const Materials& materials,
                    std::vector<std::string>& warnings) {
  State& s = *state_;
  const bool first = s.scene == nullptr;
  s.scene = &scene, s.materials = &materials;
  const bool all = first || changes.everything || changes.origin;
  const bool materials_changed = !changes.materials_added.empty() || !changes.materials_edited.empty() ||
                                 !changes.materials_removed.empty() || !changes.images_edited.empty();
  const bool lights =
      !changes.lights_added.empty() || !changes.lights_edited.empty() || !changes.lights_removed.empty();
  if (all || lights) s.collect_lamps(warnings);
  const bool emitters = all || materials_changed || s.meshes.touched_by(changes, scene, materials);
  if (emitters) s.collect_emission();
  if (lights || emitters) s.build_tree();
  const bool world = all || changes.world || !changes.images_edited.empty();
  if (world) s.build_world();
  if (lights || emitters || world) version_++;
  has_lone_ = s.find_lone(lone_);
}

Effects Lights::effects() const {
  Effects effects;
  if (!state_->lamps.empty() || !state_->suns.empty()) effects.add(kPunctualLights);
  if (!state_->meshes.patches().empty()) effects.add(kEmissiveMesh);
  if (state_->tree.size() > 16) effects.add(kManyLights);
  if (state_->has_world) effects.add(state_->world_constant ? kWorldConstant : kWorldVarying);
  return effects;
}

uint32_t Lights::count() const {
  return state_->finite() + uint32_t(state_->suns.size()) + (state_->world_weight > 0.0f ? 1 : 0);
}

size_t Lights::bytes() const {
  return state_->tree.bytes() + state_->lamp_bvh.bytes() + state_->meshes.bytes() + state_->world_map.bytes() +
         (state_->lamps.capacity() + state_->suns.capacity()) * sizeof(Lamp);
}

bool Lights::sample(const Vec3& position, const Vec3& normal, float u_light, const Vec2& u, LightSample& out) const {
  const State& s = *state_;
  out = LightSample{};
  if (has_lone_) {
    LoneSample sample(lone_);
    if (!sample_lone(lone_, position, normal, u, sample)) return false;
    out.direction = sample.direction, out.distance = sample.distance, out.density = sample.density;
    out.margin = sample.margin, out.radiance = sample.radiance;
    out.visibility = lone_.visibility, out.light = 0;
    return out.density > 0.0f && out.density < kInfinity;
  }
  Shares shares;
  if (!s.shares(position, normal, shares)) return false;
  float rest = u_light;
  int group = kTree;
  for (int g = 0; g < kGroups; ++g) {
    if (!(shares.weight[g] > 0.0f)) continue;
    group = g;
    if (rest < shares.weight[g]) break;
    rest -= shares.weight[g];
  }
  const float share = shares.weight[group];
  rest = std::clamp(rest / share, 0.0f, 0x1.fffffep-1f);
  bool found = false;
  float probability = share;
  if (group == kTree) {
    float in_tree;
    const uint32_t light = s.tree.sample(position, normal, rest, in_tree);
    found = light != kNone && s.sample_finite(light, position, normal, u, out);
    out.light = light;
    probability *= in_tree;
  } else {
    found = group == kSuns ? s.sample_sun(rest, position, normal, u, out) : s.sample_world(normal, u, out);
  }
  if (!found) return false;
  out.density *= probability;
  return out.density > 0.0f && std::isfinite(out.density) && is_finite(out.radiance) && !is_black(out.radiance);
}

float Lights::density_of_triangle(const Vec3& position, const Vec3& normal, const SurfacePoint& emitter) const {
  const State& s = *state_;
  const uint32_t index = s.meshes.find(emitter.instance, emitter.triangle);
  if (index == kNone) return 0.0f;
  const Vec3 to_point = emitter.position - position;
  const float distance = glm::length(to_point);
  if (!(distance > 0.0f)) return 0.0f;
  if (has_lone_) return patch_density(lone_.patch, position, normal, to_point / distance, distance);
  Shares shares;
  if (!s.shares(position, normal, shares) || !(shares.weight[kTree] > 0.0f)) return 0.0f;
  const float probability = s.tree.probability(uint32_t(s.lamps.size()) + index, position, normal);
  const float density = patch_density(s.meshes.patches()[index], position, normal, to_point / distance, distance);
  return shares.weight[kTree] * probability * density;
}

float Lights::density_of_light(const Vec3& position, const Vec3& normal, const Vec3& direction,
                               const LightHit& hit) const {
  const State& s = *state_;
  if (hit.light >= s.lamps.size()) return 0.0f;
  Shares shares;
  if (!s.shares(position, normal, shares) || !(shares.weight[kTree] > 0.0f)) return 0.0f;
  return shares.weight[kTree] * s.tree.probability(hit.light, position, normal) *
         lamp_density(s.lamps[hit.light], position, normal, direction, hit.t);
}

float Lights::density_of_world(const Vec3& position, const Vec3& normal, const Vec3& direction) const {
  const State& s = *state_;
  if (!(s.world_weight > 0.0f)) return 0.0f;
  Shares shares;
  if (!s.shares(position, normal, shares)) return 0.0f;
  return shares.weight[kWorld] * s.world_density(normal, direction);
}

bool Lights::State::hit_lamp(uint32_t index, const Ray& ray, float t_max, LightHit& out, Vec2& uv) const {
  const Lamp& lamp = lamps[index];
  LampHit hit;
  if (!(lamp.visibility & ray.mask) || !intersect_lamp(lamp, ray.origin, ray.direction, ray.t_min, t_max, hit))
    return false;
  out = {hit.t, hit.radiance, index, lamp.visibility};
  uv = hit.uv;
  return true;
}

bool Lights::intersect(const Ray& ray, LightHit& out) const {
  const State& s = *state_;
  out = LightHit{};
  float nearest = ray.t_max;
  Vec2 uv(0.0f);
  s.lamp_bvh.meet(ray, ray.t_max, [&](uint32_t lamp) {
    if (s.hit_lamp(lamp, ray, nearest, out, uv)) nearest = out.t;
    return nearest;
  });
  if (out.light == kNone) return false;
  out.radiance = s.with_graph(s.lamps[out.light], out.radiance, ray.direction, uv);
  return true;
}

void Lights::visit_hits(const Ray& ray, void (*visit)(const void*, const LightHit&), const void* context) const {
  const State& s = *state_;
  s.lamp_bvh.meet(ray, ray.t_max, [&](uint32_t lamp) {
    LightHit hit;
    Vec2 uv;
    if (s.hit_lamp(lamp, ray, ray.t_max, hit, uv)) {
      hit.radiance = s.with_graph(s.lamps[lamp], hit.radiance, ray.direction, uv);
      visit(context, hit);
    }
    return ray.t_max;
  });
}

bool Lights::has_shapes() const { return !state_->lamp_bvh.empty(); }

bool Lights::has_suns() const {
  return std::any_of(state_->suns.begin(), state_->suns.end(), [](const Lamp& sun) { return sun.hittable; });
}

uint32_t Lights::sun_count() const { return uint32_t(state_->suns.size()); }

Rgb Lights::escaped_suns(const Vec3& direction, uint32_t ray_visibility, uint32_t index, float& density,
                         const Vec3& position, const Vec3& normal) const {
  const State& s = *state_;
  density = 0.0f;
  const Lamp& sun = s.suns[index];
  if (!sun.hittable || !(sun.visibility & ray_visibility)) return Rgb(0.0f);
  // 1 − cos of the angle to the sun's centre, without cancellation.
  const Vec3 chord = direction + sun.axis;
  if (0.5f * glm::dot(chord, chord) > sun.one_minus_cos) return Rgb(0.0f);
  Shares shares;
  const float weight = sun_weight(sun, normal);
  if (s.shares(position, normal, shares) && weight > 0.0f)
    density = shares.weight[kSuns] * weight / s.suns_weight(normal) * cone_density(sun.one_minus_cos);
  return s.with_graph(sun, sun_radiance(sun, direction), direction, Vec2(0.0f));
}

}  // namespace afterglow
