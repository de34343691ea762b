// SPDX-License-Identifier: GPL-3.0-or-later
// Which cells hold geometry, on every level (Roth et al. 2020, 3.1, figures 1 and 2; table 1). The finest level is
// marked layer by layer, all triangles that reach into a layer being cut to it: memory for one layer a thread instead
// of a field of bits for the whole cube, which at 4096³ would take 8 GiB. Coarser levels follow from finer ones. Where
// a level has more blocks than a key can tell apart, space is split among several maps, each of a slab of layers.
#pragma once

#include <cstdlib>
#include <memory>
#include <vector>

#include "base/cancel.h"
#include "methods/hash_cache/both_sides.h"
#include "methods/hash_cache/cuckoo.h"
#include "scene/scene.h"

namespace afterglow::hash_cache {

/// One level: 2^n cells each way; blocks of 4 × 4 × 2 cells, in layers of two cells.
class OccupiedLevel {
 public:
  uint64_t cells() const { return cells_; }
  size_t blocks() const { return blocks_; }
  size_t maps() const { return maps_.size(); }
  size_t map_bytes() const {
    size_t sum = 0;
    for (const CuckooMap& map : maps_) sum += map.bytes();
    return sum;
  }
  size_t data_bytes() const { return data_ ? cells_ * sizeof(BothSidesRecord) : 0; }
  BothSidesRecord& data(uint32_t index) { return data_.get()[index]; }
  const BothSidesRecord& data(uint32_t index) const { return data_.get()[index]; }
  /// Index of the cell's data, or kNone: constant time.
  uint32_t index(uint32_t x, uint32_t y, uint32_t z) const {
    const uint32_t layer = z >> 1, map = layer >> layers_shift_;
    if (map >= maps_.size()) return kNone;
    const BlockCells* block = maps_[map].find(key(x >> 2, y >> 2, layer & ((1u << layers_shift_) - 1u)));
    const uint32_t bit = (x & 3u) + 4u * (y & 3u) + 16u * (z & 1u);
    if (!block || !(block->bits >> bit & 1u)) return kNone;
    return block->first + uint32_t(std::popcount(block->bits & ((1u << bit) - 1u)));
  }

 private:
  friend class Occupied;
  uint32_t key(uint32_t bx, uint32_t by, uint32_t layer) const { return (layer * width_ + by) * width_ + bx; }
  uint32_t width_ = 1;         // blocks each way
  uint32_t layers_shift_ = 0;  // of a map, as a power of two
  uint64_t cells_ = 0;
  size_t blocks_ = 0;
  std::vector<CuckooMap> maps_;  // from the lowest layers up
  struct Free {
    void operator()(void* memory) const { std::free(memory); }
  };
  std::unique_ptr<BothSidesRecord[], Free> data_;  // zero pages of the system until they are used
};

class Occupied {
 public:
  static constexpr int kFinest = 14;  // 16384³, 64 maps; up to 4096³ a level is one map
  /// levels: 0 (one cell) to `levels` (2^levels each way), over a cube round the scene.
  void build(const Scene&, int levels, unsigned threads, StopToken stop = {});
  const std::vector<OccupiedLevel>& levels() const { return levels_; }
  uint32_t index(const Vec3& position, int level) const;
  /// A sample of light arrives at a surface: in its cell of every level.
  void add(const Vec3& position, const Vec3& normal, const Rgb& light, uint32_t frame, uint32_t changed, uint32_t salt);
  double seconds_mark() const { return seconds_mark_; }
  double seconds_maps() const { return seconds_maps_; }
  /// Most memory while building, with what had been finished then.
  size_t peak_bytes() const { return peak_bytes_; }

 private:
  Vec3 corner_{0.0f};
  float edge_ = 1.0f;  // of the cube
  std::vector<OccupiedLevel> levels_;
  double seconds_mark_ = 0.0, seconds_maps_ = 0.0;
  size_t peak_bytes_ = 0;
};

}  // namespace afterglow::hash_cache
