// SPDX-License-Identifier: GPL-3.0-or-later
// Places and directions in which light leaves: see light_emission.h. Round lamps with a radius send parallel beams as
// wide as their disk, which is the light that a sphere sends in each direction (Keller 1997, section 4, with area
// sources).
#include "lights/light_emission.h"

#include <algorithm>

namespace afterglow {

namespace {

const PathContext kEmissionContext{0, 0, 0, 0, 0, 0, 0.0f, false, false};
constexpr uint32_t kWorldResolution = 256;

/// Half angle within which a spot shines, as its cosine; −1 where its cone is not round.
float spot_cosine(const Lamp& lamp) {
  if (!lamp.spot || lamp.cos_spot <= 0.0f) return -1.0f;
  const float z = glm::length(lamp.local_z);
  const bool even = std::fabs(glm::length(lamp.local_x) / z - 1.0f) < 1e-3f &&
                    std::fabs(glm::length(lamp.local_y) / z - 1.0f) < 1e-3f;
  return even ? std::max(lamp.cos_spot - 1e-5f, -1.0f) : -1.0f;
}

float solid_area(const EmissivePatch& t) {
  return (t.rectangle() ? 1.0f : 0.5f) * glm::length(glm::cross(t.edge_b, t.edge_c));
}

float unit_power(const Lamp& lamp, float radius) {
  const float light = luminance(lamp.radiance);
  switch (lamp.shape) {
    case LampShape::kPoint:
      return light * 2.0f * kPi * (1.0f - spot_cosine(lamp));
    case LampShape::kSphere:
    case LampShape::kDisk:
      return light * lamp.area * 2.0f * kPi * (1.0f - spot_cosine(lamp));
    case LampShape::kDirection:
      return light * kPi * radius * radius;
    case LampShape::kCone:
      return light * 2.0f * kPi * lamp.one_minus_cos * kPi * radius * radius;
    default:
      return light * lamp.area * kPi;
  }
}

}  // namespace

void LightEmission::surrounding_ball(const Box& bounds, Vec3& center, float& radius) {
  center = Vec3(0.0f), radius = 0.0f;
  if (bounds.empty()) return;
  const float exact = 0.5f * glm::length(bounds.size());
  if (!(exact > 0.0f) || !std::isfinite(exact)) return;
  // Powers of the fourth root of 2; the grid is a sixteenth of the radius, so that the ball grows by it at most.
  const float step = std::exp2(std::ceil(4.0f * std::log2(exact)) * 0.25f) / 16.0f;
  center = glm::round(bounds.center() / step) * step;
  radius = std::exp2(std::ceil(4.0f * std::log2(exact + glm::distance(center, bounds.center()))) * 0.25f);
}

float LightEmission::power_class(float power, float strongest) {
  if (!(power > 0.0f) || !(strongest > 0.0f)) return 1.0f / 256.0f;
  const float step = std::round(std::log2(power / strongest) / 4.0f);
  return std::exp2(4.0f * std::clamp(step, -2.0f, 0.0f));
}

void LightEmission::build(const Scene& scene, const Materials& materials) {
  scene_ = &scene, materials_ = &materials;
  emitters_.clear(), lamps_.clear(), patch_areas_.clear(), world_map_.clear();
  surrounding_ball(scene.bounds(), center_, radius_);
  far_ = false;
  for (const Handle handle : scene.light_handles()) {
    const Light& light = scene.light(handle);
    Light unit = light;
    unit.color = Rgb(1.0f), unit.power = 1.0f;
    std::string problem;
    const auto lamp = make_lamp(unit, handle, scene.origin(), problem);
    const Rgb strength = glm::max(light.color * light.power, Rgb(0.0f));
    if (!lamp || !is_finite(strength) || (lamp->infinite() && !(radius_ > 0.0f))) continue;
    Emitter e{.kind = Emitter::kLamp, .lamp = uint32_t(lamps_.size()), .strength = strength};
    if (!(light.visibility & kVisibleDiffuse)) e.strength = Rgb(0.0f);
    e.power = luminance(e.strength) * unit_power(*lamp, radius_);
    far_ |= lamp->infinite();
    lamps_.push_back(*lamp);
    emitters_.push_back(e);
  }
  meshes_.collect(scene, materials);
  const auto& patches = meshes_.patches();
  patch_areas_.resize(patches.size());
  for (uint32_t i = 0; i < patches.size();) {
    Emitter e{.kind = Emitter::kMesh, .first = i};
    for (; i < patches.size() && patches[i].instance == patches[e.first].instance; ++i) {
      const float area = solid_area(patches[i]);
      e.area += std::isfinite(area) ? area : 0.0f;
      patch_areas_[i] = e.area;
      e.power += 2.0f * kPi * area * std::max(luminance(materials.mean_emission(patches[i].material)), 0.0f);
    }
    e.count = i - e.first;
    if (e.area > 0.0f && (scene.instances()[patches[e.first].instance].visibility & kVisibleDiffuse))
      emitters_.push_back(e);
  }
  if (materials.has_world() && radius_ > 0.0f && (scene.world().visibility & kVisibleDiffuse)) {
    Emitter e{.kind = Emitter::kWorld};
    float mean = 0.0f;
    if (materials.world_constant()) {
      mean = luminance(materials.world(Vec3(0, 0, 1), kEmissionContext));
    } else {
      world_map_.build([&](const Vec3& d) { return materials.world(d, kEmissionContext); }, kWorldResolution);
      mean = world_map_.mean();
    }
    e.power = mean * 4.0f * kPi * kPi * radius_ * radius_;
    if (mean > 0.0f) emitters_.push_back(e), far_ = true;
  }
  float strongest = 0.0f, sum = 0.0f;
  for (const Emitter& e : emitters_) strongest = std::max(strongest, e.power);
  chances_.resize(emitters_.size()), cumulative_.resize(emitters_.size());
  for (size_t i = 0; i < emitters_.size(); ++i) sum += chances_[i] = power_class(emitters_[i].power, strongest);
  float before = 0.0f;
  for (size_t i = 0; i < emitters_.size(); ++i) {
    chances_[i] /= sum;
    cumulative_[i] = before += chances_[i];
  }
}

bool LightEmission::sample(float u_choice, const Vec2& place, const Vec2& way, EmittedRay& out) const {
  out = EmittedRay{};
  if (emitters_.empty()) return false;
  const size_t found = size_t(std::upper_bound(cumulative_.begin(), cumulative_.end(), u_choice) - cumulative_.begin());
  const size_t chosen = std::min(found, emitters_.size() - 1);
  const Emitter& e = emitters_[chosen];
  out.emitter = uint32_t(chosen);
  out.weight = 1.0f / chances_[chosen];
  out.ray.mask = kVisibleShadow;
  bool ok = false;
  if (e.kind == Emitter::kLamp) ok = sample_lamp_ray(e, place, way, out);
  if (e.kind == Emitter::kMesh) ok = sample_mesh_ray(e, place, way, out);
  if (e.kind == Emitter::kWorld) ok = sample_world_ray(place, way, out);
  return ok && std::isfinite(out.weight) && is_finite(out.flux);
}

/// A beam as wide as the scene's ball, from outside of it.
void LightEmission::from_far(const Vec3& direction, const Vec2& place, Ray& ray) const {
  const Vec2 disk = square_to_disk(place) * radius_;
  const Frame frame(direction);
  ray.direction = direction;
  ray.origin = center_ + disk.x * frame.t + disk.y * frame.b - 1.01f * radius_ * direction;
}

void LightEmission::far_through(const Vec3& place, Ray& ray) const {
  ray.origin = place - (glm::dot(place - center_, ray.direction) + 1.01f * radius_) * ray.direction;
}

bool LightEmission::sample_lamp_ray(const Emitter& e, const Vec2& place, const Vec2& way, EmittedRay& out) const {
  const Lamp& lamp = lamps_[e.lamp];
  Ray& ray = out.ray;
  switch (lamp.shape) {
    case LampShape::kDirection:
    case LampShape::kCone: {
      Vec3 direction = lamp.axis;
      if (lamp.shape == LampShape::kCone) {
        direction = glm::normalize(Frame(lamp.axis).to_world(square_to_cone(way, lamp.one_minus_cos)));
        out.weight /= cone_density(lamp.one_minus_cos);
      }
      from_far(direction, place, ray);
      out.weight *= out.beam = kPi * radius_ * radius_;
      return true;
    }
    case LampShape::kPoint:
    case LampShape::kSphere:
    case LampShape::kDisk: {
      const float cosine = spot_cosine(lamp);
      const Vec3 local = cosine > -1.0f ? square_to_cone(way, 1.0f - cosine) : square_to_sphere(way);
      ray.direction = cosine > -1.0f ? glm::normalize(Frame(lamp.axis).to_world(local)) : local;
      out.weight *= 2.0f * kPi * (1.0f - cosine);
      ray.origin = lamp.position;
      if (lamp.shape == LampShape::kPoint) return true;
      const Vec2 disk = square_to_disk(place);
      const Frame frame(ray.direction);
      ray.origin += lamp.radius * (disk.x * frame.t + disk.y * frame.b);
      if (lamp.shape == LampShape::kSphere)
        ray.origin += lamp.radius * std::sqrt(std::max(1.0f - glm::dot(disk, disk), 0.0f)) * ray.direction;
      out.weight *= kPi * lamp.radius * lamp.radius;
      return true;
    }
    default: {
      Vec2 p = place - 0.5f;
      if (lamp.shape == LampShape::kEllipse) p = 0.5f * square_to_disk(place);
      ray.origin = lamp.position + p.x * lamp.edge_u + p.y * lamp.edge_v;
      const Frame frame(lamp.axis);
      if (lamp.spread) {  // uniform over the tangents that the slats let through
        const Vec2 tangent = square_to_disk(way) * lamp.tan_half_spread;
        ray.direction = glm::normalize(lamp.axis + tangent.x * frame.t + tangent.y * frame.b);
        const float cosine = glm::dot(ray.direction, lamp.axis);
        out.weight *= lamp.area * kPi * lamp.tan_half_spread * lamp.tan_half_spread * cosine * cosine * cosine * cosine;
      } else {
        ray.direction = glm::normalize(frame.to_world(square_to_cosine_hemisphere(way)));
        out.weight *= lamp.area * kPi;
      }
      return true;
    }
  }
}

bool LightEmission::sample_mesh_ray(const Emitter& e, const Vec2& place, const Vec2& way, EmittedRay& out) const {
  // One number chooses the side, then the patch, then is a coordinate on it.
  const bool back = place.x >= 0.5f;
  const float target = std::min((back ? place.x - 0.5f : place.x) * 2.0f, 0x1.fffffep-1f) * e.area;
  const auto begin = patch_areas_.begin() + e.first, end = begin + e.count;
  const uint32_t index = e.first + std::min(uint32_t(std::upper_bound(begin, end, target) - begin), e.count - 1);
  const EmissivePatch& patch = meshes_.patches()[index];
  const float before = index > e.first ? patch_areas_[index - 1] : 0.0f, span = patch_areas_[index] - before;
  if (!(span > 0.0f)) return false;
  const Vec2 u(std::clamp((target - before) / span, 0.0f, 0x1.fffffep-1f), place.y);
  Hit hit;
  hit.instance = patch.instance, hit.triangle = patch.triangle;
  Vec2 p = u;
  if (!patch.rectangle()) {
    const float root = std::sqrt(u.x);
    p = {1.0f - root, u.y * root};
  }
  const bool beyond = patch.rectangle() && p.x + p.y > 1.0f;
  const uint8_t* corner = patch.corners[beyond];
  float weight[3] = {};
  weight[corner[0]] = beyond ? p.x + p.y - 1.0f : 1.0f - p.x - p.y;
  weight[corner[1]] = beyond ? 1.0f - p.y : p.x;
  weight[corner[2]] = beyond ? 1.0f - p.x : p.y;
  if (beyond) hit.triangle = patch.second;
  hit.u = weight[1], hit.v = weight[2], hit.t = 0.0f;
  const Vec3 geometric = glm::cross(patch.edge_b, patch.edge_c);
  const float length = glm::length(geometric);
  if (!(length > 0.0f)) return false;
  const Vec3 side = geometric * ((back ? -1.0f : 1.0f) / length);
  out.ray.direction = glm::normalize(Frame(side).to_world(square_to_cosine_hemisphere(way)));
  const Ray towards{Vec3(0.0f), 0.0f, -out.ray.direction, kInfinity, kVisibleAll};
  const SurfacePoint point = surface_point(*scene_, towards, hit, materials_->reads_uv(patch.material));
  out.ray.origin = offset_origin(point, out.ray.direction);
  out.flux = glm::max(materials_->emission(*scene_, point, kEmissionContext), Rgb(0.0f));
  out.weight *= 2.0f * e.area * kPi;
  return true;
}

bool LightEmission::sample_world_ray(const Vec2& place, const Vec2& way, EmittedRay& out) const {
  float density = 0.25f * kInvPi;
  const Vec3 from = world_map_.empty() ? square_to_sphere(way) : world_map_.sample(way, density);
  if (!(density > 0.0f)) return false;
  from_far(-from, place, out.ray);
  out.flux = glm::max(materials_->world(from, kEmissionContext), Rgb(0.0f));
  out.beam = kPi * radius_ * radius_;
  out.weight *= out.beam / density;
  return true;
}

Rgb LightEmission::arriving(const EmittedRay& from, const Vec3& position) const {
  const Emitter& e = emitters_[from.emitter];
  if (e.kind != Emitter::kLamp) return from.flux * from.weight;
  const Lamp& lamp = lamps_[e.lamp];
  const Vec3 back = -from.ray.direction;
  Rgb radiance = lamp.radiance;
  Vec2 uv(0.0f);
  if (lamp.shape == LampShape::kPoint) {
    LampSample s;
    if (!sample_lamp(lamp, position, Vec3(0.0f), Vec2(0.5f), s)) return Rgb(0.0f);
    radiance = s.radiance * (s.distance * s.distance), uv = s.uv;
  } else if (!lamp.infinite()) {
    LampHit hit;
    if (!intersect_lamp(lamp, position, back, 0.0f, kInfinity, hit)) return Rgb(0.0f);
    radiance = hit.radiance, uv = hit.uv;
  }
  if (lamp.has_graph) radiance *= materials_->light(lamp.handle, lamp_local(lamp, from.ray.direction), uv);
  const Rgb flux = radiance * e.strength * from.weight;
  return is_finite(flux) ? glm::max(flux, Rgb(0.0f)) : Rgb(0.0f);
}

}  // namespace afterglow
