// SPDX-License-Identifier: GPL-3.0-or-later
// Filling the cache and answering from it: see cache.h; the temporal update is in cache_update.cpp.
#include "methods/instant_cache/cache.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <chrono>

#include "base/packing.h"
#include "base/parallel.h"

namespace afterglow::instant_cache {

namespace {

constexpr size_t kRecordBlock = RayCaster::kTogether;

double now() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

uint64_t spread_bits(uint64_t x) {  // every third bit
  x &= 0x1fffff;
  x = (x | x << 32) & 0x1f00000000ffffull;
  x = (x | x << 16) & 0x1f0000ff0000ffull;
  x = (x | x << 8) & 0x100f00f00f00f00full;
  x = (x | x << 4) & 0x10c30c30c30c30c3ull;
  return (x | x << 2) & 0x1249249249249249ull;
}

/// Which points go first: a coarse grid of pixels, then finer ones, so that records stand apart.
uint32_t round_of(const CachePoint& p) {
  const uint32_t both = uint32_t(p.x) | uint32_t(p.y);
  return both % 16 == 0 ? 0 : both % 8 == 0 ? 1 : both % 4 == 0 ? 2 : both % 2 == 0 ? 3 : 4;
}
constexpr uint32_t kRounds = 5;

/// The points of each round, in their order.
std::array<std::vector<uint32_t>, kRounds> in_rounds(std::span<const CachePoint> points, unsigned threads) {
  std::vector<uint8_t> round(points.size());
  parallel_blocks(points.size(), 4096, threads, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) round[i] = uint8_t(round_of(points[i]));
  });
  std::array<size_t, kRounds> sizes{};
  for (const uint8_t r : round) sizes[r]++;
  std::array<std::vector<uint32_t>, kRounds> rounds;
  for (uint32_t r = 0; r < kRounds; ++r) rounds[r].reserve(sizes[r]);
  for (uint32_t i = 0; i < round.size(); ++i) rounds[round[i]].push_back(i);
  return rounds;
}

}  // namespace

ShortRays Cache::short_rays(const WalkScene& walked) const {
  const VirtualLightSettings& s = settings_.lights;
  return {walked, lights_, plan_slots(s.count, s.options(settings_.walk.limits, 0).bounces), bound_, s.short_rays};
}

Answer Cache::answer(const CachePoint& p) const {
  Answer result;
  const float limit = spacing_.most_pixels * p.footprint;
  float weights = 0.0f;
  Rgb sum(0.0f);
  bool waits = false;
  std::vector<uint32_t> near;
  octree_.find_near({p.position, p.position}, 1.0f / limit, p.instance, near);
  for (const uint32_t r : near) {
    const float distance = distance_to_record(octree_.entry(r), p, limit, spacing_.angle_scale);
    if (distance >= 1.0f) continue;
    const Record& record = records_[r];
    if (!record.ready) {
      std::atomic_ref(wanted_[r]).store(1, std::memory_order_relaxed);
      waits = true;
      continue;
    }
    note_use(r);
    const float weight = record_weight(distance);
    weights += weight;
    sum += weight * light_at(record, p);
  }
  if (!(weights > 0.0f) || waits) return result;
  result.light = sum / weights;
  result.weight = 1.0f;
  return result;
}

/// Writes only what is new: threads share the memory.
void Cache::note_use(uint32_t record) const {
  const std::atomic_ref used(used_[record]);
  if (used.load(std::memory_order_relaxed) != update_) used.store(update_, std::memory_order_relaxed);
}

bool Cache::covered(const CachePoint& p) const {
  const float limit = spacing_.most_pixels * p.footprint;
  bool found = false;
  octree_.visit_near({p.position, p.position}, 1.0f / limit, [&](uint32_t r) {
    const float distance = distance_to_record(octree_.entry(r), p, limit, spacing_.angle_scale);
    found = distance < 1.0f && record_weight(distance) > kCoveringWeight;
    return !found;
  });
  return found;
}

