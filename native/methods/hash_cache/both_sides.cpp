// SPDX-License-Identifier: GPL-3.0-or-later
// Packing, unpacking and the running mean: see both_sides.h.
#include "methods/hash_cache/both_sides.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "methods/hash_cache/cells.h"

namespace afterglow::hash_cache {

namespace {

using Bits = unsigned __int128;

constexpr int kMantissaBits = 11, kCountBits = 9, kCountPoint = 4, kAxisBits = 6;
constexpr int kLeast = -107, kMost = 127;  // exponents of light
constexpr uint64_t kMostSamples = uint64_t(31) << 30;

/// Lots in [0, 1), one after another.
class Lots {
 public:
  explicit Lots(uint64_t seed) : state_(seed) {}
  double next() { return double(mix(state_ += 0x9e3779b97f4a7c15u) >> 11) * 0x1p-53; }

 private:
  uint64_t state_;
};

struct Writer {
  Bits bits = 0;
  int at = 0;
  void put(uint32_t value, int width) { bits |= Bits(value) << at, at += width; }
};
struct Reader {
  Bits bits;
  uint32_t take(int width) {
    const auto value = uint32_t(bits) & ((1u << width) - 1u);
    bits >>= width;
    return value;
  }
};

void put_light(Writer& out, const Rgb& light, Lots& lots) {
  const double most = std::max({light.x, light.y, light.z});
  uint32_t mantissas[3] = {}, exponent = 0;
  if (most >= std::ldexp(1.0, kLeast)) {
    int power = std::min(std::ilogb(most) + 1, kMost);
    const double lot[3] = {lots.next(), lots.next(), lots.next()};
    for (bool fits = false; !fits; power += fits ? 0 : 1) {
      fits = true;
      for (int c = 0; c < 3; ++c) {
        mantissas[c] = uint32_t(std::ldexp(double(light[c]), kMantissaBits - power) + lot[c]);
        if (!(mantissas[c] >> kMantissaBits)) continue;
        mantissas[c] = (1u << kMantissaBits) - 1;
        fits = power == kMost;
      }
    }
    exponent = uint32_t(power - kMantissaBits + 127);
  }
  for (const uint32_t m : mantissas) out.put(m, kMantissaBits);
  out.put(exponent, 8);
}

Rgb take_light(Reader& in) {
  const uint32_t a = in.take(kMantissaBits), b = in.take(kMantissaBits), c = in.take(kMantissaBits);
  return Rgb(float(a), float(b), float(c)) * std::bit_cast<float>(in.take(8) << 23);
}

uint64_t count_of(uint32_t code) {
  const uint32_t power = code >> kCountPoint, rest = code & 15u;
  return power ? uint64_t(16 + rest) << (power - 1) : rest;
}

/// The code below or above, in proportion to how near they are.
uint32_t code_of(uint64_t count, Lots& lots) {
  count = std::min(count, kMostSamples);
  const int power = std::max(0, int(std::bit_width(count)) - kCountPoint);
  if (!power) return uint32_t(count);
  const int shift = power - 1;
  const auto code = uint32_t(power << kCountPoint) + (uint32_t(count >> shift) & 15u);
  const double part = std::ldexp(double(count & ((uint64_t(1) << shift) - 1)), -shift);
  return code + (lots.next() < part ? 1u : 0u);
}

/// Octahedral (Cigolla et al. 2014), without the sign of the whole: fronts alone are kept.
void put_normal(Writer& out, const Vec3& n, Lots& lots) {
  const float sum = std::fabs(n.x) + std::fabs(n.y) + std::fabs(n.z);
  Vec2 p = sum > 0.0f ? Vec2(n.x, n.y) / sum : Vec2(0.0f);
  if (n.z < 0.0f) p = (1.0f - glm::abs(Vec2(p.y, p.x))) * Vec2(p.x >= 0.0f ? 1.0f : -1.0f, p.y >= 0.0f ? 1.0f : -1.0f);
  for (const float v : {p.x, p.y}) {
    const double at = (0.5 + 0.5 * double(v)) * ((1 << kAxisBits) - 2);  // even: axes are exact
    out.put(uint32_t(at + lots.next()), kAxisBits);
  }
}

Vec3 take_normal(Reader& in) {
  const auto axis = [&] { return 2.0f * float(in.take(kAxisBits)) / float((1 << kAxisBits) - 2) - 1.0f; };
  const float x = axis(), y = axis(), z = 1.0f - std::fabs(x) - std::fabs(y);
  const float under = std::max(-z, 0.0f);
  return glm::normalize(Vec3(x - std::copysign(under, x), y - std::copysign(under, y), z));
}

}  // namespace

BothSides BothSidesRecord::unpack() const {
  Reader in{0};
  std::memcpy(&in.bits, bytes_, sizeof(bytes_));
  BothSides out;
  for (Rgb& light : out.light) light = take_light(in);
  for (uint64_t& count : out.count) count = count_of(in.take(kCountBits));
  out.normal = take_normal(in);
  out.frame = in.take(8);
  return out;
}

void BothSidesRecord::pack(const BothSides& what, uint64_t random) {
  Lots lots(random);
  Writer out;
  for (const Rgb& light : what.light) put_light(out, light, lots);
  for (const uint64_t count : what.count) out.put(code_of(count, lots), kCountBits);
  put_normal(out, what.normal, lots);
  out.put(what.frame % kFrames, 8);
  std::memcpy(bytes_, &out.bits, sizeof(bytes_));
}

void BothSidesRecord::add(const Vec3& normal, const Rgb& sum, uint32_t n, uint32_t frame, uint32_t changed,
                          uint32_t salt) {
  BothSides all = unpack();
  const bool fresh = !all.count[0] && !all.count[1];
  if (fresh || (all.frame - changed) % kFrames >= kFrames / 2) all = BothSides{.frame = frame};
  const bool front = faces_front(normal);
  Rgb& light = all.light[front ? 0 : 1];
  uint64_t& count = all.count[front ? 0 : 1];
  count = std::min(count + n, kMostSamples);
  const auto remembered = float(std::min<uint64_t>(count, std::max(kWindow, n)));
  light = glm::max(light + (sum - float(n) * light) / remembered, Rgb(0.0f));
  if (all.count[0] + all.count[1] == n)
    all.normal = front ? normal : -normal;
  else
    all.normal += ((front ? normal : -normal) - all.normal) / remembered;
  uint64_t random;
  std::memcpy(&random, bytes_, sizeof(random));
  pack(all, mix(random ^ uint64_t(salt) << 32 ^ frame));
}

}  // namespace afterglow::hash_cache
