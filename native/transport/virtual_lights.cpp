// SPDX-License-Identifier: GPL-3.0-or-later
// Light paths and what is asked of the lights that they leave: see virtual_lights.h.
#include "transport/virtual_lights.h"

#include <algorithm>
#include <mutex>

#include "base/parallel.h"

namespace afterglow {

namespace {

constexpr uint32_t kStartDimensions = 8, kBounceDimensions = 8;
constexpr uint32_t kBeginnings = 4;  // of a path, one of which is gone on with
constexpr int kMostPassages = 64;    // mirrors, glass and transparent surfaces between two diffuse ones

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

float brightness(const Rgb& c) { return (c.x + c.y + c.z) / 3.0f; }

class LightPath {
 public:
  LightPath(const WalkScene& walk, const LightEmission& emission, const SlotPlan& plan, RayCounts& counts)
      : walk_(walk), emission_(emission), plan_(plan), counts_(counts) {}

  /// Most rays of a sky miss a room with a window: of several beginnings the first that meets a surface is taken, with
  /// the strength of their share that does. Which one that is depends on nothing but who meets something, so the mean
  /// stays.
  void trace(uint32_t path, uint32_t seed, std::vector<VirtualLight>& out) {
    uint32_t alive = 0;
    VirtualLight first;
    LightPath chosen = *this;
    bool goes_on = false;
    uint32_t index = path;
    for (uint32_t candidate = 0; candidate < kBeginnings; ++candidate) {
      const uint32_t at = path + candidate * plan_.paths[0];
      VirtualLight light;
      const bool more = begin(at, seed, light);
      if (!light.alive || alive++ > 0) continue;
      first = light, goes_on = more, index = at;
      chosen.take(*this);
    }
    if (!alive) return;
    const float share = float(alive) / float(kBeginnings);
    first.front *= share, first.back *= share;
    out[plan_.first[0] + path] = first;
    take(chosen);
    throughput_ *= share;
    Sampler sampler(seed, index);
    for (uint32_t bounce = 1; goes_on && bounce < plan_.paths.size() && path < plan_.paths[bounce]; ++bounce) {
      sampler.set_dimension(kStartDimensions + kBounceDimensions * bounce);
      goes_on = next_light(sampler, 1.0f / float(plan_.paths[bounce]), out[plan_.first[bounce] + path]);
    }
  }

 private:
  /// From the emitter to the first diffuse surface. False: the path ends there.
  bool begin(uint32_t index, uint32_t seed, VirtualLight& light) {
    Sampler sampler(seed, index);
    const float u_choice = sampler.next1();
    const Vec2 place = sampler.next2(), way = sampler.next2();
    if (!emission_.sample(u_choice, place, way, from_)) return false;
    ray_ = from_.ray;
    first_ = true;
    context_ = PathContext{};
    context_.kind = PathContext::kDiffuse | PathContext::kReflection;
    context_.drop_glossy = !walk_.limits.caustics_reflective;
    context_.drop_refractive = !walk_.limits.caustics_refractive;
    throughput_ = Rgb(1.0f);
    sampler.set_dimension(kStartDimensions);
    return next_light(sampler, 1.0f / float(plan_.paths[0]), light);
  }

  /// Stands where another path stands.
  void take(const LightPath& other) {
    from_ = other.from_, ray_ = other.ray_, context_ = other.context_;
    throughput_ = other.throughput_, first_ = other.first_;
  }