void Cache::insert(const CommittedScene& scene, const CachePoint& p) {
  Record record;
  record.place = place_of(scene.scene, p);
  if (!locate(scene.scene, record)) return;
  record.footprint = p.footprint;
  record.reach = record.radius = std::max(spacing_.most_pixels * p.footprint, 1e-6f * radius_);
  record.born = record.asked = update_;
  octree_.insert(uint32_t(records_.size()), record, record.reach);
  const size_t size = records_.size() + 1;
  make_room(records_, size), make_room(used_, size), make_room(wanted_, size);
  records_.push_back(record);
  used_.push_back(update_);
  wanted_.push_back(0);
  visibility_.add_row();
  if (settings_.lights.short_rays) nearby_.add_row();
  counts_.created++;
}

void Cache::fill(const CommittedScene& scene, std::span<const CachePoint> points, Work& work) {
  const double begun = now();
  const uint32_t before = uint32_t(records_.size());
  std::vector<uint32_t> wanted;
  for (uint32_t i = 0; i < records_.size(); ++i)
    if (wanted_[i]) wanted.push_back(i), wanted_[i] = 0;
  counts_.updated += wanted.size();
  counts_.update_rays += resolve(scene, wanted, work);
  std::array<std::vector<uint32_t>, kRounds> rounds = in_rounds(points, work.threads);
  // A record's radius is known when its light is, and may turn out smaller than it was taken for while records were
  // chosen: points that new records seemed to cover are asked again. Each repeat brings at least one record.
  std::vector<uint8_t> open;
  for (std::vector<uint32_t>& asked : rounds)
    while (!work.stop.stop()) {
      const size_t most = most_records();
      open.assign(asked.size(), 0);
      parallel_blocks(asked.size(), 512, work.threads, [&](size_t begin, size_t end) {
        find_open(points, std::span(asked).subspan(begin, end - begin), open.data() + begin);
      });
      size_t left = 0;
      for (size_t i = 0; i < asked.size(); ++i)
        if (open[i]) asked[left++] = asked[i];
      asked.resize(left);
      const uint32_t first = uint32_t(records_.size());
      // A point that has a record of its own is not asked again: where even that one does not cover it, none will.
      left = 0;
      for (const uint32_t i : asked)
        if (covered(points[i]))
          asked[left++] = i;
        else if (records_.size() >= most)
          counts_.refused++;
        else
          insert(scene, points[i]);
      asked.resize(left);
      if (records_.size() == first) break;
      std::vector<uint32_t> fresh(records_.size() - first);
      for (uint32_t i = 0; i < fresh.size(); ++i) fresh[i] = first + i;
      counts_.fill_rays += resolve(scene, fresh, work);
    }
  fresh_.clear(center_, radius_);
  has_fresh_ = records_.size() > before;
  fresh_box_ = Box{};
  for (uint32_t i = before; i < records_.size(); ++i) {
    const Record& record = records_[i];
    fresh_.insert(i - before, record, record.radius);
    const float reach = 1.001f * record.radius;
    fresh_box_.extend(record.position - reach), fresh_box_.extend(record.position + reach);
  }
  counts_.seconds_fill += now() - begun;
}

std::vector<uint32_t> Cache::along_curve(std::span<const uint32_t> which) const {
  std::vector<std::pair<uint64_t, uint32_t>> order(which.size());
  const float scale = float(1 << 20) / std::max(2.0f * radius_, 1e-30f);
  for (size_t i = 0; i < which.size(); ++i) {
    const Vec3 at = glm::clamp((records_[which[i]].position - center_ + radius_) * scale, Vec3(0.0f), Vec3(1048575.0f));
    order[i] = {spread_bits(uint64_t(at.x)) | spread_bits(uint64_t(at.y)) << 1 | spread_bits(uint64_t(at.z)) << 2,
                which[i]};
  }
  std::sort(order.begin(), order.end());
  std::vector<uint32_t> sorted(which.size());
  for (size_t i = 0; i < which.size(); ++i) sorted[i] = order[i].second;
  return sorted;
}

