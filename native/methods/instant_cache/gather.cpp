// SPDX-License-Identifier: GPL-3.0-or-later
// Answers for many points at once: see point_groups.h. A point's answer is a sum over its records in the order of their
// numbers, so that it does not depend on which other points stood in its group.
#include <algorithm>
#include <atomic>

#include "methods/instant_cache/cache.h"
#include "methods/instant_cache/point_groups.h"

namespace afterglow::instant_cache {

namespace {

constexpr uint32_t kLanes = PointGroup::kLanes;

/// Calls visit(row, RowOfPoints) for each row of the group, of those `among`, in which the record counts anywhere.
template <class Visit>
void in_rows(const Entry& e, const PointGroup& group, uint32_t among, float angle_scale, const Visit& visit) {
  for (uint32_t rows = rows_near(e, group) & among; rows; rows &= rows - 1) {
    const uint32_t row = uint32_t(std::countr_zero(rows));
    const RowOfPoints found = compare(e, group, row, angle_scale);
    if (any_above(found.weight, Lanes{})) visit(row, found);
  }
}

void add(float* to, const Lanes& by) {
  const Lanes sum = load_eight(to) + by;
  std::memcpy(to, &sum, sizeof(sum));
}

}  // namespace

void Cache::answer(std::span<const CachePoint> points, std::span<Answer> answers) const {
  if (records_.empty()) return;  // holes stay holes
  const auto at = [&](uint32_t i) -> const CachePoint& { return points[i]; };
  std::vector<uint32_t> near;
  if (has_fresh_)  // what was answered before may have a nearer record now
    in_groups(
        uint32_t(points.size()), spacing_.most_pixels, at,
        [&](uint32_t i) { return answers[i].weight > 0.0f && fresh_box_.contains(points[i].position); },
        [&](const PointGroup& group) {
          fresh_.find_near(group.around, 1.0f / group.limit, group.instance, near);
          for (const uint32_t r : near)
            in_rows(fresh_.entry(r), group, group.all_rows(), spacing_.angle_scale,
                    [&](uint32_t row, const RowOfPoints& found) {
                      for (uint32_t l = 0; l < kLanes; ++l)
                        if (found.weight[l] > 0.0f) answers[group.point[row * kLanes + l]].weight = 0.0f;
                    });
        });
  in_groups(
      uint32_t(points.size()), spacing_.most_pixels, at, [&](uint32_t i) { return !(answers[i].weight > 0.0f); },
      [&](const PointGroup& group) { answer(group, near, answers); });
}

void Cache::answer(const PointGroup& group, std::vector<uint32_t>& near, std::span<Answer> answers) const {
  float total[PointGroup::kMost], sums[3][PointGroup::kMost];
  for (float* column : {total, sums[0], sums[1], sums[2]}) std::fill_n(column, group.rows() * kLanes, 0.0f);
  const uint32_t all = group.all_rows();
  bool waits[PointGroup::kMost] = {};
  octree_.find_near(group.around, 1.0f / group.limit, group.instance, near);
  for (const uint32_t r : near) {
    const Record& record = records_[r];
    bool counts = false;
    in_rows(octree_.entry(r), group, all, spacing_.angle_scale, [&](uint32_t row, const RowOfPoints& found) {
      const uint32_t first = row * kLanes;
      counts = true;
      add(total + first, found.weight);
      if (!record.ready) {
        for (uint32_t l = 0; l < kLanes; ++l) waits[first + l] |= found.weight[l] > 0.0f;
        return;
      }
      for (int c = 0; c < 3; ++c) add(sums[c] + first, found.weight * light_at(record, c, group, row, found));
    });
    if (!counts) continue;
    if (record.ready)
      note_use(r);
    else
      std::atomic_ref(wanted_[r]).store(1, std::memory_order_relaxed);
  }
  for (uint32_t i = 0; i < group.count; ++i) {
    Answer& answer = answers[group.point[i]];
    answer = {};
    if (!(total[i] > 0.0f) || waits[i]) continue;
    answer.light = Rgb(sums[0][i], sums[1][i], sums[2][i]) / total[i];
    answer.weight = 1.0f;
  }
}

/// A group is done with as soon as all of its points are covered.
void Cache::find_open(std::span<const CachePoint> points, std::span<const uint32_t> asked, uint8_t* open) const {
  in_groups(
      uint32_t(asked.size()), spacing_.most_pixels, [&](uint32_t i) -> const CachePoint& { return points[asked[i]]; },
      [](uint32_t) { return true; },
      [&](const PointGroup& group) {
        float most[PointGroup::kMost];
        std::fill_n(most, group.rows() * kLanes, 0.0f);
        std::fill_n(most + group.count, group.rows() * kLanes - group.count, 1.0f);  // nobody there
        uint32_t left = group.all_rows();
        octree_.visit_near(group.around, 1.0f / group.limit, [&](uint32_t r) {
          const Entry& e = octree_.entry(r);
          if (e.instance != group.instance) return true;
          in_rows(e, group, left, spacing_.angle_scale, [&](uint32_t row, const RowOfPoints& found) {
            const Lanes best = larger(load_eight(most + row * kLanes), found.weight);
            std::memcpy(most + row * kLanes, &best, sizeof(best));
            if (all_above(best, Lanes{} + kCoveringWeight)) left &= ~(1u << row);
          });
          return left != 0;
        });
        for (uint32_t i = 0; i < group.count; ++i) open[group.point[i]] = !(most[i] > kCoveringWeight);
      });
}

}  // namespace afterglow::instant_cache
