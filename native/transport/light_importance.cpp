// SPDX-License-Identifier: GPL-3.0-or-later
// Importance paths and the grid that they leave: see light_importance.h. Blocks of paths are counted in whole numbers,
// so that the grid does not depend on who traced first.
#include "transport/light_importance.h"

#include <algorithm>
#include <array>
#include <mutex>

#include "base/parallel.h"
#include "lights/camera.h"
#include "lights/light_emission.h"
#include "lights/shapes.h"

namespace afterglow {

namespace {

constexpr int kCells = 48;                        // along an edge of the box around the scene's ball
constexpr uint32_t kPaths = 1024;                 // from the camera's place
constexpr uint32_t kSurfaces = 3;                 // that each meets and leaves
constexpr uint32_t kFewest = 64;                  // paths that must have met anything
constexpr float kWeights[kSurfaces] = {4, 2, 1};  // importance is reflected by half
constexpr int kMostPassages = 16;
constexpr double kPassing =
    0.25;                  // of the chances come from places where importance passes, the others where it arrives
constexpr int kSteps = 4;  // of chances, each a quarter of the one before
constexpr float kUnreached = 0.25f;  // chance of a light where no importance was seen to pass
constexpr uint32_t kTries = 128;     // places of a path

/// Goes through what has no diffuse lobe. False: nothing was met.
bool next_surface(const WalkScene& walk, Ray& ray, PathContext& context, SurfacePoint& point, RayCounts& counts) {
  for (int passage = 0; passage < kMostPassages; ++passage) {
    Hit hit;
    counts.bounce++;
    if (!walk.scene.rays.closest(ray, hit)) return false;
    point = surface_point(walk.scene.scene, ray, hit, walk.with_uv);
    if (!walk.with_uv && walk.scene.materials.reads_uv(point.material)) point.uv = surface_uv(walk.scene.scene, point);
    if (walk.shows(hit.instance)) {
      Surface surface, diffuse;
      context.ray_length = hit.t;
      walk.scene.materials.shade(walk.scene.scene, point, context, surface);
      const bool clear = max_component(surface.transparency) > 0.5f;
      const bool emits_alone = surface.count == 0;
      split_diffuse(surface, diffuse);
      if (!clear && (diffuse.count > 0 || emits_alone)) return true;
    }
    ray.origin = offset_origin(point, ray.direction);
    ray.t_min = 0.0f;
  }
  return false;
}

double total(const std::vector<float>& cells) {
  double sum = 0.0;
  for (const float c : cells) sum += c;
  return sum;
}

/// Each cell shares with its neighbours, for paths are few.
void smooth(std::vector<float>& cells) {
  std::vector<float> from(cells.size());
  for (const int step : {1, kCells, kCells * kCells}) {
    from.swap(cells);
    for (int i = 0; i < int(from.size()); ++i) {
      const int at = i / step % kCells;
      cells[size_t(i)] = 0.5f * from[size_t(i)] + 0.25f * from[size_t(at > 0 ? i - step : i)] +
                         0.25f * from[size_t(at + 1 < kCells ? i + step : i)];
    }
  }
}

}  // namespace

Viewpoint snapped_viewpoint(const CommittedScene& scene) {
  Viewpoint v;
  LightEmission::surrounding_ball(scene.scene.bounds(), v.center, v.radius);
  const Vec3 eye = CameraRays(scene.scene.camera(), scene.scene.origin(), 2, 2).ray(Vec2(1.0f), Vec2(0.5f)).ray.origin;
  v.position = eye;
  if (!(v.radius > 0.0f) || !is_finite(eye)) return v;
  const float step = v.radius / 8.0f;
  const Vec3 at = (eye - v.center) / step, corner = glm::floor(at);
  std::array<std::pair<float, Vec3>, 8> places;
  for (int i = 0; i < 8; ++i) {
    const Vec3 place = corner + Vec3(i & 1, i >> 1 & 1, i >> 2);
    places[size_t(i)] = {glm::distance(place, at), v.center + step * place};
  }
  std::stable_sort(places.begin(), places.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  for (const auto& [distance, place] : places) {
    Ray ray;
    const Vec3 way = place - eye;
    ray.origin = eye, ray.t_max = glm::length(way), ray.mask = kVisibleCamera;
    ray.direction = ray.t_max > 0.0f ? way / ray.t_max : Vec3(0, 0, 1);
    if (scene.rays.occluded(ray)) continue;
    v.position = place;
    break;
  }
  return v;
}

void LightImportance::build(const WalkScene& walk, const Viewpoint& from, uint32_t threads, RayCounts& counts) {
  chance_.clear();
  if (!(from.radius > 0.0f) || !is_finite(from.position)) return;
  lower_ = from.center - from.radius, size_ = 2.0f * from.radius / float(kCells);
  // From outside of the scene all paths go towards it.
  const float distance = glm::distance(from.position, from.center), sine = from.radius / std::max(distance, 1e-30f);
  const float spread = sine < 1.0f ? 1.0f - std::sqrt(1.0f - sine * sine) : 2.0f;
  const Frame towards(distance > 0.0f ? (from.center - from.position) / distance : Vec3(0, 0, 1));
  // Half of it counts where it passes, half where it arrives.
  std::vector<float> passes(kCells * kCells * kCells, 0.0f), arrives(passes.size(), 0.0f);
  uint32_t met = 0;
  std::mutex mutex;
  parallel_blocks(kPaths, 64, threads, [&](size_t begin, size_t end) {
    RayCounts mine;
    uint32_t found = 0;
    std::vector<std::pair<uint32_t, float>> passed, ended;  // cells and weights
    for (size_t i = begin; i < end; ++i) {
      Sampler sampler(0x1a7u, uint32_t(i));
      Ray ray;
      ray.origin = from.position;
      ray.direction = glm::normalize(towards.to_world(square_to_cone(sampler.next2(), spread)));
      ray.mask = kVisibleCamera;
      PathContext context;
      SurfacePoint point;
      if (!next_surface(walk, ray, context, point, mine)) continue;
      found++;
      for (uint32_t surface = 0; surface < kSurfaces; ++surface) {
        const Vec3 way = glm::normalize(Frame(point.normal).to_world(square_to_cosine_hemisphere(sampler.next2())));
        if (glm::dot(way, point.face_normal) <= 0.0f) break;
        ray.origin = offset_origin(point, way), ray.direction = way;
        ray.t_min = 0.0f, ray.t_max = kInfinity, ray.mask = kVisibleDiffuse;
        context.kind = PathContext::kDiffuse | PathContext::kReflection;
        context.depth++;
        const Vec3 start = ray.origin;
        if (!next_surface(walk, ray, context, point, mine)) break;
        const float length = glm::distance(start, point.position);
        const int steps = std::max(int(std::ceil(2.0f * length / size_)), 1);
        for (int s = 0; s <= steps; ++s)
          passed.emplace_back(uint32_t(cell(glm::mix(start, point.position, float(s) / float(steps)))),
                              kWeights[surface]);
        ended.emplace_back(uint32_t(cell(point.position)), kWeights[surface]);
      }
    }
    const std::lock_guard lock(mutex);
    counts += mine, met += found;
    for (const auto& [at, weight] : passed) passes[at] += weight;
    for (const auto& [at, weight] : ended) arrives[at] += weight;
  });
  if (met < kFewest) return;
  reached_.resize(passes.size());
  for (size_t i = 0; i < passes.size(); ++i)
    reached_[i] = passes[i] >= 2.0f * kWeights[0] ? 1.0f : passes[i] > 0.0f ? 0.5f : kUnreached;
  smooth(passes), smooth(arrives);
  const double through = total(passes), into = total(arrives);
  if (!(into > 0.0)) return;
  std::vector<float>& share = passes;
  double squares = 0.0;
  for (size_t i = 0; i < share.size(); ++i) {
    share[i] = float(kPassing * passes[i] / through + (1.0 - kPassing) * arrives[i] / into);
    squares += double(share[i]) * share[i];
  }
  const float usual = float(0.5 * squares / total(share));
  chance_.resize(share.size());
  for (size_t i = 0; i < share.size(); ++i) {
    const float step = std::round(0.5f * std::log2(std::max(share[i] / usual, 1e-30f)));
    chance_[i] = step < float(-kSteps) ? 0.0f : std::exp2(2.0f * std::min(step, 0.0f));
  }
  const double taken = total(chance_) / double(chance_.size());
  const double edge = 2.0 * double(from.radius), some = 1.0 - std::pow(1.0 - taken, double(kTries));
  density_ = float(some / (taken * edge * edge * edge));
}

size_t LightImportance::cell(const Vec3& position) const {
  const Vec3 at = glm::clamp((position - lower_) / size_, Vec3(0.0f), Vec3(float(kCells) - 0.5f));
  return (size_t(at.z) * kCells + size_t(at.y)) * kCells + size_t(at.x);
}

bool LightImportance::sample(uint32_t seed, uint32_t path, Vec3& place) const {
  for (uint32_t i = 0; i < kTries; ++i) {
    const auto u = Sampler(hash(seed, i, 0x1a7u), path).block(0);
    place = lower_ + size_ * float(kCells) * Vec3(u[0], u[1], u[2]);
    if (u[3] < chance_[cell(place)]) return true;
  }
  return false;
}

/// Looked up a cell before the surface: behind a thin wall there may be another place.
float LightImportance::at(const Vec3& position, const Vec3& normal) const {
  return std::max(reached_[cell(position + size_ * normal)], reached_[cell(position + 2.0f * size_ * normal)]);
}

/// From cell to cell (Amanatides and Woo 1987).
float LightImportance::along(const Vec3& origin, const Vec3& direction, float length) const {
  float begin = 0.0f, end = length;
  Vec3 next(kInfinity), span(kInfinity);
  for (int c = 0; c < 3; ++c) {
    if (std::fabs(direction[c]) < 1e-12f) {
      if (origin[c] < lower_[c] || origin[c] >= lower_[c] + size_ * float(kCells)) return 0.0f;
      continue;
    }
    const float one = (lower_[c] - origin[c]) / direction[c];
    const float other = (lower_[c] + size_ * float(kCells) - origin[c]) / direction[c];
    begin = std::max(begin, std::min(one, other)), end = std::min(end, std::max(one, other));
  }
  if (!(begin < end)) return 0.0f;
  const Vec3 inside = (origin + begin * direction - lower_) / size_;
  int at[3], step[3];
  for (int c = 0; c < 3; ++c) {
    at[c] = std::clamp(int(std::floor(inside[c])), 0, kCells - 1);
    step[c] = direction[c] < 0.0f ? -1 : 1;
    if (std::fabs(direction[c]) < 1e-12f) continue;
    span[c] = size_ / std::fabs(direction[c]);
    next[c] = (lower_[c] + size_ * float(at[c] + (step[c] > 0)) - origin[c]) / direction[c];
  }
  float sum = 0.0f;
  while (begin < end) {
    const int c = next.x < next.y ? (next.x < next.z ? 0 : 2) : next.y < next.z ? 1 : 2;
    const float until = std::min(next[c], end);
    sum += chance_[(size_t(at[2]) * kCells + size_t(at[1])) * kCells + size_t(at[0])] * std::max(until - begin, 0.0f);
    begin = std::max(until, begin);
    at[c] += step[c], next[c] += span[c];
    if (at[c] < 0 || at[c] >= kCells) break;
  }
  return density_ * sum;
}

}  // namespace afterglow
