// SPDX-License-Identifier: GPL-3.0-or-later
// The walk that fills cells: see caching.h. Roth et al. 2020, (1), with two differences: the light of vertex j is
// multiplied with the throughputs between j' and j alone, because what is found at j has been reflected there already,
// and nothing is ever divided by an albedo, because a vertex starts its own product behind itself.
#include "methods/hash_cache/caching.h"

#include <algorithm>
#include <limits>
#include <mutex>

#include "base/parallel.h"

namespace afterglow::hash_cache {

namespace {

constexpr uint32_t kMostStored = 16;
constexpr float kMostLight = 1e30f;  // what is above is dropped and counted, as in the path tracer
constexpr size_t kBlock = 128;
constexpr size_t kFewBlock = 16;   // where a hundred paths are to occupy all threads
constexpr uint32_t kSettled = 32;  // samples from which on a path may end in a cell
constexpr float kLongest = 0.5f;   // of the way to a surface: the longest cell that a path may end in there

/// A vertex of the path that keeps a sample, and how much of the light that is found now would arrive there.
struct Stored {
  Vec3 position, face_normal, normal;
  uint32_t instance = 0;
  Rgb throughput{0.0f};  // cos / (pi × density) of the direction taken, times all factors since
  Rgb light{0.0f};       // irradiance / pi
  PathContext counts;    // scatterings as if the path began here: the limits are the path tracer's
  uint32_t before = 0;   // scatterings counted for it before its own
  bool sampled = false;  // a direction was asked for
  bool live = false;     // light still counts
  bool last = false;     // only light that is run into
};

struct PathInput {
  const WalkScene& walk;
  const Cells& cells;
  const CachingSettings& settings;
  WalkLimits limits;  // of each stored vertex
  uint32_t seed;
  bool whole = false;  // no path ends in a cell
};

class StoringVisitor {
 public:
  using Carries = void;
  using MayAnswer = void;
  explicit StoringVisitor(const PathInput& in)
      : in_(in), limits_(in.limits), store_(std::min(in.settings.store, kMostStored)) {
    count_bounce(later_, limits_, LobeClass::kDiffuse, false, false);
  }

  /// The point that asks, and the direction taken from there in proportion to the cosine.
  void begin(const CachePoint& p, PathContext& context) {
    count_ = 0, pending_ = 0;
    const uint32_t random = hash(hash_of(p, in_.seed), p.sample, 3);
    may_end_ = !in_.whole && !(unit_float(random) < in_.settings.long_paths);
    answered_ = false;
    level_ = std::min(int(in_.cells.grid.level(p.footprint * in_.settings.cell_pixels)) + kFartherLevels, kTopLevel);
    jitter_ = {unit_float(hash(random)) - 0.5f, unit_float(hash(random, 1u)) - 0.5f};
    vertices_ = 1;
    Stored& first = stored_[count_++] = Stored{};
    first.position = p.position, first.face_normal = p.face_normal, first.normal = p.normal;
    first.instance = p.instance;
    first.throughput = Rgb(1.0f);
    first.sampled = first.live = true;
    first.last = count_bounce(first.counts, limits_, LobeClass::kDiffuse, p.translucent, false);
    context = first.counts;
  }

  /// Light that the asking point gets from a light source.
  void add_direct(const Rgb& light) { stored_[0].light += light; }

  std::span<const Stored> stored() const { return {stored_, count_}; }

  void traced(const Ray&, bool) {}
  bool answered() const { return answered_; }
  bool may_end() const { return may_end_; }
  bool surface(const PathState& path, const SurfacePoint& point, const Surface& surface) {
    pending_ = count_;
    answered_ = false;
    bool front = false, back = false;
    for (int i = 0; i < surface.count; ++i) {
      front |=
          surface.lobes[i].kind < LobeKind::kMicrofacetReflection && surface.lobes[i].kind != LobeKind::kTranslucent;
      back |= surface.lobes[i].kind == LobeKind::kTranslucent;
    }
    if ((front || back) && vertices_ == 1 && may_end_) {
      answered_ = end(path, point, surface, front, back);
      if (answered_) vertices_ = store_;  // what other lobes find later is of no use to cells
    }
    if ((front || back) && vertices_ < store_) {
      vertices_++;
      if (front) store(point, 1.0f);
      if (back) store(point, -1.0f);
    }
    if (pending_ < count_ || !is_black(surface.transparency)) return true;
    for (const Stored& s : stored())
      if (s.live && !s.last) return true;
    return false;
  }
  void lit(const PathState&, const BsdfValue& value, const Rgb& light) {
    const Rgb found = value.total() * light;
    for (uint32_t i = 0; i < pending_; ++i)
      if (Stored& s = stored_[i]; s.live && !s.last) s.light += s.throughput * found;
  }
  /// A vertex's own direct light is looked for where the picture is made.
  void emitted(const PathState&, const Rgb& light) {
    for (uint32_t i = 0; i < count_; ++i)
      if (Stored& s = stored_[i]; s.live && s.counts.depth > (i || !in_.settings.direct ? 1 : 0) + s.before)
        s.light += s.throughput * light;
  }
  void escaped(const PathState& path, const Rgb& light) {
    if (!is_black(light)) emitted(path, light);
  }
  void held_out(const PathState&, float) {}
  void scattered(const PathState&, const BsdfSample&) {}

