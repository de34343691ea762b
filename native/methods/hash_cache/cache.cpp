// SPDX-License-Identifier: GPL-3.0-or-later
// Filling and asking: see cache.h.
#include "methods/hash_cache/cache.h"

#include <algorithm>
#include <chrono>

#include "base/log.h"
#include "base/parallel.h"

namespace afterglow::hash_cache {

namespace {

constexpr float kFarthest = 0.04f;  // of the ray's length: how far look-ups may be scattered beyond the asked jitter
constexpr float kEnough = 0.01f;    // share of the light that the levels above need not bring

constexpr size_t kFewProbes = 64;  // fewer paths do not tell what an edit changed
constexpr float kRounding = 1e-3f;
constexpr uint32_t kEven = 1024;  // samples from which on a cell shows no blotches
constexpr size_t kGroup = 32;     // questions whose cells are fetched from memory together
constexpr size_t kFillBlock = 1024;

double now() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

uint64_t lost(const TableCounts& counts) { return counts.refused + counts.evicted; }

/// Cells of few samples are blotches; look-ups that scatter farther make fine grain of them, which filters take away.
float widened(uint32_t count) { return std::clamp(std::sqrt(float(kEven) / float(count + 1)), 1.0f, 6.0f); }

/// The same but for rounding, which differs where the scene's triangles were put in another order; no number is unlike.
bool alike(const Rgb& a, const Rgb& b) {
  const Rgb off = glm::abs(a - b), most = kRounding * glm::max(a, b);
  return off.x <= most.x && off.y <= most.y && off.z <= most.z;
}

/// From blue over green to red.
Rgb scale_color(float t) {
  t = std::clamp(t, 0.0f, 1.0f);
  return glm::clamp(Rgb(2.0f * t - 1.0f, 1.0f - std::fabs(2.0f * t - 1.0f), 1.0f - 2.0f * t), Rgb(0.0f), Rgb(1.0f));
}

}  // namespace

void Cache::configure(const CacheSettings& settings) {
  if (!(settings.caching == settings_.caching)) stale_ = true;
  settings_ = settings;
  fit();
}

/// The table within its limit, whatever it holds already.
void Cache::fit() {
  if (stale_) table_.clear();
  lost_before_ = lost(table_.counts());
  table_.set_limit(settings_.limit, stamp_);
  if (lost(table_.counts()) > lost_before_) log_message("warning", warning());
}

void Cache::clear(const CommittedScene& scene) {
  table_.clear();
  healing_.clear();
  grid_ = Grid(scene.scene.bounds());
  counts_.resets++;
  lost_before_ = 0;
  renders_ = stamp_ = 0;
  forgotten_.clear();
  pending_ = loaded_ = false;
}

void Cache::update(const CommittedScene& scene, const SceneChanges& changes, Work& work) {
  SceneChanges seen = changes;
  seen.camera = false;
  const InstanceMask shown = work.shown ? *work.shown : InstanceMask{};
  const bool elsewhere = stale_ || changes.everything || changes.origin || shown != shown_instances_ ||
                         !grid_.serves(scene.scene.bounds());
  bool edit = pending_ || !seen.empty();
  shown_instances_ = shown;
  if (!elsewhere && !edit) edit = !validate(scene, work);
  if (elsewhere || (edit && (!settings_.keep || healing_.probe_count() < kFewProbes))) {
    clear(scene);
  } else if (edit) {
    edited(scene, changes, work);
  }
  stale_ = false;
  seed_ = hash(hash(uint32_t(work.seed), uint32_t(work.seed >> 32)), renders_++, 0x48617368u);  // never a path twice
  next_pass();
  pass_ = work.pass;
}

/// Whether a few of the kept paths, all of them in turn, bring the light that they brought; those of a loaded cache are
/// walked at once. Where one does not, the scene is another than the cells', although nobody said so.
bool Cache::validate(const CommittedScene& scene, const Work& work) {
  const double begun = now();
  const std::vector<Probe> probes =
      healing_.next_probes(settings_.validate && loaded_ ? Healing::kProbes : settings_.validate);
  RayCounts rays;
  const std::vector<Rgb> light =
      walk_again(walk_scene(scene), {grid_, table_, healing_}, settings_.caching, probes, work, rays);
  if (light.size() < probes.size()) return true;  // stopped: the next update does it
  loaded_ = false;
  bool same = true;
  for (size_t i = 0; i < probes.size(); ++i) same &= alike(probes[i].light, light[i]);
  counts_.validated += probes.size(), counts_.unannounced += !same;
  counts_.rays += rays.bounce, counts_.shadow_rays += rays.shadow;
  counts_.seconds_validate += now() - begun;
  return same;
}

void Cache::next_pass() {
  healing_.begin_pass(++stamp_);
  table_.keep_ages(stamp_);
  while (healing_.due()) table_.drop_older(healing_.retire(), stamp_);
}

/// What a stopped update left to do is done by the next one: no cell got a sample in between.
void Cache::edited(const CommittedScene& scene, const SceneChanges& changes, const Work& work) {
  const double begun = now();
  pending_ = true;
  // Cells know objects by their places in the scene's list, which others may take over.
  const auto named = [](const std::vector<Handle>& sorted, Handle handle) {
    return std::binary_search(sorted.begin(), sorted.end(), handle);
  };
  const auto& instances = scene.scene.instances();
  for (uint32_t i = 0; i < instances.size(); ++i)
    if (named(changes.instances_added, instances[i].handle) ||
        named(changes.meshes_deformed, instances[i].mesh_handle) ||
        named(changes.meshes_replaced, instances[i].mesh_handle) ||
        named(changes.meshes_added, instances[i].mesh_handle))
      forgotten_.push_back(i);
  for (const MovedInstance& m : changes.instances_moved) forgotten_.push_back(scene.scene.instance_index(m.instance));
  std::sort(forgotten_.begin(), forgotten_.end());
  forgotten_.erase(std::unique(forgotten_.begin(), forgotten_.end()), forgotten_.end());
  RayCounts rays;
  const std::vector<Rgb> light =
      walk_again(walk_scene(scene), {grid_, table_, healing_}, settings_.caching, healing_.probes(), work, rays);
  if (light.empty()) return;
  counts_.edits++;
  counts_.walked_again += healing_.probe_count();
  counts_.rays += rays.bounce, counts_.shadow_rays += rays.shadow;
  healing_.edit(grid_, light, std::move(forgotten_), stamp_ + 1, settings_.keep);
  forgotten_.clear();
  pending_ = false;
  counts_.seconds_edits += now() - begun;
}

/// Every stored vertex counts its own scatterings.
WalkScene Cache::walk_scene(const CommittedScene& scene) const {
  WalkScene walk{scene, settings_.caching.walk.limits, shown_instances_.empty() ? nullptr : &shown_instances_, false};
  const uint32_t more = settings_.caching.store;
  walk.limits.max_bounces += more, walk.limits.diffuse += more, walk.limits.glossy += more;
  walk.limits.transmission += more, walk.limits.transparent += more;
  return walk;
}

std::string Cache::warning() const {
  if (lost(table_.counts()) == lost_before_) return {};
  return "HashCache: its memory of " + std::to_string(settings_.limit >> 20) +
         " MiB is full; cells that got no light for longest make room. More memory (hash_memory) or larger cells "
         "(hash_cell) keep them.";
}

bool Cache::trace(const WalkScene& walk, std::span<const CachePoint> points, std::span<const uint32_t> chosen,
                  Work& work) {
  const double begun = now();
  RayCounts rays;
  std::vector<Probe> whole;
  std::vector<Sample> samples =
      cache_paths(walk, {grid_, table_, healing_}, settings_.caching, points, chosen, seed_, work, rays, whole);
  const double traced = now();
  counts_.seconds_paths += traced - begun;
  if (work.stop.stop()) return false;
  counts_.paths += chosen.size(), counts_.samples += samples.size();
  counts_.rays += rays.bounce, counts_.shadow_rays += rays.shadow, counts_.dropped += rays.dropped;
  const bool told = lost(table_.counts());
  healing_.keep(grid_, whole);
  Table::Mend mend;
  if (healing_.active()) mend = [this](Record& record, const Cell& cell) { healing_.mend(record, cell); };
  counts_.cells += table_.add(std::move(samples), stamp_, work.threads, work.stop, mend);
  counts_.seconds_table += now() - traced;
  if (!told && lost(table_.counts())) log_message("warning", warning());
  return !work.stop.stop();
}

void Cache::fill(const CommittedScene& scene, std::span<const CachePoint> points, Work& work) {
  if (work.pass != pass_) {
    pass_ = work.pass;
    next_pass();
  }
  const WalkScene walk = walk_scene(scene);
  // Cells that are there already get paths more rarely the more they hold; points without one are asked for holes.
  const float resolution = work.extra ? 0.0f : (all_ask_ ? 1.0f : settings_.resolution) * work.caching;
  // The first few paths fill cells in which the others end; where few are sent, filling cells thrice costs more. What
  // is left has no path; its own cell may be empty.
  const bool at_once = work.caching < 1.0f;
  enum Kind : uint8_t { kFirst, kSecond, kThird, kEmpty, kKinds, kNone = kKinds };
  std::vector<uint8_t> kinds(points.size());
  const size_t blocks = (points.size() + kFillBlock - 1) / kFillBlock;
  std::vector<std::array<uint32_t, kKinds>> places(blocks);
  parallel_blocks(points.size(), kFillBlock, work.threads, [&](size_t begin, size_t end) {
    uint64_t keys[kGroup];
    auto& counts = places[begin / kFillBlock] = {};
    Cell cells[kGroup];
    for (size_t at = begin; at < end; at += kGroup) {
      const size_t n = std::min(kGroup, end - at);
      for (size_t k = 0; k < n; ++k) {
        const CachePoint& p = points[at + k];
        const int level = int(grid_.level(p.footprint * settings_.caching.cell_pixels));
        keys[k] = key_of(cells[k] = grid_.cell(p.position, owner_of(p.instance, p.face_normal), level));
        table_.prefetch(keys[k]);
      }
      for (size_t k = 0; k < n; ++k) {
        const Known known = find(cells[k], keys[k]);
        const float share = resolution * share_of_paths(known.count, settings_.enough);
        const float u = unit_float(hash(hash_of(points[at + k], seed_), points[at + k].sample, 1));
        Kind kind = known ? kNone : kEmpty;
        if (u < share) kind = at_once ? kThird : u < 0.03f * share ? kFirst : u < 0.2f * share ? kSecond : kThird;
        kinds[at + k] = kind;
        if (kind != kNone) counts[kind]++;
      }
    }
  });
  std::array<uint32_t, kKinds> sizes{};
  for (auto& counts : places)
    for (uint32_t kind = 0; kind < kKinds; ++kind) {
      const uint32_t n = counts[kind];
      counts[kind] = sizes[kind];
      sizes[kind] += n;
    }
  std::array<std::vector<uint32_t>, kKinds> of;
  for (uint32_t kind = 0; kind < kKinds; ++kind) of[kind].resize(sizes[kind]);
  parallel_blocks(points.size(), kFillBlock, work.threads, [&](size_t begin, size_t end) {
    auto& next = places[begin / kFillBlock];
    for (size_t i = begin; i < end; ++i)
      if (kinds[i] != kNone) of[kinds[i]][next[kinds[i]]++] = uint32_t(i);
  });
  for (const Kind kind : {kFirst, kSecond, kThird})
    if (!of[kind].empty() && !trace(walk, points, of[kind], work)) return;
  const std::vector<uint32_t>& rest = of[kEmpty];
  std::vector<uint8_t> hole(rest.size());
  parallel_blocks(rest.size(), 256, work.threads, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) hole[i] = !finest(points[rest[i]]).known;
  });
  std::vector<uint32_t> holes;
  for (size_t i = 0; i < rest.size(); ++i)
    if (hole[i]) holes.push_back(rest[i]);
  counts_.holes += holes.size();
  if (!holes.empty()) trace(walk, points, holes, work);
}

