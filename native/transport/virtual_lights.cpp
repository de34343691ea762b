// SPDX-License-Identifier: GPL-3.0-or-later
// Light paths and what is asked of the lights that they leave: see virtual_lights.h.
#include "transport/virtual_lights.h"

#include <algorithm>
#include <mutex>
#include <utility>

#include "base/parallel.h"
#include "transport/light_importance.h"

namespace afterglow {

namespace {

constexpr uint32_t kStartDimensions = 8, kBounceDimensions = 8;
constexpr uint32_t kBeginnings = 4, kFarBeginnings = 24;  // of a path, one of which is gone on with
constexpr uint32_t kWays = 8;                             // from a surface that a path met, one of which it goes
constexpr float kWhole = 0.25f;    // of the rays from far away go anywhere, the others where light matters
constexpr int kMostPassages = 64;  // mirrors, glass and transparent surfaces between two diffuse ones

/// What a surface does to light paths: diffuse lobes reflect and transmit, the others lead on.
struct Shares {
  Rgb front{0.0f}, back{0.0f};
};

Shares take_diffuse(Surface& surface) {
  Surface diffuse;
  split_diffuse(surface, diffuse);
  Shares shares;
  for (int i = 0; i < diffuse.count; ++i)
    (diffuse.lobes[i].kind == LobeKind::kTranslucent ? shares.back : shares.front) += diffuse.lobes[i].weight;
  return shares;
}

/// Of so many paths, those that fill a bounce. Bright rooms reflect about as much: lights of late bounces are then not
/// much stronger than those of early ones, each of which would be seen as a spot.
uint32_t going_on(uint32_t paths, uint32_t bounce) {
  return std::max(uint32_t(double(paths) * std::pow(0.6, double(bounce))), 1u);
}

float brightness(const Rgb& c) { return (c.x + c.y + c.z) / 3.0f; }

/// A point of a sequence, of which a path or a beginning takes its numbers.
struct PathPoint {
  uint32_t seed = 0, index = 0;
};

class LightPath {
 public:
  /// importance: null where all places count the same.
  LightPath(const WalkScene& walk, const LightEmission& emission, const SlotPlan& plan,
            const LightImportance* importance, RayCounts& counts)
      : walk_(walk), emission_(emission), plan_(plan), importance_(importance), counts_(counts) {}

  /// Most rays of a sky miss a room with a window: of several beginnings the first that meets a surface is taken.
  /// Which one that is depends on nothing but who meets something, so the mean stays. Returns how many did: with the
  /// strength of their share the lights are complete.
  uint32_t trace(uint32_t path, uint32_t seed, std::vector<VirtualLight>& out) {
    uint32_t alive = 0;
    VirtualLight first;
    LightPath chosen = *this;
    PathPoint chosen_point;
    for (uint32_t candidate = 0; candidate < beginnings(importance_); ++candidate) {
      // Few beginnings go on with one sequence, many take one each: of a path's own none is like another then.
      const PathPoint point = importance_ ? PathPoint{candidate ? hash(seed, candidate) : seed, path}
                                          : PathPoint{seed, path + candidate * plan_.paths[0]};
      VirtualLight light;
      begin(point, light);
      if (!light.alive) continue;
      const float chance = importance_ ? matters(light) : 1.0f;
      if (chance < 1.0f && unit_float(hash(point.seed, point.index, 0x51du)) >= chance) continue;
      if (alive++ > 0) continue;
      light.front /= chance, light.back /= chance;
      vertex_.throughput /= chance;
      first = light, chosen_point = point;
      chosen.take(*this);
    }
    if (!alive) return 0;
    out[plan_.first[0] + path] = first;
    take(chosen);
    for (uint32_t bounce = 1; bounce < plan_.paths.size() && path < plan_.paths[bounce]; ++bounce) {
      VirtualLight& light = out[plan_.first[bounce] + path];
      const uint32_t dimension = kStartDimensions + kBounceDimensions * bounce;
      const float share = 1.0f / float(plan_.paths[bounce]);
      if (!choose_way(chosen_point, dimension, share, light)) break;
    }
    return alive;
  }

  static uint32_t beginnings(const LightImportance* importance) { return importance ? kFarBeginnings : kBeginnings; }

