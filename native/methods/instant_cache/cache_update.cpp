// SPDX-License-Identifier: GPL-3.0-or-later
// The temporal update (Debattista et al. 2009, algorithm 1): all five cases, marked before any ray is traced.
//   1, 2  a light moved, came or went because its path did: its ray from every record is unknown.
//   3     a light that was seen and whose way now crosses an object's new bounds.
//   4     a light that was not seen (or not fully) and whose way crossed an object's old bounds.
//   5     a record on a moved object: it rides along and all of its rays are unknown; without its triangle it is
//   dropped.
// A change of colour or strength alone marks nothing: sums are made anew from the visibility that is known.
#include <algorithm>
#include <bit>
#include <chrono>
#include <numeric>
#include <utility>

#include "base/parallel.h"
#include "methods/instant_cache/cache.h"

namespace afterglow::instant_cache {

namespace {

constexpr float kVisible = 0.003f;      // relative change of a record's light
constexpr size_t kManyObjects = 512;    // beyond, everything is asked again
constexpr size_t kManyEdits = 16;       // that wait for their marks
constexpr size_t kManyObstacles = 128;  // beyond, all short rays are traced again
constexpr uint32_t kGroup = 16;         // records that are tested together

double now() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

void set_bit(std::vector<uint64_t>& bits, uint32_t k) { bits[k / 64] |= uint64_t(1) << (k % 64); }

bool same_walk(const WalkLimits& a, const WalkLimits& b) {
  return a.max_bounces == b.max_bounces && a.diffuse == b.diffuse && a.transparent == b.transparent &&
         a.transmission == b.transmission && a.caustics_reflective == b.caustics_reflective &&
         a.caustics_refractive == b.caustics_refractive;
}

}  // namespace

void Cache::configure(const CacheSettings& settings) {
  const CacheSettings& o = settings_;
  std::string other;
  const auto compare = [&](bool same, const char* name) {
    if (!same) other += (other.empty() ? "" : ", ") + std::string(name);
  };
  compare(same_walk(settings.walk.limits, o.walk.limits), "Light Paths");
  compare(settings.lights.count == o.lights.count, "Virtual Lights");
  compare(settings.lights.pattern == o.lights.pattern, "Pattern");
  compare(settings.lights.bound == o.lights.bound, "Bound");
  compare(settings.lights.short_rays == o.lights.short_rays, "Short Rays");
  compare(settings.accuracy == o.accuracy, "Interpolation");
  stale_ |= !other.empty();
  if (loaded_) discarded_ = other;
  settings_ = settings;
  spacing_ = spacing_of(settings.accuracy);
}

void Cache::reset(const CommittedScene& scene) {
  records_.clear(), used_.clear(), wanted_.clear();
  visibility_.reset(
      plan_slots(settings_.lights.count, settings_.lights.options(settings_.walk.limits, 0).bounces).slots,
      scene.effects.has(kTransparency) || !shown_.empty());
  nearby_.reset(settings_.lights.short_rays), nearby_edits_.clear();
  octree_.clear(center_, radius_);
  lights_.fill({});
  placement_.clear();
  counts_.resets++;
  stale_ = false;
}

void Cache::update(const CommittedScene& scene, const SceneChanges& changes, Work& work) {
  const double begun = now();
  const InstanceMask shown = work.shown ? *work.shown : InstanceMask{};
  Vec3 center;
  float radius;
  LightEmission::surrounding_ball(scene.scene.bounds(), center, radius);
  const bool coloured = scene.effects.has(kTransparency) || !shown.empty();
  lazy_ = work.left = work.lazy && settings_.lights.short_rays;
  stale_ |= changes.everything || changes.origin || shown != shown_;
  // Another ball around the scene: all sums are made anew, and the lights whose paths begin on it move. Visibility
  // stays.
  const bool scaled = center != center_ || radius != radius_;
  shown_ = shown, center_ = center, radius_ = radius;
  look_back();
  update_++;
  make_space();
  const bool all = stale_;
  if (all) {
    reset(scene);
  } else {
    if (coloured != visibility_.coloured()) visibility_.set_coloured(coloured), forget_sums();
    if (scaled) rebuild_octree();
  }
  counts_.rays_now = counts_.refused = 0;
  SceneChanges seen = changes;
  seen.camera = false;
  counts_.updated = counts_.reused = counts_.moved = counts_.created = 0;
  const Viewpoint viewpoint = snapped_viewpoint(scene);
  const bool other_view = std::exchange(viewpoint_, viewpoint) != viewpoint && emission_.far();
  const bool compares = std::exchange(loaded_, false) || scaled || other_view;
  if (!lazy_) mark_nearby(scene, work);
  if (!all && !compares && seen.empty()) {
    counts_.reused = records_.size();
    std::vector<uint32_t> waiting;  // an earlier update was interrupted, or lazy
    for (uint32_t i = 0; i < records_.size(); ++i) {
      if (wants_short_rays(i)) records_[i].ready = false;
      if (!records_[i].ready && was_used(i)) waiting.push_back(i);
    }
    if (!settings_.on_demand) counts_.update_rays += resolve(scene, waiting, work);
    has_fresh_ = false;
    return;
  }
  age();
  std::vector<uint64_t>& moved_slots = light_changes_.moved;
  bool recoloured = false;
  trace_lights(scene, work, moved_slots, recoloured);
  const float bound = settings_.lights.bound_length(scene.scene.bounds(), lights_.lights);
  const bool other_bound = std::exchange(bound_, bound) != bound;
  recoloured |= scaled || other_bound;
  if (scaled || other_bound)
    forget_sums();
  else if (light_changes_.any)
    forget_sums_of(light_changes_.other);
  const std::vector<Moved> moved = placement_.update(scene, changes);
  counts_.objects_moved = uint32_t(moved.size());
  follow(scene, moved);
  if (other_bound)  // what the bound hid may show
    for (size_t i = 0; i < records_.size(); ++i) mark_hidden(i);
  if (std::any_of(moved_slots.begin(), moved_slots.end(), [](uint64_t w) { return w != 0; }))
    for (size_t i = 0; i < records_.size(); ++i) mark(i, moved_slots);
  mark_crossings(moved, work);
  if (settings_.lights.short_rays) {
    if (other_bound)
      for (size_t i = 0; i < records_.size(); ++i) nearby_.forget(i);
    note_nearby(scene, changes, moved, work);
  }

  std::vector<uint32_t> waiting, dimmed;
  for (uint32_t i = 0; i < records_.size(); ++i) {
    const uint64_t* unknown = visibility_.unknown(i);
    uint64_t any = 0;
    for (uint32_t w = 0; w < visibility_.words(); ++w)
      any |= unknown[w], counts_.pairs_marked += uint64_t(std::popcount(unknown[w]));
    counts_.pairs += lights_.count;
    if (any || wants_short_rays(i)) {
      records_[i].ready = false;
      if (was_used(i)) waiting.push_back(i);  // the others wait until somebody wants them
    } else if (recoloured) {
      records_[i].ready = false;  // whatever stops the sums
      dimmed.push_back(i);
    } else {
      counts_.reused++;
    }
  }
  resolve(scene, dimmed, work);  // sums alone
  std::fill(wanted_.begin(), wanted_.end(), uint8_t(0));
  if (!settings_.on_demand) {
    prepare_moved_rays(scene, moved);
    counts_.update_rays += resolve(scene, waiting, work), counts_.updated += waiting.size();
    moved_rays_.reset();
  }
  only_moved_.clear();
  has_fresh_ = false;
  counts_.seconds_update += now() - begun;
}

bool Cache::refine(const CommittedScene& scene, Work& work) {
  if (!std::exchange(lazy_, false)) return false;
  const double begun = now();
  mark_nearby(scene, work);
  std::vector<uint32_t> waiting;
  std::vector<Rgb> before;
  for (uint32_t i = 0; i < records_.size(); ++i)
    if (was_used(i) && nearby_.unknown(i)) waiting.push_back(i), before.push_back(records_[i].irradiance);
  counts_.update_rays += resolve(scene, waiting, work);
  counts_.seconds_refine += now() - begun;
  for (size_t i = 0; i < waiting.size(); ++i) {
    const Rgb& now = records_[waiting[i]].irradiance;
    if (luminance(glm::abs(now - before[i])) > kVisible * luminance(now)) return true;
  }
  return false;
}

/// Cases 1 and 2: slots whose light is not where it was, or shines where it was black.
void Cache::trace_lights(const CommittedScene& scene, Work& work, std::vector<uint64_t>& moved_slots,
                         bool& recoloured) {
  const double begun = now();
  RayCounts rays;
  emission_.build(scene.scene, scene.materials);
  std::vector<VirtualLight> lights =
      trace_virtual_lights(walk(scene), emission_, settings_.lights.options(settings_.walk.limits, work.threads), rays);
  const uint32_t slots = uint32_t(lights.size());
  moved_slots.assign(visibility_.words(), 0), light_changes_.other = moved_slots;
  light_changes_.any = false;
  light_changes_.grouped.assign(slots / ShortRays::kGroup + 1, 0);
  counts_.lights_moved = counts_.lights_recoloured = counts_.lights = 0;
  const bool first = lights_.count != slots;
  for (uint32_t k = 0; k < slots; ++k) {
    const VirtualLight none, &before = first ? none : lights_.lights[k], &now = lights[k];
    counts_.lights += !now.black();
    const bool moved = first || !before.same_place(now);
    const bool lit = (is_black(before.front) && !is_black(now.front)) || (is_black(before.back) && !is_black(now.back));
    if (moved || lit) set_bit(moved_slots, k), counts_.lights_moved++;
    const bool other = !before.same_strength(now);
    if (other) recoloured = true, counts_.lights_recoloured += !moved;
    if (!moved && !other) continue;
    light_changes_.any = true, light_changes_.grouped[k / ShortRays::kGroup] = 1;
    set_bit(light_changes_.other, k);
  }
  lights_.fill(std::move(lights));
  front_.assign(visibility_.words(), 0), back_.assign(visibility_.words(), 0);
  for (uint32_t k = 0; k < slots; ++k) {
    if (!lights_.lights[k].alive) continue;
    if (!is_black(lights_.lights[k].front)) set_bit(front_, k);
    if (!is_black(lights_.lights[k].back)) set_bit(back_, k);
  }
  counts_.path_rays += rays.bounce;
  counts_.seconds_lights += now() - begun;
}

/// Case 5: records follow the triangle that they stand on; those that lost it are dropped.
void Cache::follow(const CommittedScene& scene, const std::vector<Moved>& moved) {
  std::vector<const Moved*> by_instance(std::max<size_t>(scene.scene.instances().size(), 1), nullptr);
  bool any = false;
  std::vector<uint32_t> gone;
  for (const Moved& m : moved) {
    if (m.in_place) continue;
    any = true;
    if (m.instance >= by_instance.size()) by_instance.resize(m.instance + 1, nullptr);
    by_instance[m.instance] = &m;
  }
  if (!any) return;
  std::vector<uint32_t> kept, follows;
  for (uint32_t i = 0; i < records_.size(); ++i) {
    Record& record = records_[i];
    const Moved* m = record.place.instance < by_instance.size() ? by_instance[record.place.instance] : nullptr;
    if (!m) {
      kept.push_back(i);
      continue;
    }
    if (!m->keeps_places || !m->after.present() || !locate(scene.scene, record)) {
      counts_.dropped++;
      continue;
    }
    counts_.moved++;
    record.summed = false;
    follows.push_back(i);
    if (settings_.lights.short_rays) nearby_.forget(i);
    uint64_t* unknown = visibility_.unknown(i);
    std::fill_n(unknown, visibility_.words(), ~uint64_t(0));
    if (lights_.count % 64) unknown[visibility_.words() - 1] = (uint64_t(1) << (lights_.count % 64)) - 1;
    kept.push_back(i);
  }
  if (kept.size() != records_.size() || follows.size() > records_.size() / 2) {
    keep(kept);
    rebuild_octree();
  } else {
    for (const uint32_t i : follows) octree_.move(i, records_[i]);
  }
}

/// Rays that were seen and are marked because of what just moved need nothing else.
void Cache::prepare_moved_rays(const CommittedScene& scene, const std::vector<Moved>& moved) {
  if (only_moved_.empty()) return;
  std::vector<uint32_t> there;
  for (const Moved& m : moved)
    if (m.after.present()) there.push_back(m.instance);
  moved_rays_ = std::make_unique<RaySubset>(scene.rays, there);
  if (!moved_rays_->complete()) moved_rays_.reset();
}

void Cache::forget_sums() {
  for (Record& record : records_) record.summed = false;
}

/// Only what is seen counts in a sum; what comes into sight is found out when it is asked.
void Cache::forget_sums_of(const std::vector<uint64_t>& lights) {
  for (size_t i = 0; i < records_.size(); ++i)
    for (uint32_t w = 0; w < visibility_.words(); ++w)
      if (visibility_.seen(i)[w] & lights[w]) records_[i].summed = false;
}

void Cache::mark_hidden(size_t record) {
  const uint64_t* facing = visibility_.facing(record);
  for (uint32_t k = 0; k < lights_.count; ++k)
    if (!(facing[k / 64] >> (k % 64) & 1)) visibility_.unknown(record)[k / 64] |= uint64_t(1) << (k % 64);
}

void Cache::mark(size_t record, const std::vector<uint64_t>& slots) {
  uint64_t* unknown = visibility_.unknown(record);
  for (uint32_t w = 0; w < visibility_.words(); ++w) unknown[w] |= slots[w];
}

/// Cases 3 and 4. Groups of records near each other are tested against each object first, then each record against the
/// object's own box, then what is known tells whether a ray has to be traced.
void Cache::mark_crossings(const std::vector<Moved>& moved, Work& work) {
  only_moved_.clear();
  if (moved.empty() || records_.empty() || !lights_.count) return;
  if (moved.size() > kManyObjects) {
    const std::vector<uint64_t> all(visibility_.words(), ~uint64_t(0));
    std::vector<uint64_t> every = all;
    if (lights_.count % 64) every.back() = (uint64_t(1) << (lights_.count % 64)) - 1;
    for (size_t i = 0; i < records_.size(); ++i) mark(i, every);
    return;
  }
  std::vector<uint32_t> order(records_.size());
  std::iota(order.begin(), order.end(), 0u);
  order = along_curve(order);
  const uint32_t words = visibility_.words();
  // Rays begin and end a little above the faces: all boxes are taken as much larger.
  float lift = 0.0f, error = 0.0f;
  for (const VirtualLight& light : lights_.lights) lift = std::max(lift, light.lift);
  for (const Record& record : records_) error = std::max(error, record.error);
  struct Place {
    Crossing crossing;
    bool old;
  };
  std::vector<Place> places;
  for (const Moved& m : moved)
    for (const bool old : {true, false})
      if (const Bounds& bounds = old ? m.before : m.after; bounds.present())
        places.push_back({Crossing(bounds, 2.0f * (lift + error), lights_), old});
  const bool solid = shown_.empty() && std::all_of(moved.begin(), moved.end(),
                                                   [](const Moved& m) { return m.opaque_now || !m.after.present(); });
  only_moved_.assign(solid ? records_.size() * words : 0, 0);
  parallel_blocks(order.size(), kGroup, work.threads, [&](size_t begin, size_t end) {
    Box around;
    for (size_t i = begin; i < end; ++i) around.extend(records_[order[i]].position);
    std::vector<uint64_t> bits(words * 4);
    uint64_t *darker = bits.data(), *brighter = darker + words, *near = brighter + words, *crosses = near + words;
    for (size_t i = begin; i < end; ++i)
      for (uint32_t w = 0; w < words; ++w) {
        const size_t row = order[i];
        darker[w] |= visibility_.could_darken(row, w), brighter[w] |= visibility_.could_brighten(row, w);
      }
    for (const Place& place : places) {
      if (!place.crossing.box(around.center(), 0.5f * around.size(), place.old ? brighter : darker, near)) continue;
      for (size_t i = begin; i < end; ++i) {
        const size_t row = order[i];
        uint64_t* unknown = visibility_.unknown(row);
        for (uint32_t w = 0; w < words; ++w)
          crosses[w] = near[w] & ~unknown[w] &
                       (place.old ? visibility_.could_brighten(row, w) : visibility_.could_darken(row, w));
        const Vec3& from = records_[row].position;
        if (!place.crossing.box(from, Vec3(0.0f), crosses, crosses)) continue;
        place.crossing.parts(from, crosses);
        for (uint32_t w = 0; w < words; ++w) {
          unknown[w] |= crosses[w];
          if (!place.old && !only_moved_.empty() && crosses[w])
            only_moved_[row * words + w] |= crosses[w] & ~visibility_.could_brighten(row, w);
        }
      }
    }
  });
}

/// What short rays met rides along with nothing: their walks go anew where an object's bounds touch them.
void Cache::note_nearby(const CommittedScene& scene, const SceneChanges& changes, const std::vector<Moved>& moved,
                        Work& work) {
  NearbyEdit edit;
  for (const Moved& m : moved) {
    if (m.before.present()) edit.obstacles.emplace_back(m.before, m.in_place, true, m.opaque);
    if (m.after.present() && !m.in_place) edit.obstacles.emplace_back(m.after, true, false, false);
  }
  for (const Bounds& bounds : placement_.repainted(scene, changes))
    edit.obstacles.emplace_back(bounds, true, true, false);
  light_changes_.lamps = std::exchange(lamps_version_, scene.lights.version()) != scene.lights.version();
  edit.lights = light_changes_;
  if (!edit.obstacles.empty() || edit.lights.any || edit.lights.lamps) nearby_edits_.push_back(std::move(edit));
  if (!lazy_ || nearby_edits_.size() >= kManyEdits) mark_nearby(scene, work);
}

/// Edits one after the other. Lights stand where the last one put them: what an earlier one asks of a light that moved
/// since is marked by the later one.
void Cache::mark_nearby(const CommittedScene& scene, Work& work) {
  if (nearby_edits_.empty()) return;
  const WalkScene walked = walk(scene);
  const ShortRays rays = short_rays(walked);
  parallel_blocks(records_.size(), kGroup, work.threads, [&](size_t begin, size_t end) {
    for (const NearbyEdit& edit : nearby_edits_)
      for (size_t i = begin; i < end; ++i)
        if (edit.obstacles.size() > kManyObstacles)
          nearby_.forget(i);
        else
          nearby_.mark(i, records_[i], rays, edit.obstacles, edit.lights, lights_);
  });
  nearby_edits_.clear();
}

void Cache::look_back() {
  const size_t asked = size_t(std::count(used_.begin(), used_.end(), update_));
  interrupted_ = 2 * asked >= asked_whole_ ? 0 : interrupted_ + 1;
  asked_whole_ = std::max(asked, asked_whole_ - (asked_whole_ + 15) / 16);  // down to none, of who looks at the sky
}

void Cache::age() {
  if (!settings_.keep_updates) return;
  std::vector<uint32_t> kept;
  for (uint32_t i = 0; i < records_.size(); ++i)
    if (update_ - used_[i] <= settings_.keep_updates + interrupted_) kept.push_back(i);
  forget_others(kept);
}

void Cache::make_space() {
  const size_t most = most_records();
  if (records_.size() < most - most / 8) return;
  std::vector<uint32_t> last = used_;
  std::nth_element(last.begin(), last.begin() + std::ptrdiff_t(last.size() / 2), last.end());
  std::vector<uint32_t> kept;
  for (uint32_t i = 0; i < records_.size(); ++i)
    if (was_used(i) || used_[i] > last[last.size() / 2]) kept.push_back(i);
  forget_others(kept);
}

void Cache::forget_others(const std::vector<uint32_t>& kept) {
  if (kept.size() == records_.size()) return;
  counts_.dropped += records_.size() - kept.size();
  keep(kept);
  rebuild_octree();
}

void Cache::keep(const std::vector<uint32_t>& kept) {
  for (size_t to = 0; to < kept.size(); ++to) {
    records_[to] = records_[kept[to]];
    used_[to] = used_[kept[to]], wanted_[to] = wanted_[kept[to]];
  }
  records_.resize(kept.size()), used_.resize(kept.size()), wanted_.resize(kept.size());
  visibility_.keep(kept);
  nearby_.keep(kept);
}

void Cache::rebuild_octree() {
  octree_.clear(center_, radius_);
  for (uint32_t i = 0; i < records_.size(); ++i) octree_.insert(i, records_[i], records_[i].radius);
}

}  // namespace afterglow::instant_cache
