// SPDX-License-Identifier: GPL-3.0-or-later
// Places and packed visibility: see records.h.
#include "methods/instant_cache/records.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <utility>

#include "base/packing.h"
#include "rays/surface_point.h"

namespace afterglow::instant_cache {

namespace {

/// The triangle seen along a direction.
SurfacePoint seen_along(const Scene& scene, const Place& place, const Vec3& direction) {
  Hit hit;
  hit.t = 0.0f, hit.u = place.u, hit.v = place.v;
  hit.instance = place.instance, hit.triangle = place.triangle;
  const Ray ray{Vec3(0.0f), 0.0f, direction, kInfinity, kVisibleAll};
  return surface_point(scene, ray, hit, false);
}

/// Normal of the winding, or of wherever the triangle without area was looked at from.
Vec3 winding_normal(const Scene& scene, const Place& place) {
  const SurfacePoint point = seen_along(scene, place, Vec3(0, 0, 1));
  return point.backfacing ? -point.face_normal : point.face_normal;
}

}  // namespace

bool locate(const Scene& scene, Record& record) {
  const Vec3 normal = winding_normal(scene, record.place) * (record.place.back ? -1.0f : 1.0f);
  const SurfacePoint point = seen_along(scene, record.place, -normal);
  record.position = point.position;
  record.normal = point.normal, record.face_normal = point.face_normal;
  record.error = point.error;
  return is_finite(point.position) && is_finite(point.normal) && is_finite(point.face_normal);
}

Place place_of(const Scene& scene, const CachePoint& point) {
  Place place{point.instance, point.triangle, point.u, point.v, false};
  place.back = glm::dot(winding_normal(scene, place), point.face_normal) < 0.0f;
  return place;
}

void VisibilityTable::reset(uint32_t slots, bool coloured) {
  slots_ = slots, words_ = (slots + 63) / 64, coloured_ = coloured;
  rows_ = 0;
  seen_.clear(), unknown_.clear(), facing_.clear(), transmittance_.clear();
}

void VisibilityTable::set_coloured(bool coloured) {
  if (coloured == coloured_) return;
  if (coloured) transmittance_.assign(rows_ * slots_, 0);
  for (size_t row = 0; row < rows_; ++row)
    for (uint32_t k = 0; k < slots_; ++k) {
      const uint64_t bit = uint64_t(1) << (k % 64);
      if (!(seen(row)[k / 64] & bit)) continue;
      if (coloured)
        transmittance_[row * slots_ + k] = 0xffff;
      else if (transmittance_[row * slots_ + k] != 0xffff)
        unknown(row)[k / 64] |= bit;
    }
  if (!coloured) transmittance_ = {};
  coloured_ = coloured;
}

void VisibilityTable::add_row() {
  rows_++;
  for (std::vector<uint64_t>* bits : {&seen_, &unknown_, &facing_}) make_room(*bits, rows_ * words_);
  if (coloured_) make_room(transmittance_, rows_ * slots_);
  seen_.resize(rows_ * words_, 0);
  facing_.resize(rows_ * words_, ~uint64_t(0));
  unknown_.resize(rows_ * words_, ~uint64_t(0));
  if (slots_ % 64 && words_) unknown_.back() = facing_.back() = (uint64_t(1) << (slots_ % 64)) - 1;
  if (coloured_) transmittance_.resize(rows_ * slots_, 0);
}

void VisibilityTable::keep(const std::vector<uint32_t>& kept) {
  for (size_t to = 0; to < kept.size(); ++to) {
    const size_t from = kept[to];
    if (from == to) continue;
    std::copy_n(seen(from), words_, seen(to));
    std::copy_n(unknown(from), words_, unknown(to));
    std::copy_n(facing(from), words_, facing(to));
    if (coloured_) std::copy_n(transmittance_.data() + from * slots_, slots_, transmittance_.data() + to * slots_);
  }
  rows_ = kept.size();
  seen_.resize(rows_ * words_), unknown_.resize(rows_ * words_), facing_.resize(rows_ * words_);
  if (coloured_) transmittance_.resize(rows_ * slots_);
}

Rgb VisibilityTable::get(size_t row, uint32_t slot) const {
  if (!(seen(row)[slot / 64] >> (slot % 64) & 1)) return Rgb(0.0f);
  return coloured_ ? unpack_transmittance(transmittance_[row * slots_ + slot]) : Rgb(1.0f);
}

bool VisibilityTable::set(size_t row, uint32_t slot, const Rgb& visibility) {
  const uint64_t bit = uint64_t(1) << (slot % 64);
  const uint16_t packed = pack_transmittance(visibility);
  uint64_t& word = seen(row)[slot / 64];
  const uint64_t before = std::exchange(word, packed ? word | bit : word & ~bit);
  const bool tinted = coloured_ && std::exchange(transmittance_[row * slots_ + slot], packed) != packed;
  return tinted || word != before;
}

uint64_t VisibilityTable::could_brighten(size_t row, uint32_t word) const {
  uint64_t whole = seen(row)[word];
  if (coloured_)
    for (uint64_t bits = whole; bits; bits &= bits - 1)
      if (transmittance_[row * slots_ + word * 64 + uint32_t(std::countr_zero(bits))] != 0xffff)
        whole &= ~(bits & -bits);
  return facing_[row * words_ + word] & ~whole;
}

void VisibilityTable::write(std::vector<char>& bytes) const {
  const auto append = [&](const auto& values, size_t count) {
    const char* at = reinterpret_cast<const char*>(values.data());
    bytes.insert(bytes.end(), at, at + count * sizeof(values[0]));
  };
  append(seen_, rows_ * words_), append(unknown_, rows_ * words_), append(facing_, rows_ * words_);
  if (coloured_) append(transmittance_, rows_ * slots_);
}

void VisibilityTable::read(size_t rows, const char* from) {
  rows_ = rows;
  const auto take = [&](auto& values, size_t count) {
    values.resize(count);
    if (count) std::memcpy(values.data(), from, count * sizeof(values[0]));
    from += count * sizeof(values[0]);
  };
  take(seen_, rows_ * words_), take(unknown_, rows_ * words_), take(facing_, rows_ * words_);
  if (coloured_) take(transmittance_, rows_ * slots_);
  if (slots_ % 64)
    for (size_t row = 0; row < rows_; ++row)  // no bit beyond the slots, whatever the file says
      for (std::vector<uint64_t>* bits : {&seen_, &unknown_, &facing_})
        (*bits)[(row + 1) * words_ - 1] &= (uint64_t(1) << (slots_ % 64)) - 1;
}

size_t VisibilityTable::bytes() const {
  return 8 * (seen_.capacity() + unknown_.capacity() + facing_.capacity()) + 2 * transmittance_.capacity();
}

}  // namespace afterglow::instant_cache
