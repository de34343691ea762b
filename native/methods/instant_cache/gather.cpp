// SPDX-License-Identifier: GPL-3.0-or-later
// Answers for many points at once: see point_groups.h. A point's answer is a sum over its records in the order of their
// numbers, so that it does not depend on which other points stood in its group.
#include <algorithm>
#include <atomic>

#include "methods/instant_cache/cache.h"
#include "methods/instant_cache/point_groups.h"

namespace afterglow::instant_cache {

void Cache::answer(std::span<const CachePoint> points, std::span<Answer> answers) const {
  if (records_.empty()) return;  // holes stay holes
  const auto at = [&](uint32_t i) -> const CachePoint& { return points[i]; };
  std::vector<uint32_t> near;
  if (has_fresh_)  // what was answered before may have a nearer record now
    in_groups(
        uint32_t(points.size()), spacing_.most_pixels, at,
        [&](uint32_t i) { return answers[i].weight > 0.0f && fresh_box_.contains(points[i].position); },
        [&](const PointGroup& group) {
          float weights[PointGroup::kMost];
          fresh_.find_near(group.around, 1.0f / group.limit, group.instance, near);
          for (const uint32_t r : near) {
            if (!record_weights(fresh_.entry(r), group, spacing_.angle_scale, weights)) continue;
            for (uint32_t i = 0; i < group.count; ++i)
              if (weights[i] > 0.0f) answers[group.point[i]].weight = 0.0f;
          }
        });
  in_groups(
      uint32_t(points.size()), spacing_.most_pixels, at, [&](uint32_t i) { return !(answers[i].weight > 0.0f); },
      [&](const PointGroup& group) { answer(group, near, answers); });
}

void Cache::answer(const PointGroup& group, std::vector<uint32_t>& near, std::span<Answer> answers) const {
  float weights[PointGroup::kMost];
  float total[PointGroup::kMost] = {}, sum_r[PointGroup::kMost] = {}, sum_g[PointGroup::kMost] = {},
        sum_b[PointGroup::kMost] = {};
  bool waits[PointGroup::kMost] = {};
  octree_.find_near(group.around, 1.0f / group.limit, group.instance, near);
  const uint32_t size = group.padded();
  for (const uint32_t r : near) {
    if (!record_weights(octree_.entry(r), group, spacing_.angle_scale, weights)) continue;
    const Record& record = records_[r];
    if (!record.ready) {
      std::atomic_ref(wanted_[r]).store(1, std::memory_order_relaxed);
      for (uint32_t i = 0; i < size; ++i) waits[i] |= weights[i] > 0.0f;
      continue;
    }
    note_use(r);
    for (uint32_t i = 0; i < size; ++i) total[i] += weights[i];
    add_light(record, group, weights, sum_r, sum_g, sum_b);
  }
  for (uint32_t i = 0; i < group.count; ++i) {
    Answer& answer = answers[group.point[i]];
    answer = {};
    if (!(total[i] > 0.0f) || waits[i]) continue;
    answer.light = Rgb(sum_r[i], sum_g[i], sum_b[i]) / total[i];
    answer.weight = 1.0f;
  }
}

void Cache::find_open(std::span<const CachePoint> points, std::span<const uint32_t> asked, uint8_t* open) const {
  std::vector<uint32_t> near;
  std::fill_n(open, asked.size(), uint8_t(1));
  in_groups(
      uint32_t(asked.size()), spacing_.most_pixels, [&](uint32_t i) -> const CachePoint& { return points[asked[i]]; },
      [](uint32_t) { return true; },
      [&](const PointGroup& group) {
        float weights[PointGroup::kMost];
        octree_.find_near(group.around, 1.0f / group.limit, group.instance, near);
        for (const uint32_t r : near) {
          if (!record_weights(octree_.entry(r), group, spacing_.angle_scale, weights)) continue;
          for (uint32_t i = 0; i < group.count; ++i)
            if (weights[i] > kCoveringWeight) open[group.point[i]] = 0;
        }
      });
}

}  // namespace afterglow::instant_cache