uint64_t Cache::resolve(const CommittedScene& scene, std::span<const uint32_t> records, Work& work) {
  const std::vector<uint32_t> which = along_curve(records);
  std::atomic<uint64_t> rays{0};
  const WalkScene walked = walk(scene);
  const ShortRays nearby = short_rays(walked);
  parallel_blocks(
      which.size(), kRecordBlock, work.threads,
      [&](size_t begin, size_t end) {
        RayCounts counts;
        Sums sums;
        sums.terms.resize(lights_.padded());
        const uint32_t changed = ask(walked, std::span(which).subspan(begin, end - begin), counts);
        for (size_t i = begin; i < end; ++i) {
          Record& record = records_[which[i]];
          const Rgb compensation = record.compensation;
          if (settings_.lights.short_rays && !lazy_)
            record.compensation = nearby_.repair(which[i], nearby, record, counts);
          // Most of what an edit makes unknown turns out to be as it was: then so is the sum, to the last bit.
          if (changed >> (i - begin) & 1 || !record.summed || record.compensation != compensation) sum(which[i], sums);
          record.ready = true;
        }
        rays += counts.shadow + counts.bounce;
      },
      work.stop);
  for (const uint32_t i : which)
    if (records_[i].ready) octree_.set_radius(i, records_[i]);
  counts_.rays_now += rays;
  return rays;
}

uint32_t Cache::ask(const WalkScene& walked, std::span<const uint32_t> which, RayCounts& counts) {
  constexpr size_t kMost = RayCaster::kTogether;
  std::array<Vec3, kMost> from;
  std::array<uint32_t, kMost> rays{};
  std::array<uint64_t, kMost> asked;
  uint32_t changed = 0;
  for (size_t i = 0; i < which.size(); ++i) from[i] = lifted(records_[which[i]]);
  for (uint32_t w = 0; w < visibility_.words(); ++w) {
    uint64_t any = 0;
    for (size_t i = 0; i < which.size(); ++i) {
      const uint64_t quick = moved_rays_ && which[i] * visibility_.words() < only_moved_.size()
                                 ? only_moved_[which[i] * visibility_.words() + w]
                                 : 0;
      bool other = false;
      asked[i] = wanted_rays(which[i], w, other);
      for (uint64_t bits = asked[i] & quick; bits; bits &= bits - 1) {  // were seen, and nothing else can hide them
        const uint32_t k = w * 64 + uint32_t(std::countr_zero(bits));
        counts.shadow++, rays[i]++;
        if (moved_rays_->occluded(visibility_ray(from[i], lights_.lights[k])))
          other |= visibility_.set(which[i], k, Rgb(0.0f));
      }
      asked[i] &= ~quick;
      any |= asked[i];
      changed |= uint32_t(other) << i;
    }
    for (; any; any &= any - 1) {  // to one light from all that ask for it
      const uint64_t bit = any & -any;
      const uint32_t k = w * 64 + uint32_t(std::countr_zero(any));
      std::array<Ray, kMost> ray;
      std::array<Rgb, kMost> seen;
      std::array<uint8_t, kMost> whose;
      size_t count = 0;
      for (size_t i = 0; i < which.size(); ++i)
        if (asked[i] & bit) ray[count] = visibility_ray(from[i], lights_.lights[k]), whose[count++] = uint8_t(i);
      visibility(walked, std::span(ray).first(count), seen, counts);
      for (size_t j = 0; j < count; ++j) {
        rays[whose[j]]++;
        changed |= uint32_t(visibility_.set(which[whose[j]], k, seen[j])) << whose[j];
      }
    }
  }
  for (size_t i = 0; i < which.size(); ++i) {
    Record& record = records_[which[i]];
    record.rays = rays[i];
    if (record.rays) record.asked = update_;
  }
  return changed;
}

