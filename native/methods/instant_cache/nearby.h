// SPDX-License-Identifier: GPL-3.0-or-later
// What the short rays of each record met (transport/short_rays.h), and which of it an edit makes unknown: walks whose
// ways an object's old or new bounds touch go anew, ways to lamps and virtual lights that they cross are asked again,
// and where only lights are others than they were, sums are made anew.
#pragma once

#include "methods/instant_cache/moved.h"
#include "methods/instant_cache/records.h"
#include "transport/short_rays.h"

namespace afterglow::instant_cache {

ShortRayPlace short_ray_place(const Record&);

/// What an update found other than it was.
struct LightChanges {
  bool lamps = false;            // what Lights::sample answers
  bool any = false;              // of the virtual lights
  std::vector<uint64_t> moved;   // bits of slots whose visibility is unknown
  std::vector<uint64_t> other;   // bits of slots whose light stands or shines otherwise
  std::vector<uint8_t> grouped;  // for each ShortRays::kGroup slots: whether any of them differs
};

/// Bounds of an object that came, went or looks otherwise. Ways are tested by separating axes.
class Obstacle {
 public:
  /// came, left: what became of light on ways through it. opaque: it was, and if it left, rays that met something else
  /// still do.
  Obstacle(const Bounds&, bool came, bool left, bool opaque);
  /// slack: how far from both ends the ray may really begin and end.
  bool crosses(const Vec3& from, const Vec3& to, float slack) const;
  bool near(const Vec3& center, float radius) const;
  /// Whether a ray from there can meet something else than it did; met: it met anything.
  bool turns(const Vec3& from, const Vec3& to, bool met, float slack) const {
    if (came_ || !opaque_) return crosses(from, to, slack);
    return met && near(to, slack) && crosses(to, to, slack);
  }
  /// Whether it can change what passes on a way that it crosses; now: packed transmittance.
  bool matters(uint16_t now) const { return (came_ && now) || (left_ && now != 0xffff); }

 private:
  Affine to_object_;  // its middle is the origin
  Vec3 half_, stretch_;
  Box world_;
  bool came_, left_, opaque_;
};

/// An edit whose marks are still to be made.
struct NearbyEdit {
  std::vector<Obstacle> obstacles;
  LightChanges lights;
};

class NearbyTable {
 public:
  void reset(uint32_t rays);
  void add_row();
  void keep(const std::vector<uint32_t>& kept);
  /// Everything is unknown.
  void forget(size_t row) { rows_[row].known = false; }
  bool unknown(size_t row) const { return !rows_[row].known || rows_[row].stale; }
  void mark(size_t row, const Record&, const ShortRays&, std::span<const Obstacle>, const LightChanges&,
            const VirtualLightColumns&);
  /// Asks what is unknown. What short rays found.
  Rgb repair(size_t row, const ShortRays&, const Record&, RayCounts&);
  size_t bytes() const;

 private:
  struct Row {
    std::vector<ShortRayStop> stops;  // in the order of walks
    bool known = false, stale = false;
  };
  void mark_walks(size_t row, const ShortRayPlace&, const ShortRays&, std::span<const Obstacle>, float slack);
  uint64_t* again(size_t row) { return again_.data() + row * words_; }

  uint32_t words_ = 0;
  std::vector<Row> rows_;
  std::vector<uint64_t> again_;  // bits of walks
};

}  // namespace afterglow::instant_cache