 private:
  /// From the emitter to the first diffuse surface, where it leaves a light, if there is one.
  void begin(const PathPoint& at, VirtualLight& light) {
    Sampler sampler(at.seed, at.index);
    const float u_choice = sampler.next1();
    const Vec2 place = sampler.next2(), way = sampler.next2();
    if (!emission_.sample(u_choice, place, way, from_)) return;
    first_ = true;
    shadowless_ = emission_.shadowless(from_);
    guided_ = importance_ && from_.beam > 0.0f && !shadowless_;
    passes_ = 0.0f;
    if (guided_ && unit_float(hash(at.seed, at.index, 0x1a7u)) >= kWhole && !aim(at)) return;
    ray_ = from_.ray;
    context_ = PathContext{};
    context_.kind = PathContext::kDiffuse | PathContext::kReflection;
    context_.drop_glossy = !walk_.limits.caustics_reflective;
    context_.drop_refractive = !walk_.limits.caustics_refractive;
    throughput_ = Rgb(1.0f);
    if (shadowless_ && !enter(unit_float(hash(at.seed, at.index, 0x5adu)))) return;
    sampler.set_dimension(kStartDimensions);
    next_light(sampler, 1.0f / float(plan_.paths[0]), light);
  }

  /// Light of a lamp without shadows reaches every surface on its way: one of them is chosen, for all.
  bool enter(float u) {
    const Ray whole = ray_;
    std::vector<Ray> before;  // each surface
    Hit hit;
    for (int i = 0; i < kMostPassages; ++i) {
      const Ray at = ray_;
      counts_.bounce++;
      if (!walk_.scene.rays.closest(ray_, hit)) break;
      if (walk_.shows(hit.instance)) before.push_back(at);
      go_straight(surface_point(walk_.scene.scene, ray_, hit, false));
    }
    context_.transparent_depth = 0;
    ray_ = whole;
    if (before.empty()) return false;
    ray_ = before[std::min(size_t(u * float(before.size())), before.size() - 1)];
    throughput_ *= float(before.size());
    return true;
  }

  /// Sends the ray from far away through a place where light matters.
  bool aim(const PathPoint& at) {
    Vec3 through;
    if (!importance_->sample(at.seed, at.index, through)) return false;
    emission_.far_through(through, from_.ray);
    passes_ = glm::dot(through - from_.ray.origin, from_.ray.direction);
    return true;
  }

  /// Where the straight way from far away ends. False: before the place that it was to pass. Chosen ways are those that
  /// pass it, and how dense they are is known from all places along the way that was gone.
  bool weigh(const Vec3& end) {
    if (!guided_) return true;
    guided_ = false;
    const Ray& line = from_.ray;
    const float length = glm::dot(end - line.origin, line.direction);
    if (!(length >= passes_)) return false;
    const float anywhere = emission_.in_beam(line) ? kWhole / from_.beam : 0.0f;
    const float density = anywhere + (1.0f - kWhole) * importance_->along(line.origin, line.direction, length);
    throughput_ /= std::max(density * from_.beam, 1e-6f);
    return true;
  }

  float matters(const VirtualLight& light) const {
    const float front = importance_->at(light.position, light.normal);
    return is_black(light.back) ? front : std::max(front, importance_->at(light.position, -light.normal));
  }

  /// From the last surface on: of several ways one, with the strength of the mean of all; by how much light matters
  /// where they end (Talbot 2005, resampled importance sampling), or the first that meets a surface. False: none does.
  bool choose_way(const PathPoint& at, uint32_t dimension, float share, VirtualLight& light) {
    const LightPath here = *this;
    float weights = 0.0f, chosen_weight = 0.0f;
    LightPath chosen = *this;
    for (uint32_t i = 0; i < kWays; ++i) {
      take(here);
      throughput_ = vertex_.throughput, context_ = vertex_.context;
      Sampler sampler(i ? hash(at.seed, i, 0x3a9u) : at.seed, at.index);
      sampler.set_dimension(dimension - kBounceDimensions + 4);
      const float u_choice = sampler.next1(), u_lobe = sampler.next1();
      const Vec2 u = sampler.next2();
      VirtualLight found;
      sampler.set_dimension(dimension);
      if (!scatter(vertex_.surface, vertex_.shares, vertex_.point, u_lobe, u)) continue;
      next_light(sampler, share, found);
      if (!found.alive) continue;
      const float weight = importance_ ? matters(found) : 1.0f;
      weights += weight;
      if (importance_ ? u_choice * weights >= weight : weights > weight) continue;
      chosen.take(*this), chosen_weight = weight, light = found;
    }
    if (!(weights > 0.0f)) return false;
    take(chosen);
    const float strength = weights / (float(kWays) * chosen_weight);
    light.front *= strength, light.back *= strength;
    vertex_.throughput *= strength;
    return true;
  }

  /// Stands where another path stands.
  void take(const LightPath& other) {
    from_ = other.from_, ray_ = other.ray_, context_ = other.context_;
    throughput_ = other.throughput_, first_ = other.first_, guided_ = other.guided_;
    shadowless_ = other.shadowless_;
    vertex_ = other.vertex_;
  }

