// SPDX-License-Identifier: GPL-3.0-or-later
// A cache as bytes: a header of plain numbers in the machine's order, then the records by their keys, then the paths
// that are kept for walking again. The same bytes come out of what was read from them.
#include <cmath>
#include <cstring>

#include "base/errors.h"
#include "methods/hash_cache/cache.h"

namespace afterglow::hash_cache {

namespace {

constexpr char kMagic[16] = "afterglow cells";
constexpr uint32_t kFormat = 5;

/// A path that is kept for walking again, and its place among them.
struct SavedProbe {
  float position[3], normal[3], face_normal[3], light[3], footprint, error;
  uint32_t instance, sample, seed, pixel, place;
  uint16_t level;
  uint8_t layer, translucent;
};
static_assert(sizeof(SavedProbe) == 80);

void copy(const Vec3& from, float* to) { to[0] = from.x, to[1] = from.y, to[2] = from.z; }
Vec3 vector(const float* from) { return {from[0], from[1], from[2]}; }

SavedProbe saved(const Probe& probe, uint32_t place) {
  SavedProbe s;
  const CachePoint& p = probe.point;
  copy(p.position, s.position), copy(p.normal, s.normal), copy(p.face_normal, s.face_normal),
      copy(probe.light, s.light);
  s.footprint = p.footprint, s.error = p.error;
  s.instance = p.instance, s.sample = p.sample, s.seed = probe.seed, s.pixel = uint32_t(p.x) | uint32_t(p.y) << 16;
  s.place = place, s.level = uint16_t(probe.level), s.layer = p.layer, s.translucent = p.translucent;
  return s;
}

Probe restored(const SavedProbe& s) {
  Probe probe;
  CachePoint& p = probe.point;
  p.position = vector(s.position), p.normal = vector(s.normal), p.face_normal = vector(s.face_normal);
  p.footprint = s.footprint, p.error = s.error, p.instance = s.instance, p.sample = s.sample;
  p.x = uint16_t(s.pixel), p.y = uint16_t(s.pixel >> 16), p.layer = s.layer, p.translucent = s.translucent != 0;
  probe.light = vector(s.light), probe.seed = s.seed, probe.level = s.level;
  return probe;
}

/// What no cache can have saved; `before`: the place of the path before it, one more.
bool damaged(const SavedProbe& s, uint32_t before, uint64_t instances) {
  const Vec3 all = vector(s.position) + vector(s.normal) + vector(s.face_normal) + vector(s.light);
  return !is_finite(all) || !std::isfinite(s.footprint + s.error) || !s.seed || s.place < before ||
         s.place >= Healing::kProbes || s.instance >= instances || s.level > kTopLevel;
}

/// What must be the same for cells to mean the same.
struct Header {
  char magic[16];
  uint32_t format, record_size;
  uint64_t records, probes;
  float bounds[6];
  uint64_t instances, triangles, lights;
  float finest, corner[3];
  uint32_t store, length;
  float cell_pixels, long_paths, clamp_indirect;
  uint32_t max_bounces, diffuse, glossy, transmission, transparent, caustics, direct;
  uint32_t renders, stamp;
};

/// All bytes of it are written, those between members too.
Header header_of(const Scene& scene) {
  Header h;
  std::memset(static_cast<void*>(&h), 0, sizeof(h));
  std::memcpy(h.magic, kMagic, sizeof(h.magic));
  h.format = kFormat, h.record_size = sizeof(Entry);
  const Box box = scene.bounds();
  for (int i = 0; i < 3; ++i) h.bounds[i] = box.lower[i], h.bounds[3 + i] = box.upper[i];
  h.instances = scene.instances().size(), h.lights = scene.light_handles().size();
  for (const InstanceRecord& r : scene.instances())
    if (r.mesh) h.triangles += r.mesh->triangles.size() / 3;
  return h;
}

bool same_scene(const Header& a, const Header& b) {
  return !std::memcmp(a.bounds, b.bounds, sizeof(a.bounds)) && a.instances == b.instances && a.lights == b.lights &&
         a.triangles == b.triangles;
}

}  // namespace

std::vector<char> Cache::save(const CommittedScene& scene) const {
  std::vector<Entry> records = table_.sorted();
  std::erase_if(records, [&](const Entry& e) { return healing_.stale(e.record); });  // they hold old light
  if (stale_ || pending_ || !shown_instances_.empty()) return {};
  std::vector<SavedProbe> probes;
  for (uint32_t i = 0; i < healing_.probes().size(); ++i)
    if (healing_.probes()[i].seed) probes.push_back(saved(healing_.probes()[i], i));
  Header h = header_of(scene.scene);
  h.records = records.size(), h.probes = probes.size();
  h.finest = grid_.finest();
  for (int i = 0; i < 3; ++i) h.corner[i] = grid_.corner()[i];
  const CachingSettings& s = settings_.caching;
  const WalkLimits& l = s.walk.limits;
  h.store = s.store, h.length = s.length, h.cell_pixels = s.cell_pixels, h.clamp_indirect = s.walk.clamp_indirect;
  h.max_bounces = l.max_bounces, h.diffuse = l.diffuse, h.glossy = l.glossy, h.transmission = l.transmission;
  h.transparent = l.transparent, h.caustics = uint32_t(l.caustics_reflective) | uint32_t(l.caustics_refractive) << 1;
  h.direct = s.direct, h.long_paths = s.long_paths;
  h.renders = renders_, h.stamp = stamp_;
  std::vector<char> bytes;
  const auto append = [&](const void* from, size_t count) {
    bytes.insert(bytes.end(), static_cast<const char*>(from), static_cast<const char*>(from) + count);
  };
  bytes.reserve(sizeof(h) + records.size() * sizeof(Entry) + probes.size() * sizeof(SavedProbe));
  append(&h, sizeof(h));
  append(records.data(), records.size() * sizeof(Entry));
  append(probes.data(), probes.size() * sizeof(SavedProbe));
  return bytes;
}

void Cache::load(const CommittedScene& scene, std::span<const char> bytes) {
  Header h;
  if (bytes.size() < sizeof(h)) throw InvalidInput("this is no saved HashCache: it is too short");
  std::memcpy(static_cast<void*>(&h), bytes.data(), sizeof(h));
  if (std::memcmp(h.magic, kMagic, sizeof(h.magic))) throw InvalidInput("this is no saved HashCache");
  if (h.format != kFormat || h.record_size != sizeof(Entry))
    throw InvalidInput("this HashCache was saved by another version of Afterglow");
  const size_t left = bytes.size() - sizeof(h);
  if (h.probes > Healing::kProbes || h.records > left / sizeof(Entry) ||
      left != h.records * sizeof(Entry) + h.probes * sizeof(SavedProbe))
    throw InvalidInput("this saved HashCache is cut off");
  if (!same_scene(h, header_of(scene.scene)))
    throw InvalidInput("this HashCache was saved from another scene: bounds, objects, triangles or lights differ");
  std::vector<Entry> records(h.records);
  if (!records.empty())
    std::memcpy(static_cast<void*>(records.data()), bytes.data() + sizeof(h), h.records * sizeof(Entry));
  uint64_t before = 0;
  for (const Entry& e : records) {
    const bool whole = e.key > before && e.record.tag && e.record.tag == uint32_t(e.key) && e.record.count();
    if (!whole || !is_finite(e.record.light())) throw InvalidInput("this saved HashCache is damaged");
    before = e.key;
  }
  std::vector<SavedProbe> probes(h.probes);
  if (!probes.empty())
    std::memcpy(probes.data(), bytes.data() + sizeof(h) + h.records * sizeof(Entry), h.probes * sizeof(SavedProbe));
  uint32_t place = 0;
  for (const SavedProbe& s : probes) {
    if (damaged(s, place, h.instances)) throw InvalidInput("this saved HashCache is damaged");
    place = s.place + 1;
  }
  table_.restore(records);
  healing_.clear();
  for (const SavedProbe& s : probes) healing_.restore(s.place, restored(s));
  pending_ = false;
  loaded_ = true;
  forgotten_.clear();
  grid_ = Grid(h.finest, Vec3(h.corner[0], h.corner[1], h.corner[2]));
  CachingSettings& s = settings_.caching;
  WalkLimits& l = s.walk.limits;
  s.store = h.store, s.length = h.length, s.cell_pixels = h.cell_pixels, s.walk.clamp_indirect = h.clamp_indirect;
  l.max_bounces = h.max_bounces, l.diffuse = h.diffuse, l.glossy = h.glossy, l.transmission = h.transmission;
  l.transparent = h.transparent, l.caustics_reflective = h.caustics & 1u, l.caustics_refractive = h.caustics & 2u;
  s.direct = h.direct, s.long_paths = h.long_paths;
  renders_ = h.renders, stamp_ = h.stamp;
  shown_instances_.clear();
  counts_ = CacheCounts{};
  stale_ = false;
  fit();
}

}  // namespace afterglow::hash_cache
