// SPDX-License-Identifier: GPL-3.0-or-later
// What cells still know after an edit. A few of the paths that filled them are kept, spread evenly over what was seen,
// and walked again with the same random numbers when the scene was edited (Schied, Peters and Dachsbacher 2018,
// "Gradient Estimation for Real-Time Adaptive Temporal Filtering"). Where all of them bring the same light as before,
// cells keep theirs; where light became so many times brighter, so does that of the cells (a ratio estimator, Cochran
// 1977, chapter 6); and the larger the share of light that this does not explain, the fewer samples old light counts
// for.
#pragma once

#include <array>
#include <deque>
#include <span>
#include <unordered_map>
#include <vector>

#include "methods/hash_cache/table.h"
#include "methods/method.h"

namespace afterglow::hash_cache {

/// A path that never ended in a cell: its light depends on the scene alone.
struct Probe {
  CachePoint point;
  uint32_t seed = 0;
  int level = 0;  // of the point's cell
  Rgb light{0.0f};
};

/// What the probes of a region tell: by how much light changed there, and which share of it that does not explain.
struct Change {
  Rgb ratio{1.0f};
  float unexplained = 1.0f;  // within [0, 1]
  Rgb spread{0.5f};          // squared residuals over squared light, of single paths
  float doubt = 1.0f;        // the unexplained share's expected square, its own error included
};
/// How many of its samples old light counts for: its noise and the doubt of every edit since add up. 0: none.
uint32_t samples_worth(uint32_t samples, float doubt);

/// A cell's light and samples, as far as they hold in the scene as it is.
struct Known {
  Rgb light{0.0f};
  uint32_t count = 0;
  uint32_t age = 0;  // passes since its last sample
  explicit operator bool() const { return count != 0; }
};

class Healing {
 public:
  static constexpr size_t kProbes = 4096;
  static constexpr int kRegionLevels = 1;  // regions are twice as wide as cells
  static constexpr size_t kEdits = 64;
  static constexpr uint32_t kOldest = 1792;  // passes that an edit is known for
  static_assert(kOldest < Record::kOld);     // else cells of before it could pass for younger ones

  void clear();
  /// The newest paths take the places of older ones of the same region.
  void keep(const Grid&, std::span<const Probe>);
  /// The probes, those without light included (seed 0).
  std::span<const Probe> probes() const { return probes_; }
  size_t probe_count() const { return used_; }
  /// The next so many of them, all in turn: for walking a few again in every frame.
  std::vector<Probe> next_probes(size_t most);
  /// Of a saved cache, into an empty place.
  void restore(uint32_t place, const Probe&);
  /// The scene was edited before pass `stamp`: `now` is the probes' light since, one each. Cells of `forgotten`
  /// objects, sorted, know nothing any more. No cell counts for more than `most` samples.
  void edit(const Grid&, std::span<const Rgb> now, std::vector<uint32_t> forgotten, uint32_t stamp, uint32_t most);
  void begin_pass(uint32_t stamp) { stamp_ = stamp; }
  bool active() const { return !edits_.empty(); }
  /// The oldest edit is too long ago, or there are too many: cells without a sample since then must go, see retire().
  bool due() const;
  /// Forgets the oldest edit; answers with the age, in passes, above which cells have not seen it.
  uint32_t retire();
  bool stale(const Record& r) const { return active() && r.age(stamp_) > stamp_ - edits_.back().stamp; }
  Known known(const Record& r, const Cell& cell) const {
    return stale(r) ? mended(r, cell) : Known{r.light(), r.count(), r.age(stamp_)};
  }
  /// Before new samples join a cell.
  void mend(Record& r, const Cell& cell) const {
    if (!stale(r)) return;
    const Known k = mended(r, cell);
    const double light[3] = {double(k.light.x), double(k.light.y), double(k.light.z)};
    r.set(light, k.count, r.stamp(), mix(uint64_t(r.tag) << 32 | stamp_));
  }
  size_t bytes() const;
  /// Of the last edit, over all that was seen.
  const Change& whole() const { return whole_; }

 private:
  struct Edit {
    uint32_t stamp = 0, most = 0;
    std::vector<uint32_t> forgotten;
    std::unordered_map<uint64_t, Change> regions;
    Change whole;
  };
  Known mended(const Record&, const Cell&) const;
  static Change change_at(const Edit&, const Cell&);

  std::vector<Probe> probes_;
  size_t used_ = 0, next_ = 0;
  std::deque<Edit> edits_;
  Change whole_;
  uint32_t stamp_ = 0;
};

}  // namespace afterglow::hash_cache
