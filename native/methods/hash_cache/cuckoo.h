// SPDX-License-Identifier: GPL-3.0-or-later
// The map of one level of the linkless octree (Roth et al. 2020, 3.1; Choi et al. 2009): cuckoo hashing (Pagh and
// Rodler 2004) with two buckets of four slots a key, so that a look-up reads two lines of memory at most and 91 % of
// the slots can be taken. A key is a block of 4 × 4 × 2 cells, its value the bits of those that hold geometry and the
// index of the first one's data; the others' follow by counting bits. Because a block's key is kept, no cell is ever
// taken for another, and for nine cells a block it all costs 1.2 bytes a cell instead of 4.4 without keys.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <span>
#include <vector>

namespace afterglow::hash_cache {

struct BlockCells {
  uint32_t bits = 0, first = 0;
};
struct Block : BlockCells {
  uint32_t key = 0;
};

class CuckooMap {
 public:
  static constexpr uint32_t kSlots = 4;
  /// Keys must differ; none may be 0xffffffff. Slots: `usage` times the keys, and 1 % more after each failure.
  void build(std::span<const Block> blocks, double usage = 1.1);
  /// Asks for the memory in which find(key) will look first.
  void prefetch(uint32_t key) const {
    if (keys_.empty()) return;
    const uint32_t b = bucket(key, 0);
    __builtin_prefetch(&keys_[b]);
    __builtin_prefetch(&values_[size_t(b) * kSlots]);
  }
  const BlockCells* find(uint32_t key) const {
    if (keys_.empty()) return nullptr;
    for (uint32_t k = 0; k < 2; ++k) {
      const uint32_t b = bucket(key, k);
      for (uint32_t i = 0; i < kSlots; ++i)
        if (keys_[b][i] == key) return &values_[size_t(b) * kSlots + i];
    }
    return nullptr;
  }
  size_t bytes() const { return keys_.size() * sizeof(keys_[0]) + values_.size() * sizeof(BlockCells); }
  uint32_t attempts() const { return attempts_; }

 private:
  static constexpr uint32_t kEmpty = 0xffffffffu;
  uint32_t bucket(uint32_t key, uint32_t which) const {
    uint32_t x = key ^ seeds_[which];
    x = (x ^ (x >> 16)) * 0x21f0aaadu;
    x = (x ^ (x >> 15)) * 0xd35a2d97u;
    x ^= x >> 15;
    return uint32_t(uint64_t(x) * keys_.size() >> 32);
  }
  bool insert(Block block, uint32_t& random);

  std::vector<std::array<uint32_t, kSlots>> keys_;
  std::vector<BlockCells> values_;
  std::array<uint32_t, 2> seeds_{};
  uint32_t attempts_ = 0;
};

}  // namespace afterglow::hash_cache