  /// Goes on to the next surface with a diffuse lobe and leaves a light there. False: the path ended.
  bool next_light(Sampler& sampler, float share, VirtualLight& light) {
    const float u_lobe = sampler.next1(), u_straight = sampler.next1();
    const Vec2 u = sampler.next2();
    for (int passage = 0; passage < kMostPassages; ++passage) {
      Hit hit;
      counts_.bounce++;
      if (!walk_.scene.rays.closest(ray_, hit)) return false;
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
      if (passes_straight(surface, std::fmod(u_straight + turned, 1.0f))) {
        go_straight(point);
        continue;
      }
      const Shares shares = take_diffuse(surface);
      const bool has_diffuse = !is_black(shares.front) || !is_black(shares.back) || surface.count == 0;
      if (!has_diffuse) {
        if (!bounce_on(surface, point, std::fmod(u_lobe + turned, 1.0f), u)) return false;
        continue;
      }
      leave_light(point, shares, share, light);
      return scatter(surface, shares, point, u_lobe, u);
    }
    return false;
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
  RayCounts& counts_;
  EmittedRay from_;
  Ray ray_;
  PathContext context_;
  Rgb throughput_{1.0f};
  bool first_ = true;
};

}  // namespace

SlotPlan plan_slots(uint32_t count, uint32_t bounces) {
  SlotPlan plan;
  if (!count || !bounces) return plan;
  const auto slots_of = [&](uint32_t paths) {
    uint64_t sum = 0;
    for (uint32_t b = 0; b < bounces; ++b) sum += std::max(paths >> std::min(b, 31u), 1u);
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
    const uint32_t paths = std::max(low >> std::min(b, 31u), 1u);
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
  std::mutex mutex;
  parallel_blocks(plan.paths[0], 32, options.threads, [&](size_t begin, size_t end) {
    RayCounts mine;
    for (size_t i = begin; i < end; ++i) LightPath(walk, emission, plan, mine).trace(uint32_t(i), seed, lights);
    const std::lock_guard lock(mutex);
    counts += mine;
  });
  return lights;
}

void VirtualLightColumns::fill(std::vector<VirtualLight> from) {
  lights = std::move(from);
  count = uint32_t(lights.size());
  two_sided = false;
  const size_t size = (size_t(count) + 15) / 16 * 16;
  lights.resize(size);
  for (auto* column : {&x, &y, &z, &nx, &ny, &nz, &front[0], &front[1], &front[2], &back[0], &back[1], &back[2]})
    column->assign(size, 0.0f);
  for (size_t i = 0; i < size; ++i) {
    const VirtualLight& l = lights[i];
    x[i] = l.position.x, y[i] = l.position.y, z[i] = l.position.z;
    if (l.black()) continue;  // no normal: no cosine, no light
    nx[i] = l.normal.x, ny[i] = l.normal.y, nz[i] = l.normal.z;
    for (int c = 0; c < 3; ++c) front[c][i] = l.front[c], back[c][i] = l.back[c];
    two_sided |= !is_black(l.back);
  }
}

void geometry_terms(const VirtualLightColumns& c, const Vec3& p, const Vec3& n, float bound, float* out) {
  const float near = 0.8f * bound, scale = bound > 0.0f ? 1.0f / (0.4f * bound) : 0.0f;
  const size_t size = c.padded();
  const float *x = c.x.data(), *y = c.y.data(), *z = c.z.data(), *nx = c.nx.data(), *ny = c.ny.data(),
              *nz = c.nz.data();
  const bool two_sided = c.two_sided;
  for (size_t i = 0; i < size; ++i) {
    const float dx = x[i] - p.x, dy = y[i] - p.y, dz = z[i] - p.z;
    const float d2 = std::max(dx * dx + dy * dy + dz * dz, 1e-30f);
    const float here = std::max(dx * n.x + dy * n.y + dz * n.z, 0.0f);
    const float there = -(dx * nx[i] + dy * ny[i] + dz * nz[i]);
    float t = bound > 0.0f ? (std::sqrt(d2) - near) * scale : 1.0f;
    t = std::min(std::max(t, 0.0f), 1.0f);
    const float f = t * t * (3.0f - 2.0f * t);
    const float g = here * there / d2 / d2 * f;
    out[i] = two_sided ? g : std::max(g, 0.0f);
  }
}

void geometry_slopes(const VirtualLightColumns& c, const Vec3& p, const Frame& frame, float bound,
                     GeometrySlopes& out) {
  const float near = 0.8f * bound, scale = bound > 0.0f ? 1.0f / (0.4f * bound) : 0.0f;
  const Vec3 t = frame.t, b = frame.b, n = frame.n;
  const size_t size = c.padded();
  out.resize(size);
  const float *x = c.x.data(), *y = c.y.data(), *z = c.z.data(), *nx = c.nx.data(), *ny = c.ny.data(),
              *nz = c.nz.data();
  float *step_t = out.step_t.data(), *step_b = out.step_b.data(), *turn_t = out.turn_t.data(),
        *turn_b = out.turn_b.data();
  const float least = c.two_sided ? -kInfinity : 0.0f;
#pragma GCC ivdep
  for (size_t i = 0; i < size; ++i) {
    const float dx = x[i] - p.x, dy = y[i] - p.y, dz = z[i] - p.z;
    const float d2 = std::max(dx * dx + dy * dy + dz * dz, 1e-30f), d = std::sqrt(d2);
    const float here = dx * n.x + dy * n.y + dz * n.z;
    const float there = -(dx * nx[i] + dy * ny[i] + dz * nz[i]);
    float s = bound > 0.0f ? (d - near) * scale : 1.0f;
    s = std::min(std::max(s, 0.0f), 1.0f);
    const float f = s * s * (3.0f - 2.0f * s), slope = 6.0f * s * (1.0f - s) * scale;  // of the bound
    const float over_d4 = 1.0f / d2 / d2, above = here > 0.0f ? over_d4 : 0.0f, lit = there > least ? above : 0.0f;
    // Only the way to the light changes, by −step: cos of the place stays for steps along its plane.
    const float facing = lit * f * here, nearer = lit * here * there * (4.0f * f / d2 - slope / d);
    const float along_t = dx * t.x + dy * t.y + dz * t.z, along_b = dx * b.x + dy * b.y + dz * b.z;
    step_t[i] = facing * (nx[i] * t.x + ny[i] * t.y + nz[i] * t.z) + nearer * along_t;
    step_b[i] = facing * (nx[i] * b.x + ny[i] * b.y + nz[i] * b.z) + nearer * along_b;
    turn_t[i] = lit * f * there * along_t;
    turn_b[i] = lit * f * there * along_b;
  }
}

bool can_see(const Vec3& position, const Vec3& face_normal, const VirtualLight& light, bool front) {
  const Vec3 way = light.position - position;
  return glm::dot(way, face_normal) > 0.0f && (glm::dot(way, light.face_normal) < 0.0f) == front;
}

Ray visibility_ray(const Vec3& from, const VirtualLight& light) {
  const float side = glm::dot(from - light.position, light.face_normal) < 0.0f ? -light.lift : light.lift;
  const Vec3 way = light.position + side * light.face_normal - from;
  const float distance = glm::length(way);
  Ray ray;
  ray.origin = from;
  ray.direction = distance > 0.0f ? way / distance : Vec3(0, 0, 1);
  ray.t_max = distance * (1.0f - 4e-7f);
  ray.mask = kVisibleDiffuse;
  return ray;
}

Rgb visibility(const WalkScene& walk, const Ray& ray, RayCounts& counts) {
  counts.shadow++;
  if (!walk.shown && !walk.scene.effects.has(kTransparency)) return Rgb(walk.scene.rays.occluded(ray) ? 0.0f : 1.0f);
  PathContext context;
  context.depth = 1;
  return transmittance(walk, ray, context, counts);
}

}  // namespace afterglow
