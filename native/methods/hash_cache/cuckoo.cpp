// SPDX-License-Identifier: GPL-3.0-or-later
// Building a cuckoo map: see cuckoo.h.
#include "methods/hash_cache/cuckoo.h"

#include <cmath>
#include <utility>

namespace afterglow::hash_cache {

namespace {

constexpr uint32_t kMostMoves = 2000;  // of one insertion, before other hash functions are tried

}  // namespace

/// Whoever finds both buckets full pushes one entry out of either into that entry's other bucket, and so on.
bool CuckooMap::insert(Block block, uint32_t& random) {
  uint32_t from = kEmpty;
  for (uint32_t move = 0; move < kMostMoves; ++move) {
    const uint32_t candidates[2] = {bucket(block.key, 0), bucket(block.key, 1)};
    for (const uint32_t b : candidates)
      for (uint32_t i = 0; i < kSlots; ++i)
        if (keys_[b][i] == kEmpty) {
          keys_[b][i] = block.key;
          values_[size_t(b) * kSlots + i] = block;
          return true;
        }
    random = random * 1664525u + 1013904223u;
    const uint32_t into = candidates[0] == from   ? candidates[1]
                          : candidates[1] == from ? candidates[0]
                                                  : candidates[random >> 31];
    const uint32_t slot = random >> 20 & (kSlots - 1);
    std::swap(keys_[into][slot], block.key);
    std::swap(values_[size_t(into) * kSlots + slot], static_cast<BlockCells&>(block));
    from = into;
  }
  return false;
}

void CuckooMap::build(std::span<const Block> blocks, double usage) {
  keys_.clear(), values_.clear();
  attempts_ = 0;
  if (blocks.empty()) return;
  std::array<uint32_t, kSlots> none;
  none.fill(kEmpty);
  for (bool done = false; !done; usage *= 1.01) {
    const size_t buckets = size_t(std::ceil(usage * double(blocks.size()) / kSlots)) + 1;
    keys_.assign(buckets, none);
    values_.assign(buckets * kSlots, BlockCells{});
    seeds_ = {0x9e3779b9u * (2 * attempts_ + 1), 0x85ebca6bu * (2 * attempts_ + 3)};
    attempts_++;
    uint32_t random = 12345;
    done = true;
    for (const Block& block : blocks)
      if (!(done = insert(block, random))) break;
  }
}

}  // namespace afterglow::hash_cache
