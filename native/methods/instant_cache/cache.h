// SPDX-License-Identifier: GPL-3.0-or-later
// The records, their visibility and the lights that they saw, kept in step with a scene. Every edit first marks what it
// makes unknown (no ray is traced), then what is unknown is asked: at once, or when a point wants the record. Whatever
// interrupts this, what is unknown stays marked.
#pragma once

#include <memory>
#include <mutex>
#include <span>
#include <string>

#include "methods/instant_cache/interpolation.h"
#include "methods/instant_cache/moved.h"
#include "methods/instant_cache/nearby.h"
#include "methods/virtual_light_settings.h"
#include "methods/walk_settings.h"
#include "rays/ray_subset.h"
#include "transport/light_importance.h"

namespace afterglow::instant_cache {

struct CacheSettings {
  WalkSettings walk;
  VirtualLightSettings lights;
  float accuracy = 0.05f;
  uint32_t keep_updates = 64;  // a record that answered nothing for so many updates is dropped; 0: never
  size_t most_bytes = size_t(1) << 30;
  bool on_demand = false;
};

struct CacheCounts {
  uint64_t path_rays = 0, fill_rays = 0, update_rays = 0, pairs_marked = 0, pairs = 0;
  uint64_t rays_now = 0;  // visibility rays since the last update began
  uint64_t created = 0, updated = 0, reused = 0, moved = 0, dropped = 0, resets = 0;
  uint64_t refused = 0;  // points that memory had no record for since the last update
  uint32_t lights = 0, lights_moved = 0, lights_recoloured = 0, objects_moved = 0;
  double seconds_lights = 0.0, seconds_update = 0.0, seconds_fill = 0.0, seconds_refine = 0.0;
};

struct PointGroup;

/// How far the records are from fresh ones at the same places.
struct Verification {
  double worst = 0.0;  // relative difference of irradiance
  uint64_t records = 0, differing = 0;
};

/// What a picture shows: light, which record answers, what became of it, how many rays that took, virtual lights.
enum class View : uint8_t { kLight, kRecords, kChanges, kRays, kLights };

/// Rather more than nothing, so that who was found covered is answered, whatever is rounded how.
constexpr float kCoveringWeight = 1e-8f;

/// Memory that threads use for one record after the other: a value for each light.
struct Sums {
  std::vector<float> terms;        // geometry_terms()
  std::vector<uint32_t> which;     // slots that the record sees
  LightColumns seen;               // these lights
  std::vector<float> front, back;  // luminance of either side of what is seen
};

class Cache {
 public:
  void configure(const CacheSettings&);
  void update(const CommittedScene&, const SceneChanges&, Work&);
  /// What a lazy update left: short rays of records that a picture used. Whether their light is visibly another now.
  bool refine(const CommittedScene&, Work&);
  void fill(const CommittedScene&, std::span<const CachePoint>, Work&);
  Answer answer(const CachePoint&) const;
  /// For many: those without an answer, and those in whose a record that the last fill() made may have a say.
  void answer(std::span<const CachePoint>, std::span<Answer>) const;
  /// A debug view's colour in place of light.
  Answer show(View, const CachePoint&) const;
  Verification verify(const CommittedScene&, Work&) const;
  const CacheCounts& counts() const { return counts_; }
  size_t size() const { return records_.size(); }
  size_t bytes() const;
  size_t record_bytes() const;
  /// Settings in which a loaded cache differs from those that it was wanted with, so that it had to go; or nothing.
  const std::string& discarded() const { return discarded_; }
  /// As bytes (empty: there is nothing to save), and in place of what is remembered; InvalidInput for others' bytes.
  std::vector<char> save(const CommittedScene&) const;
  void load(const CommittedScene&, std::span<const char>);

