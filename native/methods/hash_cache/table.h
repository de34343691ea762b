// SPDX-License-Identifier: GPL-3.0-or-later
// The cells that were needed so far, with the mean of the light that arrived in each: a hash table of 24 bytes a cell,
// key included, instead of a map over all cells that hold geometry (Roth et al. 2020 wished for this in their outlook).
// It is cut into 256 parts by the key's first bits; each part is sorted, reduced and filled by one thread, so that
// neither locks nor luck decide anything: the same samples give the same table on any number of threads.
#pragma once

#include <array>
#include <memory>
#include <span>
#include <vector>

#include "base/cancel.h"
#include "methods/hash_cache/cells.h"

namespace afterglow::hash_cache {

/// What one or more samples bring to a cell.
struct Sample {
  Cell cell;
  Rgb light{0.0f};     // sum over samples of irradiance / pi
  uint32_t count = 1;  // samples
};

/// Light is kept in 32-bit floats: it overflows at 3e38 instead of at a half's 65504 (samples above kMostLight are
/// dropped before). The count stops at 2^20 - 1; from then on the mean forgets what is older than a million samples,
/// and each sample still moves it by sixteen units in its last place.
struct Record {
  static constexpr uint32_t kMostSamples = (1u << 20) - 1, kStamps = 1u << 12;
  uint64_t key = 0;  // 0: empty
  Rgb light{0.0f};   // mean of irradiance / pi
  uint32_t word = 0;
  uint32_t count() const { return word >> 12; }
  uint32_t stamp() const { return word & (kStamps - 1); }  // when samples last came, modulo kStamps
  void add(const Rgb& sum, uint32_t n, uint32_t stamp);
};
static_assert(sizeof(Record) == 24);

struct TableCounts {
  uint64_t added = 0, evicted = 0, refused = 0;
};

class Table {
 public:
  static constexpr uint32_t kParts = 256;
  void clear();
  /// No cell counts more than `most` samples from here on, so that new ones weigh more.
  void forget(uint32_t most);
  /// Cells beyond this many bytes push out those that got no samples for the longest time; then new ones are refused.
  void set_limit(size_t bytes) { limit_ = bytes; }
  /// Adds the samples to their cells, those of every level sums of the level's below, up to kTopLevel. Returns the
  /// number of cells that were touched.
  uint64_t add(std::vector<Sample> samples, uint32_t stamp, unsigned threads, StopToken stop);
  const Record* find(const Cell& cell) const { return find(key_of(cell)); }
  /// Asks for the memory in which find(key) will look: for many keys at once, before the first is looked up.
  void prefetch(uint64_t key) const {
    const Part& part = parts_[key >> 56];
    if (part.slots.empty()) return;
    const char* slot = reinterpret_cast<const char*>(part.slots.data() + part.home(key));
    __builtin_prefetch(slot);
    __builtin_prefetch(slot + 64);
  }
  const Record* find(uint64_t key) const {
    const Part& part = parts_[key >> 56];
    if (part.slots.empty()) return nullptr;
    for (size_t i = part.home(key);; i = i + 1 == part.slots.size() ? 0 : i + 1) {
      const Record& r = part.slots[i];
      if (r.key == key) return &r;
      if (!r.key) return nullptr;
    }
  }
  size_t size() const;
  size_t bytes() const;
  const TableCounts& counts() const { return counts_; }
  /// All records in the order of their keys.
  std::vector<Record> sorted() const;
  /// Replaces what the table holds; keys must differ.
  void restore(std::span<const Record> records);

 private:
  struct Part {
    std::vector<Record> slots;
    size_t used = 0;
    /// Keys spread evenly: their middle bits say where in the part.
    size_t home(uint64_t key) const { return size_t(uint64_t(uint32_t(key >> 24)) * slots.size() >> 32); }
    Record& slot(uint64_t key);
    void resize(size_t slots);
    void reserve(size_t more, size_t most);  // most: slots, unless more are needed
    void drop_older(uint32_t age, uint32_t stamp);
  };
  struct Reduced {
    std::vector<Sample> cells;
    TableCounts counts;
  };
  void reduce(std::span<const Sample> samples, std::span<const std::pair<uint64_t, uint32_t>> order, uint32_t stamp,
              Part& part, Reduced& out) const;
  size_t part_limit() const { return limit_ / (kParts * sizeof(Record)); }
  void make_room(Part&, size_t fresh, uint32_t stamp, TableCounts&) const;

  std::array<Part, kParts> parts_;
  size_t limit_ = size_t(1) << 30;
  TableCounts counts_;
};

}  // namespace afterglow::hash_cache