/// At a place beside the point, where there is such a cell of the same object and side, else at the point.
Known Cache::look_up(const CachePoint& p, const Vec3& offset, uint32_t owner, int level) const {
  const Known known = find(grid_.cell(p.position + offset * grid_.size(level), owner, level));
  return known ? known : find(grid_.cell(p.position, owner, level));
}

/// The finest cell at the point that could answer, if any.
Cache::Finest Cache::finest(const CachePoint& p) const {
  const uint32_t own = owner_of(p.instance, p.face_normal);
  const int first = int(grid_.level(p.footprint * settings_.caching.cell_pixels));
  for (const uint32_t owner : {own, own | kOnTheWay}) {
    if (owner != own && !others_answer()) break;
    for (int level = first; level <= kTopLevel; ++level)
      if (const Known known = find(grid_.cell(p.position, owner, level))) return {level, known};
  }
  return {};
}

/// The level between two is told by lot, in proportion: that asks half as many cells as their blend.
Cache::LookUp Cache::first_look(const CachePoint& p) const {
  LookUp look;
  look.owner = owner_of(p.instance, p.face_normal);
  const uint32_t random = hash(hash_of(p, seed_), p.sample, 2), second = hash(random);
  look.level =
      std::min(int(grid_.level(p.footprint * settings_.caching.cell_pixels) + unit_float(hash(second))), kTopLevel);
  if (settings_.jitter > 0.0f) {
    const Frame frame(p.face_normal);
    look.offset = settings_.jitter *
                  ((2.0f * unit_float(random) - 1.0f) * frame.t + (2.0f * unit_float(second) - 1.0f) * frame.b);
  }
  look.cell = grid_.cell(p.position + look.offset * grid_.size(look.level), look.owner, look.level);
  look.key = key_of(look.cell);
  return look;
}

