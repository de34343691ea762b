// SPDX-License-Identifier: GPL-3.0-or-later
// Light for the cells: paths that go on from points which the camera saw, with next-event estimation and multiple
// importance sampling, and leave a sample of irradiance at each of their first diffuse surfaces (Roth et al. 2020, 3.2,
// figure 4). Each of these surfaces gets the light of as many further vertices as the path tracer would give it.
#pragma once

#include <span>
#include <vector>

#include "methods/hash_cache/healing.h"
#include "methods/method.h"
#include "methods/walk_settings.h"
#include "transport/path_walker.h"

namespace afterglow::hash_cache {

struct CachingSettings {
  WalkSettings walk;
  uint32_t store = 1;        // diffuse vertices of a path that keep a sample, the asking point included (l_store)
  uint32_t length = 0;       // further vertices whose light each of them gets (l_len); 0: as the bounce limits say
  float cell_pixels = 1.0f;  // width of the finest cells in pixels
  bool direct = false;       // cells hold the light of the light sources, too
  float long_paths = 1.0f;   // share of the paths that never end in a cell
  bool operator==(const CachingSettings& o) const;
};

/// Surfaces that a path meets later are met by other laws than the camera's: mixed into its cells they would pull the
/// mean towards the part of a cell that faces other surfaces. They fill larger cells of their own.
inline constexpr int kFartherLevels = 2;

/// The cells that paths may end in.
struct Cells {
  const Grid& grid;
  const Table& table;
  const Healing& healing;
  Known find(const Cell& cell) const {
    const Record* r = table.find(cell);
    return r ? healing.known(*r, cell) : Known{};
  }
};

/// Paths from the chosen points, each a function of its point, of `seed` and of what the cells hold: samples in the
/// order of the choice. Most paths end at their second surface, where a cell on the way knows the rest; those that
/// never do are told in `whole`. Nothing, when stopped.
std::vector<Sample> cache_paths(const WalkScene&, const Cells&, const CachingSettings&,
                                std::span<const CachePoint> points, std::span<const uint32_t> chosen, uint32_t seed,
                                const Work&, RayCounts&, std::vector<Probe>& whole);
/// The light that each of these whole paths brings now (no number: none, or not finite). Nothing, when stopped.
std::vector<Rgb> walk_again(const WalkScene&, const Cells&, const CachingSettings&, std::span<const Probe>, const Work&,
                            RayCounts&);

/// A number of its own for every question of an image.
inline uint32_t hash_of(const CachePoint& p, uint32_t seed) {
  return hash(uint32_t(p.x) | uint32_t(p.y) << 16, uint32_t(p.layer) * 2u + p.translucent, seed);
}

}  // namespace afterglow::hash_cache