uint64_t Cache::wanted_rays(size_t index, uint32_t w, bool& changed) {
  uint64_t &unknown = visibility_.unknown(index)[w], &facing = visibility_.facing(index)[w];
  if (!unknown) return 0;
  const Record& record = records_[index];
  float terms[64];
  geometry_terms(lights_, record.position, record.normal, bound_, terms, 64 * w,
                 std::min(lights_.padded() - 64 * w, 64u));
  uint64_t wanted = 0;
  for (uint64_t bits = unknown; bits; bits &= bits - 1) {
    const uint64_t bit = bits & -bits;
    const uint32_t slot = uint32_t(std::countr_zero(bits)), k = w * 64 + slot;
    const float g = terms[slot];
    const bool shines = g > 0.0f ? front_[w] & bit : g < 0.0f && (back_[w] & bit);
    if (shines && can_see(record.position, record.face_normal, lights_.lights[k], g > 0.0f))
      wanted |= bit;
    else
      changed |= visibility_.set(index, k, Rgb(0.0f));
  }
  facing = (facing & ~unknown) | wanted;
  unknown = 0;
  return wanted;
}

Verification Cache::verify(const CommittedScene& scene, Work& work) const {
  Verification result;
  std::mutex mutex;
  const WalkScene walked = walk(scene);
  const ShortRays nearby = short_rays(walked);
  parallel_blocks(records_.size(), kRecordBlock, work.threads, [&](size_t begin, size_t end) {
    std::vector<float> terms(lights_.padded());
    std::vector<ShortRayStop> stops;
    RayCounts counts;
    for (size_t i = begin; i < end; ++i) {
      const Record& stored = records_[i];
      if (!stored.ready) continue;
      Record fresh = stored;
      if (!locate(scene.scene, fresh)) continue;
      geometry_terms(lights_, fresh.position, fresh.normal, bound_, terms.data());
      Rgb sum(0.0f);
      for (uint32_t k = 0; k < lights_.count; ++k) {
        const float g = terms[k];
        const Rgb& light = g > 0.0f ? lights_.lights[k].front : lights_.lights[k].back;
        if (g == 0.0f || is_black(light) || !can_see(fresh.position, fresh.face_normal, lights_.lights[k], g > 0.0f))
          continue;
        const Rgb kept = visibility_.get(i, k);
        const auto ask = [&](const Vec3& from) {
          const Rgb seen = visibility(walked, visibility_ray(from, lights_.lights[k]), counts);
          return visibility_.coloured() ? unpack_transmittance(pack_transmittance(seen)) : seen;
        };
        Rgb seen = ask(lifted(fresh));
        // A ray that passes an edge within rounding may be told either, alone or among others.
        const float rounding = 2e-6f * max_component(glm::abs(fresh.position) + glm::abs(lights_.lights[k].position));
        const Frame frame(fresh.face_normal);
        for (const Vec3& way : {frame.t, -frame.t, frame.b, -frame.b})
          if (seen != kept && ask(lifted(fresh) + rounding * way) == kept) seen = kept;
        sum += std::fabs(g) * light * seen;
      }
      sum += nearby.gather(short_ray_place(fresh), stops, counts);
      const Rgb off = glm::abs(sum - stored.irradiance);
      const double relative = double(max_component(off)) / std::max(double(max_component(sum)), 1e-30);
      const std::lock_guard lock(mutex);
      result.records++;
      result.differing += relative > 1e-5;
      result.worst = std::max(result.worst, relative);
    }
  });
  return result;
}

size_t Cache::record_bytes() const {
  const size_t nearby = records_.empty() ? 0 : nearby_.bytes() / records_.size();
  return sizeof(Record) + 5 + visibility_.row_bytes() + nearby;
}

size_t Cache::most_records() const {
  const size_t octree = records_.empty() ? 0 : octree_.bytes() / records_.size();
  return settings_.most_bytes * 5 / (6 * (record_bytes() + octree));  // with room for more
}

size_t Cache::bytes() const {
  return records_.capacity() * sizeof(Record) + visibility_.bytes() + octree_.bytes() + nearby_.bytes() +
         5 * records_.capacity();
}

}  // namespace afterglow::instant_cache