  void turned(const BsdfSample& s) {
    for (uint32_t i = 0; i < pending_; ++i) {
      Stored& before = stored_[i];
      if (!before.live) continue;
      if (before.last || !s.valid)
        before.live = false;
      else
        before.last = count_bounce(before.counts, limits_, s.pass, s.transmitted, s.delta);
    }
    for (uint32_t i = pending_; i < count_; ++i) {  // the surface that the path has just left
      Stored& here = stored_[i];
      here.sampled = true;
      const float cosine = glm::dot(here.normal, s.direction);
      if (!s.valid || s.delta || !(s.value.density > 0.0f) || !(cosine > 0.0f)) continue;
      if (!(glm::dot(here.face_normal, s.direction) > 0.0f)) continue;
      here.throughput = Rgb(cosine / (kPi * s.value.density));
      here.live = true;
      here.last = count_bounce(here.counts, limits_, s.pass, s.transmitted, s.delta);
    }
  }
  Rgb carried(const Rgb& factor) {
    Rgb most(0.0f);
    for (uint32_t i = 0; i < count_; ++i) {
      Stored& s = stored_[i];
      if (!s.live) continue;
      if (i < pending_) s.throughput *= factor;
      most = glm::max(most, s.throughput);
    }
    pending_ = count_;
    return most;
  }

 private:
  /// The light that other surfaces send to this one, from a cell on the way that is much shorter than the way and holds
  /// samples enough, for all of the surface's sides or for none.
  bool end(const PathState& path, const SurfacePoint& point, const Surface& surface, bool front, bool back) {
    if (stored_[0].last) return false;
    const float longest = kLongest * path.context.ray_length;
    Known records[2] = {};
    if (front && !(records[0] = settled(point, 1.0f, longest))) return false;
    if (back && !(records[1] = settled(point, -1.0f, longest))) return false;
    Rgb light(0.0f);
    for (int i = 0; i < surface.count; ++i)
      if (surface.lobes[i].kind < LobeKind::kMicrofacetReflection)
        light += surface.lobes[i].weight * records[surface.lobes[i].kind == LobeKind::kTranslucent].light;
    for (uint32_t i = 0; i < count_; ++i)
      if (Stored& s = stored_[i]; s.live && !s.last) s.light += s.throughput * light;
    return true;
  }
  Known settled(const SurfacePoint& point, float side, float longest) const {
    const Grid& grid = in_.cells.grid;
    const uint32_t owner = owner_of(point.instance, point.face_normal * side) | kOnTheWay;
    const Frame frame(point.face_normal);
    const Vec3 offset = jitter_.x * frame.t + jitter_.y * frame.b;
    for (int level = level_; level <= kTopLevel && grid.size(level) <= longest; ++level) {
      Known k = in_.cells.find(grid.cell(point.position + offset * grid.size(level), owner, level));
      if (k.count < kSettled) k = in_.cells.find(grid.cell(point.position, owner, level));
      if (k.count >= kSettled) return k;
    }
    return {};
  }

  void store(const SurfacePoint& point, float side) {
    if (count_ == kMostStored) return;
    Stored& s = stored_[count_++] = Stored{};
    s.counts = later_;
    s.before = later_.depth;
    s.position = point.position, s.instance = point.instance;
    s.face_normal = point.face_normal * side, s.normal = point.normal * side;
  }

