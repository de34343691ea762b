// SPDX-License-Identifier: GPL-3.0-or-later
// Filling and asking: see cache.h.
#include "methods/hash_cache/cache.h"

#include <chrono>

#include "base/log.h"
#include "base/parallel.h"

namespace afterglow::hash_cache {

namespace {

constexpr float kFarthest = 0.04f;  // of the ray's length: how far look-ups may be scattered beyond the asked jitter
constexpr float kEnough = 0.01f;    // share of the light that the levels above need not bring

double now() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

/// Cells of few samples are blotches; look-ups that scatter farther make fine grain of them, which filters take away.
float widened(uint32_t count) { return std::clamp(std::sqrt(1024.0f / float(count + 1)), 1.0f, 6.0f); }

/// From blue over green to red.
Rgb scale_color(float t) {
  t = std::clamp(t, 0.0f, 1.0f);
  return glm::clamp(Rgb(2.0f * t - 1.0f, 1.0f - std::fabs(2.0f * t - 1.0f), 1.0f - 2.0f * t), Rgb(0.0f), Rgb(1.0f));
}

}  // namespace

void Cache::configure(const CacheSettings& settings) {
  if (!(settings.caching == settings_.caching)) stale_ = true;
  settings_ = settings;
  if (settings.limit < table_.bytes()) stale_ = true;
  table_.set_limit(settings.limit);
}

void Cache::update(const CommittedScene& scene, const SceneChanges& changes, Work& work) {
  SceneChanges seen = changes;
  seen.camera = false;
  const InstanceMask shown = work.shown ? *work.shown : InstanceMask{};
  // Cells know objects by their numbers, which others take over when some come or go.
  const bool renumbered = !changes.instances_added.empty() || !changes.instances_removed.empty();
  const bool elsewhere = stale_ || renumbered || changes.everything || changes.origin || shown != shown_instances_;
  if (elsewhere || (!seen.empty() && !settings_.keep)) {
    table_.clear();
    grid_ = Grid(scene.scene.bounds());
    counts_.resets++;
    renders_ = stamp_ = 0;
  } else if (!seen.empty()) {
    table_.forget(settings_.keep);
  }
  stale_ = false;
  shown_instances_ = shown;
  seed_ = hash(hash(uint32_t(work.seed), uint32_t(work.seed >> 32)), renders_++, 0x48617368u);  // never a path twice
  stamp_++;
  pass_ = work.pass;
}

bool Cache::trace(const WalkScene& walk, std::span<const CachePoint> points, Work& work) {
  const double begun = now();
  RayCounts rays;
  std::vector<Sample> samples = cache_paths(walk, grid_, table_, settings_.caching, points, seed_, work, rays);
  const double traced = now();
  counts_.seconds_paths += traced - begun;
  if (work.stop.stop()) return false;
  counts_.paths += points.size(), counts_.samples += samples.size();
  counts_.rays += rays.bounce, counts_.shadow_rays += rays.shadow, counts_.dropped += rays.dropped;
  const bool told = table_.counts().refused || table_.counts().evicted;
  counts_.cells += table_.add(std::move(samples), stamp_, work.threads, work.stop);
  counts_.seconds_table += now() - traced;
  if (!told && (table_.counts().refused || table_.counts().evicted))
    log_message("warning",
                "HashCache: its memory of " + std::to_string(settings_.limit >> 20) +
                    " MiB is full; cells that got no light for longest make room. More memory (hash_memory) or "
                    "larger cells (hash_cell) keep them.");
  return !work.stop.stop();
}

void Cache::fill(const CommittedScene& scene, std::span<const CachePoint> points, Work& work) {
  if (work.pass != pass_) pass_ = work.pass, stamp_++;
  WalkScene walk{scene, settings_.caching.walk.limits, shown_instances_.empty() ? nullptr : &shown_instances_, false};
  const uint32_t more = settings_.caching.store;  // every stored vertex counts its own scatterings
  walk.limits.max_bounces += more, walk.limits.diffuse += more, walk.limits.glossy += more;
  walk.limits.transmission += more, walk.limits.transparent += more;
  std::vector<float> shares(points.size());
  parallel_blocks(points.size(), 256, work.threads, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      const CachePoint& p = points[i];
      const int level = int(grid_.level(p.footprint * settings_.caching.cell_pixels));
      const Record* r = table_.find(grid_.cell(p.position, owner_of(p.instance, p.face_normal), level));
      shares[i] = settings_.resolution * share_of_paths(r ? r->count() : 0, settings_.enough);
    }
  });
  std::array<std::vector<CachePoint>, 3> slices;  // the first few fill cells in which the others end
  std::vector<CachePoint> rest;
  for (size_t i = 0; i < points.size(); ++i) {
    const float u = unit_float(hash(hash_of(points[i], seed_), points[i].sample, 1));
    if (u < shares[i])
      slices[u < 0.03f * shares[i] ? 0 : u < 0.2f * shares[i] ? 1 : 2].push_back(points[i]);
    else
      rest.push_back(points[i]);
  }
  for (const auto& slice : slices)
    if (!slice.empty() && !trace(walk, slice, work)) return;
  std::vector<uint8_t> open(rest.size());
  parallel_blocks(rest.size(), 256, work.threads, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) open[i] = !(answer(rest[i]).weight > 0.0f);
  });
  std::vector<CachePoint> holes;
  for (size_t i = 0; i < rest.size(); ++i)
    if (open[i]) holes.push_back(rest[i]);
  counts_.holes += holes.size();
  if (!holes.empty()) trace(walk, holes, work);
}

