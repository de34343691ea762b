// SPDX-License-Identifier: GPL-3.0-or-later
// A record's light, its gradients and its radius: sums over all virtual lights, made anew from what is seen each time,
// so that nothing drifts. Lights stand in columns, sixteen to a register, and are added in the same order everywhere.
#include <algorithm>
#include <bit>
#include <cstring>

#include "methods/instant_cache/cache.h"

namespace afterglow::instant_cache {

namespace {

constexpr uint32_t kLanes = 16;
using Lanes = float __attribute__((vector_size(4 * kLanes)));  // the compiler splits it where registers are narrower

constexpr float kSameLight = 0.02f;  // relative change of a record's light that leaves its radius as it is
constexpr int kRadiusRounds = 5;     // three halves lead from the largest to the smallest

float total(const float* lanes) {
  float part[kLanes];
  std::memcpy(part, lanes, sizeof(part));
  for (uint32_t step = kLanes / 2; step; step /= 2)
    for (uint32_t i = 0; i < step; ++i) part[i] += part[i + step];
  return part[0];
}

/// Σ factors · light, in each colour.
Rgb product(const std::vector<float>& factors, const std::vector<float> (&light)[3], uint32_t size) {
  Lanes sums[3] = {};
  for (uint32_t i = 0; i < size; i += kLanes) {
    Lanes f;
    std::memcpy(&f, factors.data() + i, sizeof(f));
    for (int c = 0; c < 3; ++c) {
      Lanes l;
      std::memcpy(&l, light[c].data() + i, sizeof(l));
      sums[c] += f * l;
    }
  }
  Rgb result;
  for (int c = 0; c < 3; ++c) {
    float lanes[kLanes];
    std::memcpy(lanes, &sums[c], sizeof(lanes));
    result[c] = total(lanes);
  }
  return result;
}

void spread_bits(uint64_t word, uint32_t shift, float* out) {
  const uint32_t bits = uint32_t(word >> shift) & 0xffff;
  for (uint32_t l = 0; l < kLanes; ++l) out[l] = float(bits >> l & 1);
}

}  // namespace

/// What each light sends to the record's place a unit of its geometry term, with the term's sign.
void Cache::find_light(size_t index, Sums& sums) const {
  const uint32_t size = lights_.padded();
  const uint64_t* seen = visibility_.seen(index);
  for (auto& column : sums.light) column.resize(size);
  for (uint32_t i = 0; i < size; i += kLanes) {
    float share[kLanes];
    spread_bits(seen[i / 64], i % 64, share);
    const float* terms = sums.terms.data() + i;
    for (int c = 0; c < 3; ++c) {
      const float *front = lights_.front[c].data() + i, *back = lights_.back[c].data() + i;
      Lanes f, b, s, t;
      std::memcpy(&f, front, sizeof(f)), std::memcpy(&b, back, sizeof(b));
      std::memcpy(&s, share, sizeof(s)), std::memcpy(&t, terms, sizeof(t));
      const Lanes light = s * (t > 0.0f ? f : -b);
      std::memcpy(sums.light[c].data() + i, &light, sizeof(light));
    }
  }
  if (!visibility_.coloured()) return;
  for (uint32_t w = 0; w < visibility_.words(); ++w)
    for (uint64_t bits = seen[w]; bits; bits &= bits - 1) {
      const uint32_t k = w * 64 + uint32_t(std::countr_zero(bits));
      const Rgb passes = visibility_.get(index, k);
      for (int c = 0; c < 3; ++c) sums.light[c][k] *= passes[c];
    }
}

/// Exact for the lights that are seen; what comes into sight or leaves it nearby is left aside.
void Cache::find_gradients(size_t index, Sums& sums) {
  Record& record = records_[index];
  const Frame frame(record.normal);
  GeometrySlopes& slopes = sums.slopes;
  geometry_slopes(lights_, record.position, frame, bound_, slopes);
  const uint32_t size = lights_.padded();
  const Rgb step_t = product(slopes.step_t, sums.light, size), step_b = product(slopes.step_b, sums.light, size);
  const Rgb turn_t = product(slopes.turn_t, sums.light, size), turn_b = product(slopes.turn_b, sums.light, size);
  const bool sound = is_finite(step_t) && is_finite(step_b) && is_finite(turn_t) && is_finite(turn_b);
  const glm::mat3 none(0.0f);
  record.by_step = sound ? glm::outerProduct(step_t, frame.t) + glm::outerProduct(step_b, frame.b) : none;
  record.by_turn = sound ? glm::outerProduct(turn_t, frame.t) + glm::outerProduct(turn_b, frame.b) : none;
}

void Cache::sum(size_t index, Sums& sums) {
  Record& record = records_[index];
  find_light(index, sums);
  const Rgb light = product(sums.terms, sums.light, lights_.padded());
  record.irradiance = is_finite(light) ? light : Rgb(0.0f);
  find_gradients(index, sums);
  const float here = luminance(record.irradiance);
  record.ready = true;
  if (std::fabs(here - record.measured) > kSameLight * record.measured) {
    record.radius = find_radius(index, sums);
    record.measured = here;
  }
  record.irradiance += record.compensation;
}

/// As far as the gradient tells the truth, to a tolerance, in four directions: it ends where light bends, as before
/// corners, to which a slope at the record alone is blind. Shadows are left aside.
float Cache::find_radius(size_t index, Sums& sums) const {
  const Record& record = records_[index];
  const float here = luminance(record.irradiance), least = spacing_.least_pixels * record.footprint;
  if (!(here > 0.0f)) return record.reach;
  const uint32_t size = lights_.padded();
  const bool two_sided = lights_.two_sided;
  find_brightness(index, sums);
  const auto light_there = [&](const Vec3& offset) {
    geometry_terms(lights_, record.position + offset, record.normal, bound_, sums.terms.data());
    Lanes sum = {};
    const Lanes none = {};
    for (uint32_t i = 0; i < size; i += kLanes) {
      Lanes g, front;
      std::memcpy(&g, sums.terms.data() + i, sizeof(g)), std::memcpy(&front, sums.front.data() + i, sizeof(front));
      if (two_sided) {
        Lanes back;
        std::memcpy(&back, sums.back.data() + i, sizeof(back));
        sum += (g > 0.0f ? g : none) * front - (g < 0.0f ? g : none) * back;
      } else {
        sum += g * front;
      }
    }
    float lanes[kLanes];
    std::memcpy(lanes, &sum, sizeof(lanes));
    return total(lanes);
  };
  const Frame frame(record.normal);
  const float bend = spacing_.bend;
  const auto off_line = [&](float radius) {
    float worst = 0.0f;
    for (const Vec3& way : {frame.t, -frame.t, frame.b, -frame.b}) {
      if (worst >= 4.0f * bend) break;  // enough to halve the radius
      const Rgb line = record.irradiance + radius * (record.by_step * way);
      const float told = luminance(bounded_light(line, record.irradiance));
      worst = std::max(worst, std::fabs(light_there(radius * way) - told) / here);
    }
    return worst;
  };
  if (record.measured >= 0.0f) {  // other light, mostly as bent as it was
    const float off = off_line(record.radius);
    if (off > bend ? record.radius <= least : off > 0.25f * bend || record.radius >= record.reach) return record.radius;
  }
  float radius = record.reach;
  for (int round = 0; round < kRadiusRounds && radius > least; ++round) {
    const float off = off_line(radius);
    if (off <= bend) break;
    radius *= std::clamp(std::sqrt(bend / off), 0.5f, 0.8f);  // it is of second order
  }
  return std::min(std::max(radius, least), record.reach);
}

/// Luminance that arrives from either side of what is seen.
void Cache::find_brightness(size_t index, Sums& sums) const {
  const uint32_t size = lights_.padded();
  const bool two_sided = lights_.two_sided;
  sums.front.resize(size), sums.back.resize(size);
  const uint64_t* seen = visibility_.seen(index);
  const float red = luminance(Rgb(1, 0, 0)), green = luminance(Rgb(0, 1, 0)), blue = luminance(Rgb(0, 0, 1));
  const auto brightness = [&](const std::vector<float>(&light)[3], std::vector<float>& out) {
    for (uint32_t i = 0; i < size; i += kLanes) {
      float share[kLanes];
      spread_bits(seen[i / 64], i % 64, share);
      const float *r = light[0].data() + i, *g = light[1].data() + i, *b = light[2].data() + i;
      for (uint32_t l = 0; l < kLanes; ++l) out[i + l] = share[l] * (red * r[l] + green * g[l] + blue * b[l]);
    }
  };
  brightness(lights_.front, sums.front);
  if (two_sided) brightness(lights_.back, sums.back);
  if (!visibility_.coloured()) return;
  for (uint32_t w = 0; w < visibility_.words(); ++w)
    for (uint64_t bits = seen[w]; bits; bits &= bits - 1) {
      const uint32_t k = w * 64 + uint32_t(std::countr_zero(bits));
      const Rgb passes = visibility_.get(index, k);
      sums.front[k] = luminance(passes * lights_.lights[k].front);
      if (two_sided) sums.back[k] = luminance(passes * lights_.lights[k].back);
    }
}

}  // namespace afterglow::instant_cache