  const PathInput& in_;
  const WalkLimits& limits_;
  const uint32_t store_;
  PathContext later_;  // of a surface that is not the path's first
  bool may_end_ = false, answered_ = false;
  int level_ = 0;  // of the cells on the way
  Vec2 jitter_{0.0f};
  Stored stored_[kMostStored];
  uint32_t count_ = 0, pending_ = 0;  // of stored vertices; of those before the surface where the path stands
  uint32_t vertices_ = 0;             // surfaces that keep samples, whatever the sides
};

SurfacePoint start_of(const CachePoint& p) {
  SurfacePoint point;
  point.position = p.position, point.face_normal = p.face_normal, point.error = p.error;
  return point;
}

/// What the light sources send to the point that asks: irradiance / pi, weighed against the direction that is taken.
template <uint32_t kFeatures>
Rgb direct_light(const PathInput& in, const CachePoint& p, float u_light, const Vec2& u, RayCounts& counts) {
  LightSample light;
  if (!in.walk.scene.lights.sample(p.position, p.normal, u_light, u, light)) return Rgb(0.0f);
  const float density = glm::dot(p.normal, light.direction) * kInvPi;
  if (!(density > 0.0f) || !(glm::dot(p.face_normal, light.direction) > 0.0f)) return Rgb(0.0f);
  if (!(light.visibility & kVisibleDiffuse)) return Rgb(0.0f);
  const float weight = light.delta ? 1.0f : power_heuristic(light.density, density);
  const Rgb arriving = light.radiance * (density * weight / light.density);
  if (!light.cast_shadow) return arriving;
  const Ray ray = shadow_ray(start_of(p), light);
  counts.shadow++;
  if constexpr (kFeatures & kFeatureStraight) return arriving * transmittance(in.walk, ray, PathContext{}, counts);
  return in.walk.scene.rays.occluded(ray) ? Rgb(0.0f) : arriving;
}

/// Never inlined: a path that is walked again must be the same to the last bit, so both are walked by the same code.
template <uint32_t kFeatures>
[[gnu::noinline]] void walk_from(const PathInput& in, const Walker<kFeatures>& walker, const CachePoint& p,
                                 StoringVisitor& visitor, RayCounts& counts) {
  Sampler sampler(hash_of(p, in.seed), p.sample);
  const Vec2 u = sampler.next2();
  PathState path;
  visitor.begin(p, path.context);
  const float radius = std::sqrt(u.x), phi = 2.0f * kPi * u.y, z = std::sqrt(std::fmax(0.0f, 1.0f - u.x));
  const Vec3 direction = Frame(p.normal).to_world({radius * std::cos(phi), radius * std::sin(phi), z});
  const bool last = visitor.stored()[0].last;
  if (in.settings.direct)
    visitor.add_direct(
        direct_light<kFeatures>(in, p, unit_float(hash(hash_of(p, in.seed), p.sample, 4)), sampler.next2(), counts));
  if (!(z > 0.0f && glm::dot(direction, p.face_normal) > 0.0f && (!last || in.settings.direct))) return;
  path.last = last;
  path.density = z * kInvPi;
  path.position = p.position, path.light_normal = p.normal;
  path.ray.origin = offset_origin(start_of(p), direction);
  path.ray.direction = direction;
  path.ray.mask = visibility_of(path.context.kind);
  path.context.footprint = p.footprint;
  walker.walk(path, sampler, visitor);
  counts.camera--, counts.bounce++;  // no ray of the camera
}

bool usable(const Rgb& light) { return std::fabs(light.x) + std::fabs(light.y) + std::fabs(light.z) <= kMostLight; }

Rgb clamped(const PathInput& in, const Rgb& light) {
  const float sum = light.x + light.y + light.z, limit = in.settings.walk.clamp_indirect;
  return glm::max(sum > limit ? light * (limit / sum) : light, Rgb(0.0f));
}

template <uint32_t kFeatures>
void trace(const PathInput& in, std::span<const CachePoint> points, std::span<const uint32_t> chosen,
           std::vector<Sample>& out, std::vector<Probe>& whole, RayCounts& counts) {
  const Walker<kFeatures> walker(in.walk, counts);
  StoringVisitor visitor(in);
  for (const uint32_t index : chosen) {
    const CachePoint& p = points[index];
    walk_from(in, walker, p, visitor, counts);
    const int level = int(in.cells.grid.level(p.footprint * in.settings.cell_pixels));
    for (const Stored& s : visitor.stored()) {
      if (!s.sampled) continue;
      const bool first = &s == visitor.stored().data();
      const int at = first ? level : std::min(level + kFartherLevels, kTopLevel);
      const uint32_t owner = owner_of(s.instance, s.face_normal) | (first ? 0u : kOnTheWay);
      if (!usable(s.light)) {
        counts.dropped++;
        continue;
      }
      const Rgb light = clamped(in, s.light);
      if (first && !visitor.may_end()) whole.push_back({p, in.seed, level, light});
      out.push_back({in.cells.grid.cell(s.position, owner, at), light, 1});
    }
  }
}

template <uint32_t kFeatures>
void trace_again(PathInput in, std::span<const Probe> probes, std::span<Rgb> light, RayCounts& counts) {
  const Walker<kFeatures> walker(in.walk, counts);
  StoringVisitor visitor(in);
  for (size_t i = 0; i < probes.size(); ++i) {
    if (!probes[i].seed) continue;
    in.seed = probes[i].seed;
    walk_from(in, walker, probes[i].point, visitor, counts);
    const Rgb& found = visitor.stored()[0].light;
    if (usable(found)) light[i] = clamped(in, found);
  }
}

/// Paths in blocks, each with counts of its own; stopped ones are left out.
template <class Body>
void each_block(size_t paths, size_t block, const Work& work, RayCounts& counts, const Body& body) {
  std::mutex mutex;
  parallel_blocks(
      paths, block, work.threads,
      [&](size_t begin, size_t end) {
        if (work.stop.stop()) return;
        RayCounts own;
        body(begin, end, own);
        const std::lock_guard lock(mutex);
        counts += own;
      },
      work.stop);
}

constexpr uint32_t kPlain = kFeatureLobes | kFeatureShapes, kWinding = kPlain | kFeatureStraight;

bool goes_straight(const WalkScene& walk) {
  return walk.scene.effects.has(kTransparency) || walk.scene.effects.has(kRayVisibility) || walk.shown;
}

PathInput input_of(const WalkScene& walk, const Cells& cells, const CachingSettings& settings, uint32_t seed) {
  PathInput in{walk, cells, settings, settings.walk.limits, seed};
  if (settings.length) in.limits.max_bounces = std::min(in.limits.max_bounces, settings.length);
  return in;
}

}  // namespace

bool CachingSettings::operator==(const CachingSettings& o) const {
  const WalkLimits &a = walk.limits, &b = o.walk.limits;
  return store == o.store && direct == o.direct && length == o.length && cell_pixels == o.cell_pixels &&
         long_paths == o.long_paths && a.max_bounces == b.max_bounces && a.diffuse == b.diffuse &&
         a.glossy == b.glossy && a.transmission == b.transmission && a.transparent == b.transparent &&
         a.caustics_reflective == b.caustics_reflective && a.caustics_refractive == b.caustics_refractive &&
         walk.clamp_indirect == o.walk.clamp_indirect;
}

std::vector<Sample> cache_paths(const WalkScene& walk, const Cells& cells, const CachingSettings& settings,
                                std::span<const CachePoint> points, std::span<const uint32_t> chosen, uint32_t seed,
                                const Work& work, RayCounts& counts, std::vector<Probe>& whole) {
  const PathInput in = input_of(walk, cells, settings, seed);
  std::vector<std::vector<Sample>> blocks((chosen.size() + kBlock - 1) / kBlock);
  std::vector<std::vector<Probe>> probes(blocks.size());
  const auto traces = goes_straight(walk) ? trace<kWinding> : trace<kPlain>;
  each_block(chosen.size(), kBlock, work, counts, [&](size_t begin, size_t end, RayCounts& own) {
    traces(in, points, chosen.subspan(begin, end - begin), blocks[begin / kBlock], probes[begin / kBlock], own);
  });
  std::vector<Sample> samples;
  if (work.stop.stop()) return samples;
  std::vector<size_t> first(1, 0);
  for (const auto& block : blocks) first.push_back(first.back() + block.size());
  samples.resize(first.back());
  parallel_blocks(blocks.size(), 64, work.threads, [&](size_t begin, size_t end) {
    for (size_t b = begin; b < end; ++b)
      std::copy(blocks[b].begin(), blocks[b].end(), samples.begin() + ptrdiff_t(first[b]));
  });
  for (const auto& block : probes) whole.insert(whole.end(), block.begin(), block.end());
  return samples;
}

std::vector<Rgb> walk_again(const WalkScene& walk, const Cells& cells, const CachingSettings& settings,
                            std::span<const Probe> probes, const Work& work, RayCounts& counts) {
  PathInput in = input_of(walk, cells, settings, 0);
  in.whole = true;
  std::vector<Rgb> light(probes.size(), Rgb(std::numeric_limits<float>::quiet_NaN()));
  const auto traces = goes_straight(walk) ? trace_again<kWinding> : trace_again<kPlain>;
  each_block(probes.size(), kFewBlock, work, counts, [&](size_t begin, size_t end, RayCounts& own) {
    traces(in, probes.subspan(begin, end - begin), std::span(light).subspan(begin, end - begin), own);
  });
  if (work.stop.stop()) light.clear();
  return light;
}

}  // namespace afterglow::hash_cache
