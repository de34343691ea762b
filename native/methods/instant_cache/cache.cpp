// SPDX-License-Identifier: GPL-3.0-or-later
// Filling the cache and answering from it: see cache.h; the temporal update is in cache_update.cpp.
#include "methods/instant_cache/cache.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <chrono>
#include <cstring>

#include "base/parallel.h"

namespace afterglow::instant_cache {

namespace {

using Eight = float __attribute__((vector_size(32)));  // the compiler splits it where registers are narrower

constexpr float kSameLight = 0.02f;  // relative change of a record's light that leaves its radius as it is
constexpr int kRadiusRounds = 5;     // three halves lead from the largest to the smallest
constexpr size_t kRecordBlock = 4;   // 1024 rays or so

double now() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

/// Which points go first: a coarse grid of pixels, then finer ones, so that records stand apart.
uint32_t round_of(const CachePoint& p) {
  const uint32_t both = uint32_t(p.x) | uint32_t(p.y);
  return both % 16 == 0 ? 0 : both % 8 == 0 ? 1 : both % 4 == 0 ? 2 : both % 2 == 0 ? 3 : 4;
}
constexpr uint32_t kRounds = 5;

}  // namespace

Answer Cache::answer(const CachePoint& p) const {
  Answer result;
  const float limit = spacing_.most_pixels * p.footprint;
  float weights = 0.0f;
  Rgb sum(0.0f);
  bool waits = false;
  octree_.find(p.position, 1.0f / limit, [&](const Entry& e) {
    const float distance = distance_to_record(e, p, limit, spacing_.angle_scale);
    if (distance >= 1.0f) return true;
    const Record& record = records_[e.record];
    if (!record.ready) {
      std::atomic_ref(wanted_[e.record]).store(1, std::memory_order_relaxed);
      waits = true;
      return true;
    }
    note_use(e.record);
    const float weight = record_weight(distance);
    weights += weight;
    sum += weight * light_at(record, p);
    return true;
  });
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
  octree_.find(p.position, 1.0f / limit, [&](const Entry& e) {
    const float distance = distance_to_record(e, p, limit, spacing_.angle_scale);
    found = distance < 1.0f && record_weight(distance) > kCoveringWeight;
    return !found;
  });
  return found;
}

bool Cache::insert(const CommittedScene& scene, const CachePoint& p) {
  if (records_.size() >= settings_.most_records) return false;
  Record record;
  record.place = place_of(scene.scene, p);
  if (!locate(scene.scene, record)) return false;
  record.footprint = p.footprint;
  record.reach = record.radius = std::max(spacing_.most_pixels * p.footprint, 1e-6f * radius_);
  record.born = record.asked = update_;
  octree_.insert(uint32_t(records_.size()), record, record.reach);
  records_.push_back(record);
  used_.push_back(update_);
  wanted_.push_back(0);
  visibility_.add_row();
  counts_.created++;
  return true;
}

void Cache::fill(const CommittedScene& scene, std::span<const CachePoint> points, Work& work) {
  const double begun = now();
  const uint32_t before = uint32_t(records_.size());
  std::vector<uint32_t> wanted;
  for (uint32_t i = 0; i < records_.size(); ++i)
    if (wanted_[i]) wanted.push_back(i), wanted_[i] = 0;
  counts_.updated += wanted.size();
  counts_.update_rays += resolve(scene, wanted, work);
  std::vector<std::vector<uint32_t>> rounds(kRounds);
  for (uint32_t i = 0; i < points.size(); ++i) rounds[round_of(points[i])].push_back(i);
  // A record's radius is known when its light is, and may turn out smaller than it was taken for while records were
  // chosen: points that new records seemed to cover are asked again. Each repeat brings at least one record.
  std::vector<uint8_t> open;
  for (std::vector<uint32_t>& asked : rounds)
    while (!work.stop.stop()) {
      open.assign(asked.size(), 0);
      parallel_blocks(asked.size(), 512, work.threads, [&](size_t begin, size_t end) {
        find_open(points, std::span(asked).subspan(begin, end - begin), open.data() + begin);
      });
      size_t left = 0;
      for (size_t i = 0; i < asked.size(); ++i)
        if (open[i]) asked[left++] = asked[i];
      asked.resize(left);
      const uint32_t first = uint32_t(records_.size());
      for (const uint32_t i : asked)
        if (!covered(points[i]) && !insert(scene, points[i])) counts_.refused++;
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

uint64_t Cache::resolve(const CommittedScene& scene, std::span<const uint32_t> which, Work& work) {
  std::atomic<uint64_t> rays{0};
  const WalkScene walked = walk(scene);
  parallel_blocks(
      which.size(), kRecordBlock, work.threads,
      [&](size_t begin, size_t end) {
        RayCounts counts;
        Sums sums;
        sums.terms.resize(lights_.padded());
        for (size_t i = begin; i < end && !work.stop.stop(); ++i) {
          ask(walked, which[i], sums.terms.data(), counts);  // leaves the record's terms
          sum(which[i], sums);
        }
        rays += counts.shadow;
      },
      work.stop);
  for (const uint32_t i : which)
    if (records_[i].ready) octree_.set_radius(i, records_[i]);
  counts_.rays_now += rays;
  return rays;
}

void Cache::ask(const WalkScene& walked, size_t index, float* terms, RayCounts& counts) {
  Record& record = records_[index];
  const uint64_t rays_before = counts.shadow;
  geometry_terms(lights_, record.position, record.normal, bound_, terms);
  const Vec3 from = record.position + record.error * record.face_normal;
  uint64_t* unknown = visibility_.unknown(index);
  for (uint32_t w = 0; w < visibility_.words(); ++w) {
    for (uint64_t bits = unknown[w]; bits; bits &= bits - 1) {
      const uint32_t k = w * 64 + uint32_t(std::countr_zero(bits));
      const VirtualLight& light = lights_.lights[k];
      const float g = terms[k];
      const bool shines = g > 0.0f ? front_[w] >> (k % 64) & 1 : g < 0.0f && (back_[w] >> (k % 64) & 1);
      const bool asks = shines && can_see(record.position, record.face_normal, light, g > 0.0f);
      visibility_.set(index, k, asks ? visibility(walked, visibility_ray(from, light), counts) : Rgb(0.0f));
    }
    unknown[w] = 0;
  }
  record.rays = uint32_t(counts.shadow - rays_before);
  if (record.rays) record.asked = update_;
}

/// Terms: geometry_terms() of a place at or near the record's.
Rgb Cache::irradiance(size_t row, const float* terms) const {
  const uint64_t* seen = visibility_.seen(row);
  Rgb sum(0.0f);
  for (uint32_t w = 0; w < visibility_.words(); ++w)
    for (uint64_t bits = seen[w]; bits; bits &= bits - 1) {
      const uint32_t k = w * 64 + uint32_t(std::countr_zero(bits));
      const float g = terms[k];
      if (g == 0.0f) continue;
      const Rgb light = std::fabs(g) * (g > 0.0f ? lights_.lights[k].front : lights_.lights[k].back);
      sum += visibility_.coloured() ? light * visibility_.get(row, k) : light;
    }
  return is_finite(sum) ? sum : Rgb(0.0f);
}

/// Exact for the lights that are seen; what comes into sight or leaves it nearby is left aside.
void Cache::find_gradients(size_t index, Sums& sums) {
  Record& record = records_[index];
  const Frame frame(record.normal);
  GeometrySlopes& slopes = sums.slopes;
  geometry_slopes(lights_, record.position, frame, bound_, slopes);
  const uint64_t* seen = visibility_.seen(index);
  Rgb step_t(0.0f), step_b(0.0f), turn_t(0.0f), turn_b(0.0f);
  for (uint32_t w = 0; w < visibility_.words(); ++w)
    for (uint64_t bits = seen[w]; bits; bits &= bits - 1) {
      const uint32_t k = w * 64 + uint32_t(std::countr_zero(bits));
      const float g = sums.terms[k];
      if (g == 0.0f) continue;
      Rgb light = g > 0.0f ? lights_.lights[k].front : -lights_.lights[k].back;
      if (visibility_.coloured()) light *= visibility_.get(index, k);
      step_t += slopes.step_t[k] * light, step_b += slopes.step_b[k] * light;
      turn_t += slopes.turn_t[k] * light, turn_b += slopes.turn_b[k] * light;
    }
  const bool sound = is_finite(step_t) && is_finite(step_b) && is_finite(turn_t) && is_finite(turn_b);
  const glm::mat3 none(0.0f);
  record.by_step = sound ? glm::outerProduct(step_t, frame.t) + glm::outerProduct(step_b, frame.b) : none;
  record.by_turn = sound ? glm::outerProduct(turn_t, frame.t) + glm::outerProduct(turn_b, frame.b) : none;
}

void Cache::sum(size_t index, Sums& sums) {
  Record& record = records_[index];
  record.irradiance = irradiance(index, sums.terms.data());
  find_gradients(index, sums);
  const float here = luminance(record.irradiance);
  record.ready = true;
  if (std::fabs(here - record.measured) <= kSameLight * record.measured) return;
  record.radius = find_radius(index, sums);
  record.measured = here;
}

/// As far as the gradient tells the truth, to a tolerance, in four directions: it ends where light bends, as before
/// corners, to which a slope at the record alone is blind. Shadows are left aside.
float Cache::find_radius(size_t index, Sums& sums) const {
  const Record& record = records_[index];
  const float here = luminance(record.irradiance), least = spacing_.least_pixels * record.footprint;
  if (!(here > 0.0f)) return record.reach;
  const uint32_t size = lights_.padded();
  const bool two_sided = lights_.two_sided;
  sums.front.assign(size, 0.0f), sums.back.assign(size, 0.0f);
  for (uint32_t w = 0; w < visibility_.words(); ++w)
    for (uint64_t bits = visibility_.seen(index)[w]; bits; bits &= bits - 1) {
      const uint32_t k = w * 64 + uint32_t(std::countr_zero(bits));
      const Rgb share = visibility_.coloured() ? visibility_.get(index, k) : Rgb(1.0f);
      sums.front[k] = luminance(share * lights_.lights[k].front);
      if (two_sided) sums.back[k] = luminance(share * lights_.lights[k].back);
    }
  const auto light_there = [&](const Vec3& offset) {
    geometry_terms(lights_, record.position + offset, record.normal, bound_, sums.terms.data());
    const auto eight = [](const std::vector<float>& from, uint32_t i) {
      Eight values;
      std::memcpy(&values, from.data() + i, sizeof(values));
      return values;
    };
    const Eight none = {};
    Eight sum = none;
    for (uint32_t i = 0; i < size; i += 8) {
      const Eight g = eight(sums.terms, i);
      if (two_sided)
        sum += (g > 0.0f ? g : none) * eight(sums.front, i) - (g < 0.0f ? g : none) * eight(sums.back, i);
      else
        sum += g * eight(sums.front, i);
    }
    return ((sum[0] + sum[1]) + (sum[2] + sum[3])) + ((sum[4] + sum[5]) + (sum[6] + sum[7]));
  };
  const Frame frame(record.normal);
  const float bend = spacing_.bend;
  const auto off_line = [&](float radius) {
    float worst = 0.0f;
    for (const Vec3& way : {frame.t, -frame.t, frame.b, -frame.b}) {
      if (worst >= 4.0f * bend) break;  // enough to halve the radius
      const Rgb line = record.irradiance + radius * (record.by_step * way);
      const float told = luminance(bounded_light(line, record.irradiance));
      worst = std::max(worst, std::fabs(light_there(radius * way) - told) / here);
    }
    return worst;
  };
  if (record.measured >= 0.0f) {  // other light, mostly as bent as it was
    const float off = off_line(record.radius);
    if (off > bend ? record.radius <= least : off > 0.25f * bend || record.radius >= record.reach) return record.radius;
  }
  float radius = record.reach;
  for (int round = 0; round < kRadiusRounds && radius > least; ++round) {
    const float off = off_line(radius);
    if (off <= bend) break;
    radius *= std::clamp(std::sqrt(bend / off), 0.5f, 0.8f);  // it is of second order
  }
  return std::min(std::max(radius, least), record.reach);
}

Verification Cache::verify(const CommittedScene& scene, Work& work) const {
  Verification result;
  std::mutex mutex;
  const WalkScene walked = walk(scene);
  parallel_blocks(records_.size(), kRecordBlock, work.threads, [&](size_t begin, size_t end) {
    std::vector<float> terms(lights_.padded());
    RayCounts counts;
    for (size_t i = begin; i < end; ++i) {
      const Record& stored = records_[i];
      if (!stored.ready) continue;
      Record fresh = stored;
      if (!locate(scene.scene, fresh)) continue;
      geometry_terms(lights_, fresh.position, fresh.normal, bound_, terms.data());
      const Vec3 from = fresh.position + fresh.error * fresh.face_normal;
      Rgb sum(0.0f);
      for (uint32_t k = 0; k < lights_.count; ++k) {
        const float g = terms[k];
        const Rgb& light = g > 0.0f ? lights_.lights[k].front : lights_.lights[k].back;
        if (g == 0.0f || is_black(light) || !can_see(fresh.position, fresh.face_normal, lights_.lights[k], g > 0.0f))
          continue;
        Rgb seen = visibility(walked, visibility_ray(from, lights_.lights[k]), counts);
        if (visibility_.coloured()) seen = unpack_transmittance(pack_transmittance(seen));
        sum += std::fabs(g) * light * seen;
      }
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

size_t Cache::record_bytes() const { return sizeof(Record) + 5 + visibility_.row_bytes(); }

size_t Cache::bytes() const {
  return records_.capacity() * sizeof(Record) + visibility_.bytes() + octree_.bytes() + 5 * records_.capacity();
}

}  // namespace afterglow::instant_cache