/// A cell of few samples was found, or none: look-ups scatter farther.
void Cache::wider(const CachePoint& p, LookUp& look) const {
  if (!(settings_.jitter > 0.0f)) return;
  const float farthest = kFarthest * p.segment / (settings_.jitter * grid_.size(look.level));
  const float wide = std::max(1.0f, std::min(widened(look.first.count), farthest));
  if (!(wide > 1.0f)) return;
  look.offset *= wide;
  look.cell = grid_.cell(p.position + look.offset * grid_.size(look.level), look.owner, look.level);
  look.key = key_of(look.cell);
  table_.prefetch(look.key);
}

void Cache::answer(std::span<const CachePoint> points, std::span<Answer> answers) const {
  LookUp looks[kGroup];
  for (size_t at = 0; at < points.size(); at += kGroup) {
    const size_t n = std::min(kGroup, points.size() - at);
    for (size_t k = 0; k < n; ++k) table_.prefetch((looks[k] = first_look(points[at + k])).key);
    for (size_t k = 0; k < n; ++k) {
      LookUp& look = looks[k];
      look.first = find(look.cell, look.key);
      look.settled = look.first.count >= kEven;
      if (!look.settled) wider(points[at + k], look);
    }
    for (size_t k = 0; k < n; ++k) answers[at + k] = resolve(points[at + k], looks[k]);
  }
}

