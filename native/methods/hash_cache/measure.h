// SPDX-License-Identifier: GPL-3.0-or-later
// How fast cells are found, beside bare reads of the same memory: the table of cells that are made when needed, and the
// paper's map over all cells that hold geometry (Roth et al. 2020, 3.1); what becomes of a cell's mean. For the
// benchmark and the tests.
#pragma once

#include <span>
#include <vector>

#include "methods/hash_cache/cells.h"

namespace afterglow::hash_cache {

struct LookupSpeeds {
  double table = 0.0, map = 0.0, reads = 0.0;  // a second, on one thread
  size_t table_bytes = 0, map_bytes = 0;       // with the cells' data
};

/// Of so many cells, six to a block, at random places; each look-up reads the cell's data. Bare reads are of the
/// table's own memory.
LookupSpeeds measure_lookups(uint64_t cells, uint64_t lookups);

std::vector<uint64_t> keys_of(std::span<const Cell>);

struct Updated {
  Rgb light;
  uint32_t count;
};
/// A cell of this light and count (0: a new one) after one update a sum, each of so many samples.
Updated updated_cell(const Rgb& light, uint32_t count, std::span<const Rgb> sums, uint32_t samples);

}  // namespace afterglow::hash_cache