 private:
  void reset(const CommittedScene&);
  void trace_lights(const CommittedScene&, Work&, std::vector<uint64_t>& moved_slots, bool& recoloured);
  void follow(const CommittedScene&, const std::vector<Moved>&);
  void mark_crossings(const std::vector<Moved>&, Work&);
  void prepare_moved_rays(const CommittedScene&, const std::vector<Moved>&);
  void forget_sums();
  void forget_sums_of(const std::vector<uint64_t>& lights);
  void mark_hidden(size_t record);
  void mark(size_t record, const std::vector<uint64_t>& slots);
  /// What short rays met is marked at once, or by refine().
  void note_nearby(const CommittedScene&, const SceneChanges&, const std::vector<Moved>&, Work&);
  void mark_nearby(const CommittedScene&, Work&);
  /// Whether the last frame was interrupted, told from how many records it asked.
  void look_back();
  void age();
  /// Where memory is nearly full, the half of the records that answered longest ago goes.
  void make_space();
  size_t most_records() const;
  void forget_others(const std::vector<uint32_t>& kept);
  void keep(const std::vector<uint32_t>& kept);
  void rebuild_octree();
  void note_use(uint32_t record) const;
  /// Whether the record answered in the last frame or the one before: interrupted frames use few.
  bool was_used(uint32_t record) const { return update_ - used_[record] <= 2; }
  bool wants_short_rays(uint32_t record) const {
    return settings_.lights.short_rays && !lazy_ && nearby_.unknown(record);
  }
  Rgb show_lights(const CachePoint&, float bounced) const;
  void answer(const PointGroup&, std::vector<uint32_t>& near, std::span<Answer>) const;
  bool covered(const CachePoint&) const;
  /// A byte for each of the points that are asked for: whether no record covers it.
  void find_open(std::span<const CachePoint>, std::span<const uint32_t> asked, uint8_t* open) const;
  void insert(const CommittedScene&, const CachePoint&);
  /// These records along a curve that keeps neighbours together.
  std::vector<uint32_t> along_curve(std::span<const uint32_t>) const;
  /// Asks what is unknown of these records and sums their light anew.
  uint64_t resolve(const CommittedScene&, std::span<const uint32_t> records, Work&);
  /// Asks what is unknown of at most RayCaster::kTogether records. Bits: those that see anything otherwise than before.
  uint32_t ask(const WalkScene&, std::span<const uint32_t> records, RayCounts&);
  /// Which unknown lights of a word face the record: the others are known by that. Clears the word.
  uint64_t wanted_rays(size_t record, uint32_t word, bool& changed);
  void sum(size_t record, Sums&);
  void find_seen(size_t record, Sums&) const;
  float find_radius(const Record&, Sums&) const;
  ShortRays short_rays(const WalkScene&) const;
  WalkScene walk(const CommittedScene& scene) const {
    return {scene, settings_.walk.limits, shown_.empty() ? nullptr : &shown_, false};
  }

  CacheSettings settings_;
  bool stale_ = true;    // nothing that is kept may be used
  bool lazy_ = false;    // short rays wait for refine()
  bool loaded_ = false;  // came from a file: the lights have to be compared
  std::string discarded_;
  Spacing spacing_;
  LightEmission emission_;
  Viewpoint viewpoint_;  // that the lights were traced for
  VirtualLightColumns lights_;
  std::vector<uint64_t> front_, back_;  // bits: lights that shine on that side
  LightChanges light_changes_;          // of the last update
  uint64_t lamps_version_ = 0;
  Placement placement_;
  InstanceMask shown_;
  float bound_ = 0.0f;
  Vec3 center_{0.0f};
  float radius_ = 0.0f;

  std::vector<Record> records_;
  VisibilityTable visibility_;
  std::vector<NearbyEdit> nearby_edits_;
  NearbyTable nearby_;                     // without short rays it has no rows
  std::vector<uint64_t> only_moved_;       // bits of records: was seen, and only what just moved can hide it
  std::unique_ptr<RaySubset> moved_rays_;  // through what just moved; both for the last update alone
  Octree octree_, fresh_;                  // all of them; those of the last fill()
  bool has_fresh_ = false;
  Box fresh_box_;                        // where those of the last fill() reach
  mutable std::vector<uint32_t> used_;   // the update after which a record last answered
  mutable std::vector<uint8_t> wanted_;  // asked for while something of it was unknown
  uint32_t update_ = 0;
  size_t asked_whole_ = 0;    // records that a whole frame asked, lately
  uint32_t interrupted_ = 0;  // frames since the last whole one: in these, records are not used for no fault of theirs
  CacheCounts counts_;
};

}  // namespace afterglow::instant_cache
