// SPDX-License-Identifier: GPL-3.0-or-later
// Records of the instant cache (Debattista et al. 2009, section 3.2): where light was gathered, how much, and for each
// virtual light whether it was seen. The paper keeps each light's contribution in four bytes; kept here is visibility
// alone, one bit a light where everything is opaque and 16 bits of coloured transmittance elsewhere. Contributions are
// recomputed from it, so that sums never drift: with 256 lights a record and its gradients take 289 or 801 bytes.
#pragma once

#include <vector>

#include "methods/method.h"
#include "scene/scene.h"

namespace afterglow::instant_cache {

/// Room for so many, with an eighth to spare: doubling leaves a third of a cache unused on average.
template <class T>
void make_room(std::vector<T>& values, size_t size) {
  if (size > values.capacity()) values.reserve(size + size / 8 + 8);
}

/// A place on a triangle: it follows the triangle wherever its object goes.
struct Place {
  uint32_t instance = kNone, triangle = kNone;
  float u = 0.0f, v = 0.0f;  // barycentric weights of the second and third corner
  bool back = false;         // on the side that the triangle's winding turns away
};

struct Record {
  Place place;
  Vec3 position{0.0f}, normal{0, 0, 1}, face_normal{0, 0, 1};
  float error = 0.0f;      // how far above the face rays start
  float footprint = 0.0f;  // of the pixel that asked for it
  float reach = 0.0f;      // radius under which it stands in the octree
  float radius = 0.0f;     // within which it may be used, at most reach
  Rgb irradiance{0.0f};
  glm::mat3 by_step{0.0f}, by_turn{0.0f};  // its change over steps along the surface, and over turns of the normal
  float measured = -1.0f;                  // luminance of its light when its radius was found
  uint32_t born = 0, asked = 0;            // the updates after which it was made, and rays were last traced for it
  uint32_t rays = 0;                       // so many
  bool ready = false;                      // no visibility is unknown
  bool summed = false;                     // irradiance is what is known to be seen, of the lights as they are
  Rgb compensation{0.0f};                  // what short rays found; irradiance holds it already
};

/// Where its rays start.
inline Vec3 lifted(const Record& record) { return record.position + record.error * record.face_normal; }
/// Where the place is now. False: the triangle has no area.
bool locate(const Scene&, Record&);
Place place_of(const Scene&, const CachePoint&);

/// Visibility of every virtual light from every record, and which of them have to be asked (again).
class VisibilityTable {
 public:
  void reset(uint32_t slots, bool coloured);
  /// What is seen through something is unknown where transmittance is no longer kept.
  void set_coloured(bool);
  uint32_t words() const { return words_; }  // of 64 bits, a row
  bool coloured() const { return coloured_; }
  size_t rows() const { return rows_; }
  void add_row();                                // everything unknown
  void keep(const std::vector<uint32_t>& kept);  // drops all rows but these, in this order
  uint64_t* unknown(size_t row) { return unknown_.data() + row * words_; }
  const uint64_t* unknown(size_t row) const { return unknown_.data() + row * words_; }
  /// Lights of which anything arrives.
  uint64_t* seen(size_t row) { return seen_.data() + row * words_; }
  const uint64_t* seen(size_t row) const { return seen_.data() + row * words_; }
  Rgb get(size_t row, uint32_t slot) const;
  /// Whether it was another.
  bool set(size_t row, uint32_t slot, const Rgb&);
  /// Lights that face the record, as found when they were last asked: the others can do what they want.
  uint64_t* facing(size_t row) { return facing_.data() + row * words_; }
  /// 64 bits: whether an object that comes into the way could change it, and one that leaves it.
  uint64_t could_darken(size_t row, uint32_t word) const { return seen_[row * words_ + word]; }
  uint64_t could_brighten(size_t row, uint32_t word) const;
  size_t bytes() const;
  /// All rows as they are, to the end of a file's bytes; and rows from there, over what reset() made.
  void write(std::vector<char>&) const;
  void read(size_t rows, const char*);
  size_t row_bytes() const { return words_ * 24 + (coloured_ ? slots_ * 2 : 0); }

 private:
  uint32_t slots_ = 0, words_ = 0;
  bool coloured_ = false;
  size_t rows_ = 0;
  std::vector<uint64_t> seen_, unknown_, facing_;
  std::vector<uint16_t> transmittance_;  // only where coloured
};

}  // namespace afterglow::instant_cache
