// SPDX-License-Identifier: GPL-3.0-or-later
// Timed look-ups in random order: see measure.h.
#include "methods/hash_cache/measure.h"

#include <algorithm>
#include <chrono>
#include <vector>

#include "methods/hash_cache/cuckoo.h"
#include "methods/hash_cache/table.h"

namespace afterglow::hash_cache {

namespace {

constexpr uint32_t kInBlock = 6;
constexpr size_t kGroup = 32;  // look-ups whose memory is asked for together, as in rendering
constexpr int kRounds = 3;     // the fastest counts
volatile uint32_t sink;        // what was read has been read

/// `look` does kGroup look-ups, from a number on.
template <class Look>
double speed(uint64_t lookups, const Look& look) {
  double best = 0.0;
  for (int round = 0; round < kRounds; ++round) {
    const auto begun = std::chrono::steady_clock::now();
    uint32_t sum = 0;
    for (uint64_t i = 0; i + kGroup <= lookups; i += kGroup) sum += look(i + 1);
    sink = sum;
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
    best = std::max(best, double(lookups) / std::max(seconds, 1e-9));
  }
  return best;
}

/// The cell with this number: six neighbours in each block of 4 × 4 × 2, blocks along a long strip.
Cell cell_of(uint64_t number) {
  const uint64_t block = number / kInBlock, in = number % kInBlock;
  return {int32_t(4 * (block & 0x3ff) + (in & 3)), int32_t(4 * (block >> 10 & 0x3ff) + (in >> 2)),
          int32_t(2 * (block >> 20)), 0, 0};
}

}  // namespace

LookupSpeeds measure_lookups(uint64_t cells, uint64_t lookups) {
  LookupSpeeds out;
  cells = std::max<uint64_t>(cells / kInBlock, 1) * kInBlock;
  const auto pick = [&](uint64_t random) { return uint64_t((unsigned __int128)random * cells >> 64); };
  {
    std::vector<Entry> entries(cells);
    for (uint64_t i = 0; i < cells; ++i) {
      entries[i].key = key_of(cell_of(i));
      entries[i].record.tag = uint32_t(entries[i].key), entries[i].record.word = uint32_t(i);
    }
    Table table;
    table.restore(entries);
    entries = {};
    out.reads = speed(lookups, [&](uint64_t first) {
      uint32_t sum = 0;
      for (size_t k = 0; k < kGroup; ++k) sum += table.home(mix(first + k)).cells[0].word;
      return sum;
    });
    out.table_bytes = table.bytes();
    out.table = speed(lookups, [&](uint64_t first) {
      uint64_t keys[kGroup];
      uint32_t sum = 0;
      for (size_t k = 0; k < kGroup; ++k) table.prefetch(keys[k] = key_of(cell_of(pick(mix(first + k)))));
      for (const uint64_t key : keys) sum += table.find(key)->word;
      return sum;
    });
  }
  std::vector<Block> blocks(cells / kInBlock);
  for (uint64_t i = 0; i < blocks.size(); ++i) blocks[i] = {{0x3fu, uint32_t(i * kInBlock)}, uint32_t(i)};
  CuckooMap map;
  map.build(blocks);
  std::vector<Record> data(cells);
  out.map_bytes = map.bytes() + data.size() * sizeof(Record);
  out.map = speed(lookups, [&](uint64_t first) {
    uint64_t numbers[kGroup];
    const Record* found[kGroup];
    uint32_t sum = 0;
    for (size_t k = 0; k < kGroup; ++k) map.prefetch(uint32_t((numbers[k] = pick(mix(first + k))) / kInBlock));
    for (size_t k = 0; k < kGroup; ++k) {
      const uint32_t bit = uint32_t(numbers[k] % kInBlock);
      const BlockCells* block = map.find(uint32_t(numbers[k] / kInBlock));
      found[k] = &data[block->first + uint32_t(std::popcount(block->bits & ((1u << bit) - 1u)))];
      __builtin_prefetch(found[k]);
    }
    for (const Record* r : found) sum += r->word;
    return sum;
  });
  return out;
}

std::vector<uint64_t> keys_of(std::span<const Cell> cells) {
  std::vector<uint64_t> keys;
  for (const Cell& c : cells) keys.push_back(key_of(c));
  return keys;
}

Updated updated_cell(const Rgb& light, uint32_t count, std::span<const Rgb> sums, uint32_t samples) {
  Record r;
  r.tag = 1;
  const double mean[3] = {light.x, light.y, light.z};
  if (count) r.set(mean, std::min(count, Record::kMostSamples), 0, mix(count));
  uint32_t salt = 0;
  for (const Rgb& sum : sums) r.add(sum, samples, 0, salt++);
  return {r.light(), r.count()};
}

}  // namespace afterglow::hash_cache