  /// Goes on to the next surface with a diffuse lobe and leaves a light there, unless the path ends.
  void next_light(Sampler& sampler, float share, VirtualLight& light) {
    const float u_lobe = sampler.next1(), u_straight = sampler.next1();
    const Vec2 u = sampler.next2();
    for (int passage = 0; passage < kMostPassages; ++passage) {
      Hit hit;
      counts_.bounce++;
      if (!walk_.scene.rays.closest(ray_, hit)) return;
      SurfacePoint point = surface_point(walk_.scene.scene, ray_, hit, walk_.with_uv);
      if (!walk_.with_uv && walk_.scene.materials.reads_uv(point.material))
        point.uv = surface_uv(walk_.scene.scene, point);
      if (!walk_.shows(hit.instance)) {
        go_straight(point);
        continue;
      }
      if (first_) start(point);
      Surface surface;
      context_.ray_length = hit.t;
      walk_.scene.materials.shade(walk_.scene.scene, point, context_, surface);
      const float turned = float(hash(uint32_t(passage)) >> 8) * 0x1p-24f;  // one more number for each passage
      const bool reached = std::exchange(shadowless_, false);               // it is this surface and no other
      if (!reached && passes_straight(surface, std::fmod(u_straight + turned, 1.0f))) {
        go_straight(point);
        continue;
      }
      if (!weigh(point.position)) return;
      const Shares shares = take_diffuse(surface);
      const bool has_diffuse = !is_black(shares.front) || !is_black(shares.back);
      if (!has_diffuse) {
        if (reached || !bounce_on(surface, point, std::fmod(u_lobe + turned, 1.0f), u)) return;
        continue;
      }
      leave_light(point, shares, share, light);
      vertex_ = {surface, shares, point, throughput_, context_};  // its ways are chosen later
      return;
    }
  }

  void start(const SurfacePoint& point) {
    throughput_ *= emission_.arriving(from_, point.position);
    first_ = false;
    ray_.mask = kVisibleDiffuse;
  }

  void go_straight(const SurfacePoint& point) {
    ray_.origin = offset_origin(point, ray_.direction);
    ray_.t_min = 0.0f;
    context_.transparent_depth++;
  }

  bool passes_straight(const Surface& surface, float u) {
    if (is_black(surface.transparency)) return false;
    const float through = brightness(surface.transparency);
    float rest = 0.0f;
    for (int i = 0; i < surface.count; ++i) rest += brightness(surface.lobes[i].weight);
    const float chance = rest > 0.0f ? through / (through + rest) : 1.0f;
    const bool passes = u < chance;
    throughput_ *= passes ? surface.transparency / chance : Rgb(1.0f / (1.0f - chance));
    return passes;
  }

  bool visible(const SurfacePoint& point) const {
    return walk_.scene.scene.instances()[point.instance].visibility & kVisibleDiffuse;
  }

  void leave_light(const SurfacePoint& point, const Shares& shares, float share, VirtualLight& light) const {
    light.alive = true;
    light.position = point.position;
    light.normal = point.normal, light.face_normal = point.face_normal;
    light.lift = point.error;
    if (!visible(point)) return;
    const Rgb intensity = throughput_ * (share * kInvPi);
    const auto clean = [](const Rgb& c) { return is_finite(c) ? glm::max(c, Rgb(0.0f)) : Rgb(0.0f); };
    light.front = clean(intensity * shares.front);
    light.back = clean(intensity * shares.back);
  }

  /// A new direction, through any lobe of the surface. Where it has but one kind, chance has no say and so colours do
  /// not change where paths go.
  bool scatter(const Surface& rest, const Shares& shares, const SurfacePoint& point, float u, const Vec2& u_way) {
    float weight[3] = {brightness(shares.front), brightness(shares.back), 0.0f};
    for (int i = 0; i < rest.count; ++i) weight[2] += brightness(rest.lobes[i].weight);
    const float sum = weight[0] + weight[1] + weight[2];
    int chosen = 0;
    float chance = 1.0f;
    if (sum > 0.0f) {
      float target = u * sum;
      while (chosen < 2 && target >= weight[chosen]) target -= weight[chosen++];
      while (chosen > 0 && !(weight[chosen] > 0.0f)) --chosen;
      chance = weight[chosen] / sum;
      u = std::clamp(target / weight[chosen], 0.0f, 0x1.fffffep-1f);
    }
    throughput_ /= chance;
    if (chosen == 2) return bounce_on(rest, point, u, u_way);
    throughput_ *= chosen ? shares.back : shares.front;
    const Vec3 normal = chosen ? -point.normal : point.normal;
    const Vec3 direction = glm::normalize(Frame(normal).to_world(square_to_cosine_hemisphere(u_way)));
    const float side = glm::dot(direction, point.face_normal);
    if (chosen ? side >= 0.0f : side <= 0.0f) return false;
    leave(point, direction);
    context_.kind = PathContext::kDiffuse | (chosen ? PathContext::kTransmission : PathContext::kReflection);
    return true;
  }