Answer Cache::resolve(const CachePoint& p, const LookUp& look) const {
  Known known = look.settled ? look.first : find(look.cell, look.key);
  if (!known) known = look.first;
  if (float(known.count) >= settings_.trusted)
    return {kPi * known.light, 1.0f, 1.0f / std::sqrt(1.0f + float(known.count))};
  return blend(p, look);
}

/// Where cells hold few samples: each level adds what it is trusted with, the next larger one fills up.
Answer Cache::blend(const CachePoint& p, const LookUp& look) const {
  Rgb light(0.0f);
  float missing = 1.0f, samples = 0.0f;
  const auto take = [&](const Known& known) {
    const float taken = missing * trust(known.count, settings_.trusted);
    light += taken * known.light;
    samples += taken * float(known.count);
    missing -= taken;
  };
  for (int level = look.level; level <= kTopLevel && missing > kEnough; ++level) {
    // A cell longer than the way that the ray came holds light of places that the ray has left long ago.
    if (level > look.level && missing < 1.0f && grid_.size(level) > p.segment) break;
    if (const Known known = look_up(p, look.offset, look.owner, level)) take(known);
  }
  // Where the camera's paths have left nothing at all: what others found there, without the last of their bounces.
  for (int level = look.level; others_answer() && level <= kTopLevel && !(missing < 1.0f); ++level)
    if (const Known known = look_up(p, look.offset, look.owner | kOnTheWay, level)) take(known);
  if (!(missing < 1.0f)) return {};
  const float found = 1.0f - missing;
  return {kPi / found * light, 1.0f, 1.0f / std::sqrt(1.0f + samples / found)};
}

Answer Cache::show(View view, const CachePoint& p) const {
  const Finest found = finest(p);
  if (!found.known) return {};
  const uint32_t side = side_of(p.face_normal);  // of the cell: its owner's
  Rgb colour(0.0f);
  if (view == View::kLevel) colour = scale_color(float(found.level % 8) / 7.0f);
  if (view == View::kCount) colour = scale_color(std::log2(float(found.known.count)) / 20.0f);
  if (view == View::kAge) colour = scale_color(float(found.known.age) / 64.0f);
  if (view == View::kSide) colour = Rgb(float(side & 1u), 0.3f * float(side >> 1), float(~side & 1u));
  return {colour, kAsItIs, 0.0f};
}

}  // namespace afterglow::hash_cache
