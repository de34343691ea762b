// SPDX-License-Identifier: GPL-3.0-or-later
// How fast cells are found, beside bare reads of the same memory: the table of cells that are made when needed, and the
// paper's map over all cells that hold geometry (Roth et al. 2020, 3.1). For the benchmark.
#pragma once

#include <cstddef>
#include <cstdint>

namespace afterglow::hash_cache {

struct LookupSpeeds {
  double table = 0.0, map = 0.0, reads = 0.0;  // a second, on one thread
  size_t table_bytes = 0, map_bytes = 0;       // with the cells' data
};

/// Of so many cells, six to a block, at random places; each look-up reads the cell's data.
LookupSpeeds measure_lookups(uint64_t cells, uint64_t lookups);

}  // namespace afterglow::hash_cache