  bool bounce_on(const Surface& surface, const SurfacePoint& point, float u_lobe, const Vec2& u) {
    if (!surface.count) return false;
    const BsdfSample s = sample<false>(surface, point.face_normal, point.outgoing, u_lobe, u);
    if (!s.valid || !(s.value.density > 0.0f)) return false;
    throughput_ *= s.value.total() / s.value.density;
    leave(point, s.direction);
    return true;
  }

  void leave(const SurfacePoint& point, const Vec3& direction) {
    ray_.origin = offset_origin(point, direction);
    ray_.direction = direction;
    ray_.t_min = 0.0f, ray_.t_max = kInfinity;
    context_.depth++;
  }

  const WalkScene& walk_;
  const LightEmission& emission_;
  const SlotPlan& plan_;
  const LightImportance* importance_;
  RayCounts& counts_;
  EmittedRay from_;
  Ray ray_;
  PathContext context_;
  Rgb throughput_{1.0f};
  bool shadowless_ = false;             // the ray comes from a lamp without shadows
  bool first_ = true, guided_ = false;  // the density of its way is not yet known
  struct Vertex {
    Surface surface;  // its lobes that are not diffuse
    Shares shares;
    SurfacePoint point;
    Rgb throughput{1.0f};
    PathContext context;
  } vertex_;             // where the last light was left
  float passes_ = 0.0f;  // how far along its first ray the place lies that it was to pass
};

/// The share of beginnings that met something. Where few do it is that of all paths, and the paths that have one stand
/// for those that have none: who meets something says nothing of what is met, so the mean stays, and no light is
/// stronger than another by mere luck. Elsewhere each path has its own, which no other path changes.
void set_shares(const SlotPlan& plan, const std::vector<uint32_t>& alive, uint32_t beginnings, bool together,
                std::vector<VirtualLight>& lights) {
  const uint32_t paths = plan.paths[0];
  uint64_t all = 0;
  for (const uint32_t a : alive) all += a;
  for (size_t bounce = 0; bounce < plan.paths.size(); ++bounce) {
    const uint32_t count = plan.paths[bounce];
    uint32_t begun = 0;
    for (uint32_t path = 0; path < count; ++path) begun += alive[path] > 0;
    const double whole = double(all) / (double(beginnings) * paths) * count / std::max(begun, 1u);
    for (uint32_t path = 0; path < count; ++path) {
      VirtualLight& light = lights[plan.first[bounce] + path];
      const float share = together ? float(whole) : float(alive[path]) / float(beginnings);
      light.front *= share, light.back *= share;
    }
  }
}

}  // namespace

SlotPlan plan_slots(uint32_t count, uint32_t bounces) {
  SlotPlan plan;
  if (!count || !bounces) return plan;
  const auto slots_of = [&](uint32_t paths) {
    uint64_t sum = 0;
    for (uint32_t b = 0; b < bounces; ++b) sum += going_on(paths, b);
    return sum;
  };
  uint32_t low = 1, high = count;  // the most paths whose slots fit
  while (low < high) {
    const uint32_t middle = low + (high - low + 1) / 2;
    if (slots_of(middle) <= count)
      low = middle;
    else
      high = middle - 1;
  }
  for (uint32_t b = 0; b < bounces && plan.slots < count; ++b) {
    const uint32_t paths = going_on(low, b);
    plan.first.push_back(plan.slots), plan.paths.push_back(paths);
    plan.slots += paths;
  }
  return plan;
}

std::vector<VirtualLight> trace_virtual_lights(const WalkScene& walk, const LightEmission& emission,
                                               const VirtualLightOptions& options, RayCounts& counts) {
  const SlotPlan plan = plan_slots(options.count, options.bounces);
  std::vector<VirtualLight> lights(plan.slots);
  if (plan.paths.empty() || emission.empty()) return lights;
  const uint32_t seed = hash(0x5eedu, options.pattern);
  LightImportance importance;
  if (emission.far()) importance.build(walk, snapped_viewpoint(walk.scene), options.threads, counts);
  const LightImportance* used = importance.empty() ? nullptr : &importance;
  std::vector<uint32_t> alive(plan.paths[0]);
  std::mutex mutex;
  parallel_blocks(plan.paths[0], 32, options.threads, [&](size_t begin, size_t end) {
    RayCounts mine;
    for (size_t i = begin; i < end; ++i)
      alive[i] = LightPath(walk, emission, plan, used, mine).trace(uint32_t(i), seed, lights);
    const std::lock_guard lock(mutex);
    counts += mine;
  });
  set_shares(plan, alive, LightPath::beginnings(used), used, lights);
  return lights;
}

}  // namespace afterglow