/// At a place beside the point, where there is such a cell of the same object and side, else at the point.
const Record* Cache::look_up(const CachePoint& p, const Vec3& offset, uint32_t owner, int level) const {
  const Record* record = table_.find(grid_.cell(p.position + offset * grid_.size(level), owner, level));
  return record ? record : table_.find(grid_.cell(p.position, owner, level));
}

Answer Cache::answer(const CachePoint& p) const {
  const uint32_t owner = owner_of(p.instance, p.face_normal);
  const float wanted = grid_.level(p.footprint * settings_.caching.cell_pixels);
  const int finest = int(wanted);
  const uint32_t random = hash(hash_of(p, seed_), p.sample, 2);
  const Frame frame(p.face_normal);
  const Record* here = settings_.jitter > 0.0f ? table_.find(grid_.cell(p.position, owner, finest)) : nullptr;
  const float wide = std::max(1.0f, std::min(widened(here ? here->count() : 0),
                                             kFarthest * p.segment / (settings_.jitter * grid_.size(finest))));
  const Vec3 offset =
      settings_.jitter * wide *
      ((2.0f * unit_float(random) - 1.0f) * frame.t + (2.0f * unit_float(hash(random)) - 1.0f) * frame.b);
  Rgb light(0.0f);
  float missing = 1.0f, samples = 0.0f;
  for (int level = finest; level <= kTopLevel && missing > kEnough; ++level) {
    // A cell longer than the way that the ray came holds light of places that the ray has left long ago.
    if (level > finest + 1 && missing < 1.0f && grid_.size(level) > p.segment) break;
    const Record* record = look_up(p, offset, owner, level);
    if (!record) continue;
    const float share = (level == finest ? 1.0f - (wanted - float(finest)) : 1.0f);
    const float taken = missing * share * trust(record->count(), settings_.trusted);
    light += taken * shown(*record, p, level);
    samples += taken * float(record->count());
    missing -= taken;
  }
  // Where the camera's paths have left nothing at all: what others found there, without the last of their bounces.
  for (int level = finest; level <= kTopLevel && !(missing < 1.0f); ++level)
    if (const Record* record = look_up(p, offset, owner | kOnTheWay, level)) {
      const float taken = trust(record->count(), settings_.trusted);
      light += taken * shown(*record, p, level);
      samples += taken * float(record->count());
      missing -= taken;
    }
  if (!(missing < 1.0f)) return {};
  const float found = 1.0f - missing;
  return {kPi / found * light, 1.0f, 1.0f / std::sqrt(1.0f + samples / found)};
}

/// Light, or what a debug view shows in its place.
Rgb Cache::shown(const Record& record, const CachePoint& p, int level) const {
  switch (settings_.view) {
    case View::kLight:
      return record.light;
    case View::kLevel:
      return scale_color(float(level % 8) / 7.0f);
    case View::kCount:
      return scale_color(std::log2(float(record.count())) / 20.0f);
    case View::kAge:
      return scale_color(float((stamp_ - record.stamp()) % Record::kStamps) / 64.0f);
    case View::kSide:
      return 0.5f + 0.5f * p.face_normal;
  }
  return record.light;
}

}  // namespace afterglow::hash_cache
