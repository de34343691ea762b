// SPDX-License-Identifier: GPL-3.0-or-later
// Marking and repairing what short rays found: see nearby.h.
#include "methods/instant_cache/nearby.h"

#include <algorithm>
#include <bit>

#include "base/packing.h"
#include "base/sampler.h"

namespace afterglow::instant_cache {

namespace {

constexpr float kRounding = 2e-6f;  // of lengths and of their products
using Stop = ShortRayStop;

}  // namespace

/// The same rays wherever the record's object goes.
ShortRayPlace short_ray_place(const Record& r) {
  const uint32_t seed = hash(r.place.triangle, std::bit_cast<uint32_t>(r.place.u), std::bit_cast<uint32_t>(r.place.v));
  return {r.position, r.normal, r.face_normal, r.error, seed};
}

Obstacle::Obstacle(const Bounds& bounds, bool came, bool left, bool opaque)
    : to_object_(bounds.to_object),
      half_(0.5f * bounds.box.size()),
      world_(bounds.world),
      came_(came),
      left_(left),
      opaque_(opaque) {
  const Affine& m = to_object_;
  stretch_ = glm::abs(m.x) + glm::abs(m.y) + glm::abs(m.z);
  half_ += kRounding * glm::abs(m.p);
  to_object_.p -= bounds.box.center();
}

bool Obstacle::near(const Vec3& center, float radius) const {
  const Vec3 off = glm::max(glm::max(world_.lower - center, center - world_.upper), Vec3(0.0f));
  return !(glm::dot(off, off) > radius * radius);  // not a number: it may
}

bool Obstacle::crosses(const Vec3& from, const Vec3& to, float slack) const {
  for (int axis = 0; axis < 3; ++axis)
    if (std::max(from[axis], to[axis]) + slack < world_.lower[axis] ||
        std::min(from[axis], to[axis]) - slack > world_.upper[axis])
      return false;
  const Vec3 a = to_object_.point(from), b = to_object_.point(to);
  const Vec3 sum = a + b, d = glm::abs(b - a), cross = glm::abs(glm::cross(a, b));
  const Vec3 e = half_ + slack * stretch_ + kRounding * (glm::abs(a) + glm::abs(b));
  const float rest =
      kRounding * (max_component(glm::abs(a)) + max_component(e)) * (max_component(glm::abs(b)) + max_component(e));
  return !(std::fabs(sum.x) > 2.0f * e.x + d.x) && !(std::fabs(sum.y) > 2.0f * e.y + d.y) &&
         !(std::fabs(sum.z) > 2.0f * e.z + d.z) && !(cross.x > e.y * d.z + e.z * d.y + rest) &&
         !(cross.y > e.z * d.x + e.x * d.z + rest) && !(cross.z > e.x * d.y + e.y * d.x + rest);
}

void NearbyTable::reset(uint32_t rays) {
  words_ = (rays + 63) / 64;
  rows_.clear(), again_.clear();
}

void NearbyTable::add_row() {
  rows_.emplace_back();
  again_.resize(rows_.size() * words_, 0);
}

void NearbyTable::keep(const std::vector<uint32_t>& kept) {
  if (rows_.empty()) return;
  for (size_t to = 0; to < kept.size(); ++to) {
    if (kept[to] == to) continue;
    rows_[to] = std::move(rows_[kept[to]]);
    std::copy_n(again(kept[to]), words_, again(to));
  }
  rows_.resize(kept.size()), again_.resize(kept.size() * words_);
}

void NearbyTable::mark(size_t index, const Record& record, const ShortRays& rays, std::span<const Obstacle> obstacles,
                       const LightChanges& changes, const VirtualLightColumns& lights) {
  Row& row = rows_[index];
  if (!row.known) return;
  const ShortRayPlace place = short_ray_place(record);
  float error = record.error;
  for (Stop& stop : row.stops) {
    error = std::max(error, stop.error);
    uint8_t stale = changes.lamps ? Stop::kLampStale : 0;
    if (changes.any && stop.left) {
      if (stop.flags & Stop::kLightKnown && changes.moved[stop.chosen / 64] >> (stop.chosen % 64) & 1)
        stop.flags &= uint8_t(~Stop::kLightKnown);
      uint32_t groups[ShortRays::kGroups];
      rays.groups(stop, groups);
      for (const uint32_t group : groups)
        if (changes.grouped[group]) stale |= Stop::kStale;
    }
    if (stale) stop.flags |= stale, row.stale = true;
  }
  if (obstacles.empty()) return;
  const float slack = 2.0f * error;
  mark_walks(index, place, rays, obstacles, slack);
  const auto changed = [&](const Stop& stop, const Vec3& to, float more, uint16_t passes) {
    return std::any_of(obstacles.begin(), obstacles.end(), [&](const Obstacle& o) {
      return o.matters(passes) && o.crosses(stop.position, to, slack + more);
    });
  };
  for (Stop& stop : row.stops) {
    uint8_t stale = 0;
    if (stop.flags & Stop::kLampKnown && changed(stop, stop.lamp_end, 0.0f, stop.passes[0]))
      stop.flags &= uint8_t(~Stop::kLampKnown), stale |= Stop::kLampStale;
    if (stop.flags & Stop::kLightKnown) {
      const VirtualLight& light = lights.lights[stop.chosen];
      if (changed(stop, light.position, 2.0f * light.lift, stop.passes[1]))
        stop.flags &= uint8_t(~Stop::kLightKnown), stale |= Stop::kStale;
    }
    if (stale) stop.flags |= stale, row.stale = true;
  }
}

/// The ways between record and stops, and those on which nothing was met.
void NearbyTable::mark_walks(size_t index, const ShortRayPlace& place, const ShortRays& rays,
                             std::span<const Obstacle> obstacles, float slack) {
  Row& row = rows_[index];
  float far = 0.0f;
  for (const Stop& stop : row.stops) far = std::max(far, glm::distance(stop.position, place.position));
  far = 1.001f * (far + rays.reach()) + slack;
  std::vector<const Obstacle*> near;
  for (const Obstacle& o : obstacles)
    if (o.near(place.position, far)) near.push_back(&o);
  if (near.empty()) return;
  const auto turned = [&](const Vec3& from, const Vec3& to, bool met) {
    return std::any_of(near.begin(), near.end(), [&](const Obstacle* o) { return o->turns(from, to, met, slack); });
  };
  const float reach = rays.reach() + slack;
  size_t at = 0;
  for (uint32_t walk = 0; walk < rays.count(); ++walk) {
    Vec3 from = place.position, around = place.normal, face = place.face_normal;
    bool goes_on = true, touched = false;
    uint32_t depth = 1;
    for (; at < row.stops.size() && row.stops[at].walk == walk; ++at, ++depth) {
      const Stop& stop = row.stops[at];
      touched |= turned(from, stop.position, true);
      const float side = stop.flags & Stop::kBack ? -1.0f : 1.0f;
      from = stop.position;
      around = side * unpack_direction(stop.normal), face = side * unpack_direction(stop.face_normal);
      goes_on = stop.flags & Stop::kGoesOn;
    }
    if (goes_on && !touched &&
        std::any_of(near.begin(), near.end(), [&](const Obstacle* o) { return o->near(from, reach); })) {
      Vec3 way;
      if (rays.direction(place, walk, depth, around, face, way))
        touched = turned(from, from + rays.reach() * way, false);
    }
    if (touched) again(index)[walk / 64] |= uint64_t(1) << (walk % 64), row.stale = true;
  }
}

Rgb NearbyTable::repair(size_t index, const ShortRays& rays, const Record& record, RayCounts& counts) {
  Row& row = rows_[index];
  if (!unknown(index)) return record.compensation;
  const ShortRayPlace place = short_ray_place(record);
  uint64_t* marked = again(index);
  const bool any = std::any_of(marked, marked + words_, [](uint64_t bits) { return bits != 0; });
  if (!row.known || any) {
    std::vector<Stop> stops;
    size_t at = 0;
    for (uint32_t walk = 0; walk < rays.count(); ++walk) {
      const bool anew = !row.known || (marked[walk / 64] >> (walk % 64) & 1);
      if (anew) rays.walk(place, walk, stops, counts);
      for (; at < row.stops.size() && row.stops[at].walk == walk; ++at)
        if (!anew) stops.push_back(row.stops[at]);
    }
    row.stops.assign(stops.begin(), stops.end());
    std::fill_n(marked, words_, uint64_t(0));
  }
  for (Stop& stop : row.stops)
    if (stop.flags & (Stop::kStale | Stop::kLampStale)) rays.find_light(place, stop, counts);
  row.known = true, row.stale = false;
  return rays.sum(row.stops);
}

size_t NearbyTable::bytes() const {
  size_t sum = rows_.capacity() * sizeof(Row) + 8 * again_.capacity();
  for (const Row& row : rows_) sum += row.stops.capacity() * sizeof(Stop);
  return sum;
}

}  // namespace afterglow::instant_cache
