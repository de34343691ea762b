// SPDX-License-Identifier: GPL-3.0-or-later
// Owen-scrambled Sobol points for pixels, padded over dimensions (Burley 2020, "Practical Hash-based Owen Scrambling"),
// and integer hashes. A sample is a pure function of (seed, index, dimension): no state that threads could share.
// Four dimensions make a block: one Sobol point whose index is shuffled by the block's own scramble. All four are
// computed at once, in vector registers, because a bounce asks for about ten of them.
#pragma once

#include <array>

#include "base/math.h"

namespace afterglow {

/// A full avalanche of 32 bits (multiply and shift, constants of low bias found by Wellons 2018).
inline uint32_t hash(uint32_t x) {
  x = (x ^ (x >> 16)) * 0x21f0aaadu;
  x = (x ^ (x >> 15)) * 0xd35a2d97u;
  return x ^ (x >> 15);
}
inline uint32_t hash(uint32_t a, uint32_t b) { return hash(a ^ (hash(b) + 0x9e3779b9u + (a << 6) + (a >> 2))); }
inline uint32_t hash(uint32_t a, uint32_t b, uint32_t c) { return hash(hash(a, b), c); }

/// 24 bits to [0, 1).
inline float unit_float(uint32_t x) { return float(x >> 8) * 0x1p-24f; }

namespace sobol {

using Lanes = uint32_t __attribute__((vector_size(16)));

inline uint32_t reverse(uint32_t x) {
  x = __builtin_bswap32(x);
  x = ((x >> 4) & 0x0f0f0f0fu) | ((x & 0x0f0f0f0fu) << 4);
  x = ((x >> 2) & 0x33333333u) | ((x & 0x33333333u) << 2);
  return ((x >> 1) & 0x55555555u) | ((x & 0x55555555u) << 1);
}
inline Lanes reverse(Lanes x) {
  x = (x >> 16) | (x << 16);
  x = ((x >> 8) & 0x00ff00ffu) | ((x & 0x00ff00ffu) << 8);
  x = ((x >> 4) & 0x0f0f0f0fu) | ((x & 0x0f0f0f0fu) << 4);
  x = ((x >> 2) & 0x33333333u) | ((x & 0x33333333u) << 2);
  return ((x >> 1) & 0x55555555u) | ((x & 0x55555555u) << 1);
}

/// The hash of Laine and Karras 2011 with Vegdahl's constants (2021): each bit is flipped by the bits below it alone,
/// so that on reversed bits it is a nested uniform (Owen) scramble.
template <class T>
inline T laine_karras(T x, T seed) {
  x ^= x * 0x3d20adeau;
  x += seed;
  x *= (seed >> 16) | 1u;
  x ^= x * 0x05526c56u;
  return x ^ (x * 0x53a22864u);
}

/// The four first dimensions of the Sobol sequence for each value of each half byte of the index (Joe and Kuo 2008).
using Table = std::array<std::array<std::array<uint32_t, 4>, 16>, 8>;
constexpr uint32_t reversed_bits(uint32_t x) {
  uint32_t r = 0;
  for (int bit = 0; bit < 32; ++bit) r |= (x >> bit & 1u) << (31 - bit);
  return r;
}
/// Kept with all bits reversed, values and half bytes: the scrambles on both sides work on reversed bits.
constexpr Table make_table() {
  uint32_t v[4][32] = {};
  // Primitive polynomials x+1, x²+x+1, x³+x+1 with their first direction numbers; dimension 0 is van der Corput's.
  constexpr uint32_t degree[4] = {0, 1, 2, 3}, poly[4] = {0, 0, 1, 1}, m[4][3] = {{}, {1}, {1, 3}, {1, 3, 1}};
  for (int bit = 0; bit < 32; ++bit) v[0][bit] = 1u << (31 - bit);
  for (int d = 1; d < 4; ++d) {
    const int s = int(degree[d]);
    for (int bit = 0; bit < 32; ++bit) {
      if (bit < s) {
        v[d][bit] = m[d][bit] << (31 - bit);
        continue;
      }
      v[d][bit] = v[d][bit - s] ^ (v[d][bit - s] >> s);
      for (int k = 1; k < s; ++k) v[d][bit] ^= ((poly[d] >> (s - 1 - k)) & 1u) * v[d][bit - k];
    }
  }
  Table table{};
  for (int part = 0; part < 8; ++part)
    for (int value = 0; value < 16; ++value)
      for (int d = 0; d < 4; ++d)
        for (int bit = 0; bit < 4; ++bit)
          if (value >> (3 - bit) & 1)
            table[size_t(part)][size_t(value)][size_t(d)] ^= reversed_bits(v[d][4 * part + bit]);
  return table;
}
alignas(64) inline constexpr Table kTable = make_table();

inline Lanes load(const std::array<uint32_t, 4>& a) { return Lanes{a[0], a[1], a[2], a[3]}; }

/// The four coordinates of one block, as 32-bit fractions.
inline Lanes block(uint32_t seed, uint32_t reversed_index, uint32_t block) {
  const uint32_t key = hash(seed ^ (block * 0x9e3779b9u));
  const uint32_t i = laine_karras(reversed_index, key);  // reversed, too: the lowest bits of the index stand on top
  Lanes x = load(kTable[0][i >> 28]);
  // 24 bits of the index tell 16 million points apart; what digits beyond would change, the scramble does anyway.
  for (unsigned part = 1; part < 6; ++part) x ^= load(kTable[part][i >> (28 - 4 * part) & 15]);
  Lanes keys = Lanes{0x68bc21ebu, 0x02e5be93u, 0x967a889bu, 0xb5297a4du} ^ key;  // one scramble a dimension
  keys = (keys ^ (keys >> 16)) * 0x21f0aaadu;
  keys = (keys ^ (keys >> 15)) * 0xd35a2d97u;
  keys ^= keys >> 15;
  return reverse(laine_karras(x, keys));
}

}  // namespace sobol

/// One path's stream of sample points. next2() consumes a pair of one block, so that its two coordinates are stratified
/// together, and skips a dimension where it must.
class Sampler {
 public:
  Sampler(uint32_t seed, uint32_t index) : seed_(seed), index_(sobol::reverse(index)) {}
  float next1() {
    const uint32_t d = dimension_++;
    fetch(d >> 2);
    return values_[d & 3];
  }
  Vec2 next2() {
    const uint32_t d = (dimension_ + 1) & ~1u;
    dimension_ = d + 2;
    fetch(d >> 2);
    return {values_[d & 3], values_[(d & 3) + 1]};
  }
  /// The four coordinates of one block at once: dimensions 4 block to 4 block + 3. Leaves the stream where it is.
  std::array<float, 4> block(uint32_t block) const {
    const sobol::Lanes x = sobol::block(seed_, index_, block);
    return {unit_float(x[0]), unit_float(x[1]), unit_float(x[2]), unit_float(x[3])};
  }
  void set_dimension(uint32_t dimension) { dimension_ = dimension; }
  uint32_t dimension() const { return dimension_; }

 private:
  void fetch(uint32_t block) {
    if (block == block_) return;
    block_ = block;
    const sobol::Lanes x = sobol::block(seed_, index_, block);
    for (int k = 0; k < 4; ++k) values_[k] = unit_float(x[k]);
  }

  uint32_t seed_, index_, dimension_ = 0, block_ = kNone;
  alignas(16) float values_[4];
};

}  // namespace afterglow
