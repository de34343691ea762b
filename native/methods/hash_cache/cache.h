// SPDX-License-Identifier: GPL-3.0-or-later
// The cells of one scene, filled by paths and asked for light: caching and reconstruction of Roth et al. 2020 (3.2 and
// 3.3), apart from the camera's walk, which is the renderer's.
#pragma once

#include <string>

#include "methods/hash_cache/caching.h"

namespace afterglow::hash_cache {

enum class View { kLight, kLevel, kCount, kAge, kSide };

struct CacheSettings {
  CachingSettings caching;
  float resolution = 1.0f;         // share of the questions that send a path (the caching resolution factor, squared)
  float jitter = 0.0f;             // of look-ups, in cell widths (s_j)
  float trusted = 1.0f;            // samples from which on a cell answers alone
  float enough = 1.0f;             // samples from which on a cell gets paths more rarely
  uint32_t validate = 0;           // kept paths that are walked again in every update without edits
  uint32_t keep = 0;               // samples that old light counts for at most when the scene changes; 0: starts anew
  size_t limit = size_t(1) << 40;  // bytes of the table
};

struct CacheCounts {
  uint64_t paths = 0, samples = 0, cells = 0, rays = 0, shadow_rays = 0, dropped = 0, holes = 0, resets = 0, edits = 0,
           walked_again = 0, validated = 0, unannounced = 0;
  double seconds_paths = 0.0, seconds_table = 0.0, seconds_edits = 0.0, seconds_validate = 0.0;
};

class Cache {
 public:
  void configure(const CacheSettings&);
  /// Whether every question sends a path, whatever the resolution: in the picture that all further ones begin with.
  void let_all_ask(bool all) { all_ask_ = all; }
  /// After edits: some paths are walked again, and cells keep what these say that still holds; or starts anew.
  void update(const CommittedScene&, const SceneChanges&, Work&);
  /// One path from each chosen point, and from each that no cell could answer.
  void fill(const CommittedScene&, std::span<const CachePoint>, Work&);
  void answer(std::span<const CachePoint>, std::span<Answer>) const;
  /// A debug view's colour in place of light: what the finest cell around the point holds.
  Answer show(View, const CachePoint&) const;
  std::vector<char> save(const CommittedScene&) const;
  void load(const CommittedScene&, std::span<const char>);
  const CacheCounts& counts() const { return counts_; }
  const Table& table() const { return table_; }
  /// What the user should know when cells did not fit since configure(); else nothing.
  std::string warning() const;
  const Healing& healing() const { return healing_; }

 private:
  /// One question: which cell, read first at `offset` cells beside the point, and what else is asked then.
  struct LookUp {
    uint32_t owner = 0;
    int level = 0;
    Vec3 offset{0.0f};  // in cells
    Cell cell;
    uint64_t key = 0;
    Known first;
    bool settled = false;
  };
  LookUp first_look(const CachePoint&) const;
  void wider(const CachePoint&, LookUp&) const;
  Answer resolve(const CachePoint&, const LookUp&) const;
  Answer blend(const CachePoint&, const LookUp&) const;
  Known look_up(const CachePoint&, const Vec3& offset, uint32_t owner, int level) const;
  Known find(const Cell& cell, uint64_t key) const {
    const Record* r = table_.find(key);
    return r ? healing_.known(*r, cell) : Known{};
  }
  Known find(const Cell& cell) const { return find(cell, key_of(cell)); }
  WalkScene walk_scene(const CommittedScene&) const;
  void fit();
  void clear(const CommittedScene&);
  void edited(const CommittedScene&, const SceneChanges&, const Work&);
  bool validate(const CommittedScene&, const Work&);
  void next_pass();
  struct Finest {
    int level = 0;
    Known known;
  };
  Finest finest(const CachePoint&) const;
  /// Cells on the way lack what light sources send.
  bool others_answer() const { return !settings_.caching.direct; }
  bool trace(const WalkScene&, std::span<const CachePoint>, std::span<const uint32_t> chosen, Work&);

  CacheSettings settings_;
  bool all_ask_ = false;
  bool stale_ = true;
  Grid grid_;
  Table table_;
  Healing healing_;
  std::vector<uint32_t> forgotten_;  // objects, of edits that no path was walked again for yet
  bool pending_ = false;             // there are such edits
  bool loaded_ = false;              // nobody has seen yet whether the cells fit the scene
  InstanceMask shown_instances_;
  uint32_t seed_ = 0, renders_ = 0, stamp_ = 0, pass_ = 0;
  uint64_t lost_before_ = 0;  // cells that went or were refused before this render
  CacheCounts counts_;
};

}  // namespace afterglow::hash_cache
