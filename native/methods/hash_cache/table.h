// SPDX-License-Identifier: GPL-3.0-or-later
// The cells that were needed so far, with the mean of the light that arrived in each: a hash table of 20 bytes a cell,
// key included, instead of a map over all cells that hold geometry (Roth et al. 2020 wished for this in their outlook).
// Buckets of four cells fill a line of memory each, so that a look-up waits for memory once; the half of a key that
// look-ups compare stands in the cell, the other half, which growing and saving need, stands apart.
// It is cut into 256 parts by the key's first bits; each part is sorted, reduced and filled by one thread, so that
// neither locks nor luck decide anything: the same samples give the same table on any number of threads.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "base/cancel.h"
#include "methods/hash_cache/cells.h"
#include "methods/hash_cache/record.h"

#ifdef __AVX2__
#include <immintrin.h>
#endif

namespace afterglow::hash_cache {

/// What one or more samples bring to a cell.
struct Sample {
  Cell cell;
  Rgb light{0.0f};     // sum over samples of irradiance / pi
  uint32_t count = 1;  // samples
};

/// A cell outside the table, with its whole key.
struct Entry {
  uint64_t key = 0;
  Record record;
};

/// Four cells to a line of memory.
struct alignas(64) Bucket {
  Record cells[4];
  /// The cell with this tag, or null.
  const Record* find(uint32_t tag) const {
#ifdef __AVX2__
    const __m256i wanted = _mm256_set1_epi32(int(tag));
    const auto equal = [&](int first) {
      const __m256i two = _mm256_load_si256(reinterpret_cast<const __m256i*>(cells + first));
      return uint32_t(_mm256_movemask_ps(_mm256_castsi256_ps(_mm256_cmpeq_epi32(two, wanted))));
    };
    const uint32_t found = (equal(0) & 0x11u) | (equal(2) & 0x11u) << 8;
    return found ? cells + (std::countr_zero(found) >> 2) : nullptr;
#else
    for (const Record& r : cells)
      if (r.tag == tag) return &r;
    return nullptr;
#endif
  }
  bool full() const { return cells[3].tag != 0; }  // cells are taken in order
};

struct TableCounts {
  uint64_t added = 0, evicted = 0, refused = 0;
};

class Table {
 public:
  static constexpr uint32_t kParts = 256;
  using Mend = std::function<void(Record&, const Cell&)>;
  Table() = default;
  Table(const Table&) = delete;
  Table& operator=(const Table&) = delete;
  void clear();
  /// bytes() never exceeds this; cells beyond push out those that got no samples for the longest time, at once where
  /// there are more already. Where all are fresh, new ones are refused.
  void set_limit(size_t bytes, uint32_t stamp);
  /// Once a pass: cells of one part after the other that are older than Record::kOld get that age.
  void keep_ages(uint32_t stamp);
  /// Adds the samples to their cells, those of every level sums of the level's below, up to kTopLevel. Returns the
  /// number of cells that were touched.
  /// `mend`, if any, is shown each cell that is there already before it takes its samples.
  uint64_t add(std::vector<Sample> samples, uint32_t stamp, unsigned threads, StopToken stop, const Mend& mend = {});
  /// Cells without a sample for more than `age` passes go.
  void drop_older(uint32_t age, uint32_t stamp);
  const Record* find(const Cell& cell) const { return find(key_of(cell)); }
  /// Asks for the memory in which find(key) will look: for many keys at once, before the first is looked up.
  void prefetch(uint64_t key) const {
    const Part& part = parts_[key >> 56];
    __builtin_prefetch(part.buckets + part.home(key));
  }
  /// The cell, or null. Of n look-ups for cells that are not there, about n / 10^9 find another cell: halves of keys
  /// are compared, of four cells or a few more.
  const Record* find(uint64_t key) const {
    const Part& part = parts_[key >> 56];
    for (uint32_t i = part.home(key);; i = part.next(i)) {
      const Bucket& bucket = part.buckets[i];
      if (const Record* found = bucket.find(uint32_t(key))) return found;
      if (!bucket.full()) return nullptr;
    }
  }
  /// The line of memory where find(key) begins.
  const Bucket& home(uint64_t key) const { return parts_[key >> 56].buckets[parts_[key >> 56].home(key)]; }
  size_t size() const;
  size_t bytes() const;
  const TableCounts& counts() const { return counts_; }
  /// All cells in the order of their keys.
  std::vector<Entry> sorted() const;
  /// Replaces what the table holds; keys must differ.
  void restore(std::span<const Entry> entries);

 private:
  /// Where it begins is all that look-ups ask for; an empty part has one empty bucket, which is shared.
  struct Part {
    const Bucket* buckets = &kNothing;
    uint32_t count = 1;  // of buckets
    uint32_t home(uint64_t key) const { return uint32_t(uint64_t(uint32_t(key >> 24)) * count >> 32); }
    uint32_t next(uint32_t i) const { return i + 1 == count ? 0 : i + 1; }
  };
  struct Store {
    std::vector<Bucket> buckets;
    std::vector<uint32_t> rest;  // of the keys
    size_t used = 0;
  };
  /// A cell's place, or the empty one that it would take.
  Record& slot(uint32_t part, uint64_t key);
  void put(uint32_t part, const Entry&);
  void resize(uint32_t part, size_t buckets);
  void reserve(uint32_t part, size_t more, size_t most);  // most: buckets, unless more are needed
  void keep_younger(uint32_t part, uint32_t age, uint32_t stamp, size_t most);
  template <class Function>
  void each(uint32_t part, const Function& function) const;
  struct Reduced {
    std::vector<Sample> cells;
    TableCounts counts;
  };
  void reduce(std::span<const Sample> samples, std::span<const std::pair<uint64_t, uint32_t>> order, uint32_t stamp,
              uint32_t salt, const Mend& mend, uint32_t part, Reduced& out);
  void make_room(uint32_t part, size_t fresh, uint32_t stamp, TableCounts&);
  size_t most_buckets() const {
    return std::max<size_t>(1, (limit_ - std::min(limit_, sizeof(Table))) / (kParts * kBucketBytes));
  }
  size_t most_cells() const { return (most_buckets() - 1) * kFullest / kOf; }  // one bucket more: see reserve()

  static constexpr size_t kFullest = 5, kOf = 2;  // cells that a bucket holds on average, at most: 5/2
  static constexpr size_t kBucketBytes = sizeof(Bucket) + 4 * sizeof(uint32_t);
  static constexpr Bucket kNothing{};
  std::array<Part, kParts> parts_;
  std::array<Store, kParts> stores_;
  uint32_t last_stamp_ = 0, adds_ = 0;  // calls of add with the same stamp
  size_t limit_ = size_t(1) << 40;      // none
  TableCounts counts_;
};

}  // namespace afterglow::hash_cache
