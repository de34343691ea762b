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

/// Luminance of each light.
void find_brightness(const std::vector<float> (&light)[3], std::vector<float>& out) {
  const Rgb weights(luminance(Rgb(1, 0, 0)), luminance(Rgb(0, 1, 0)), luminance(Rgb(0, 0, 1)));
  const float *red = light[0].data(), *green = light[1].data(), *blue = light[2].data();
  out.resize(light[0].size());
  for (size_t i = 0; i < out.size(); ++i) out[i] = weights.x * red[i] + weights.y * green[i] + weights.z * blue[i];
}

float total(const float* lanes) {
  float part[kLanes];
  std::memcpy(part, lanes, sizeof(part));
  for (uint32_t step = kLanes / 2; step; step /= 2)
    for (uint32_t i = 0; i < step; ++i) part[i] += part[i + step];
  return part[0];
}

}  // namespace

/// The lights that the record sees, as bright as they arrive: a quarter to a half of all, and so are the sums' costs.
void Cache::find_seen(size_t index, Sums& sums) const {
  std::vector<uint32_t>& which = sums.which;
  const uint64_t* bits_of = visibility_.seen(index);
  which.assign(lights_.padded() + 3, 0);
  uint32_t count = 0;
  for (uint32_t w = 0; w < visibility_.words(); ++w)
    for (uint64_t bits = bits_of[w] & (front_[w] | back_[w]); bits; bits &= bits - 1)
      which[count++] = w * 64 + uint32_t(std::countr_zero(bits));
  lights_.choose(which, count, sums.seen);
  if (!visibility_.coloured()) return;
  for (uint32_t i = 0; i < count; ++i) {
    const Rgb passes = visibility_.get(index, which[i]);
    for (int c = 0; c < 3; ++c) sums.seen.front[c][i] *= passes[c], sums.seen.back[c][i] *= passes[c];
  }
}

/// The gradients are exact for the lights that are seen; what comes into sight or leaves it nearby is left aside.
void Cache::sum(size_t index, Sums& sums) {
  Record& record = records_[index];
  find_seen(index, sums);
  const Frame frame(record.normal);
  const LightSums of = sum_lights(sums.seen, record.position, frame, bound_);
  record.irradiance = is_finite(of.light) ? of.light : Rgb(0.0f);
  const bool sound = is_finite(of.step_t) && is_finite(of.step_b) && is_finite(of.turn_t) && is_finite(of.turn_b);
  const glm::mat3 none(0.0f);
  record.by_step = sound ? glm::outerProduct(of.step_t, frame.t) + glm::outerProduct(of.step_b, frame.b) : none;
  record.by_turn = sound ? glm::outerProduct(of.turn_t, frame.t) + glm::outerProduct(of.turn_b, frame.b) : none;
  const float here = luminance(record.irradiance);
  record.summed = true;
  if (std::fabs(here - record.measured) > kSameLight * record.measured) {
    record.radius = find_radius(record, sums);
    record.measured = here;
  }
  record.irradiance += record.compensation;
}

/// As far as the gradient tells the truth, to a tolerance, in four directions: it ends where light bends, as before
/// corners, to which a slope at the record alone is blind. Shadows are left aside.
float Cache::find_radius(const Record& record, Sums& sums) const {
  const float here = luminance(record.irradiance), least = spacing_.least_pixels * record.footprint;
  if (!(here > 0.0f)) return record.reach;
  const LightColumns& seen = sums.seen;
  const uint32_t size = seen.padded();
  const bool two_sided = seen.two_sided;
  find_brightness(seen.front, sums.front);
  if (two_sided) find_brightness(seen.back, sums.back);
  const auto light_there = [&](const Vec3& offset) {
    geometry_terms(seen, record.position + offset, record.normal, bound_, sums.terms.data());
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

}  // namespace afterglow::instant_cache
