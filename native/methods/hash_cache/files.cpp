// SPDX-License-Identifier: GPL-3.0-or-later
// A cache as bytes: a header of plain numbers in the machine's order, then the records by their keys. The same bytes
// come out of what was read from them.
#include <cstring>

#include "base/errors.h"
#include "methods/hash_cache/cache.h"

namespace afterglow::hash_cache {

namespace {

constexpr char kMagic[16] = "afterglow cells";
constexpr uint32_t kFormat = 3;

/// What must be the same for cells to mean the same.
struct Header {
  char magic[16];
  uint32_t format, record_size;
  uint64_t records;
  float bounds[6];
  uint64_t instances, triangles, lights;
  float finest, corner[3];
  uint32_t store, length;
  float cell_pixels, clamp_indirect;
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
  if (stale_ || !shown_instances_.empty()) return {};
  Header h = header_of(scene.scene);
  h.records = records.size();
  h.finest = grid_.finest();
  for (int i = 0; i < 3; ++i) h.corner[i] = grid_.corner()[i];
  const CachingSettings& s = settings_.caching;
  const WalkLimits& l = s.walk.limits;
  h.store = s.store, h.length = s.length, h.cell_pixels = s.cell_pixels, h.clamp_indirect = s.walk.clamp_indirect;
  h.max_bounces = l.max_bounces, h.diffuse = l.diffuse, h.glossy = l.glossy, h.transmission = l.transmission;
  h.transparent = l.transparent, h.caustics = uint32_t(l.caustics_reflective) | uint32_t(l.caustics_refractive) << 1;
  h.direct = s.direct;
  h.renders = renders_, h.stamp = stamp_;
  std::vector<char> bytes(sizeof(h) + records.size() * sizeof(Entry));
  std::memcpy(bytes.data(), &h, sizeof(h));
  if (!records.empty()) std::memcpy(bytes.data() + sizeof(h), records.data(), records.size() * sizeof(Entry));
  return bytes;
}

void Cache::load(const CommittedScene& scene, std::span<const char> bytes) {
  Header h;
  if (bytes.size() < sizeof(h)) throw InvalidInput("this is no saved HashCache: it is too short");
  std::memcpy(static_cast<void*>(&h), bytes.data(), sizeof(h));
  if (std::memcmp(h.magic, kMagic, sizeof(h.magic))) throw InvalidInput("this is no saved HashCache");
  if (h.format != kFormat || h.record_size != sizeof(Entry))
    throw InvalidInput("this HashCache was saved by another version of Afterglow");
  if (h.records != (bytes.size() - sizeof(h)) / sizeof(Entry) || (bytes.size() - sizeof(h)) % sizeof(Entry))
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
  table_.restore(records);
  healing_.clear();
  pending_ = false;
  forgotten_.clear();
  grid_ = Grid(h.finest, Vec3(h.corner[0], h.corner[1], h.corner[2]));
  CachingSettings& s = settings_.caching;
  WalkLimits& l = s.walk.limits;
  s.store = h.store, s.length = h.length, s.cell_pixels = h.cell_pixels, s.walk.clamp_indirect = h.clamp_indirect;
  l.max_bounces = h.max_bounces, l.diffuse = h.diffuse, l.glossy = h.glossy, l.transmission = h.transmission;
  l.transparent = h.transparent, l.caustics_reflective = h.caustics & 1u, l.caustics_refractive = h.caustics & 2u;
  s.direct = h.direct;
  renders_ = h.renders, stamp_ = h.stamp;
  shown_instances_.clear();
  counts_ = CacheCounts{};
  stale_ = false;
}

}  // namespace afterglow::hash_cache
