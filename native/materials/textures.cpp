// SPDX-License-Identifier: GPL-3.0-or-later
// Texture instructions: images laid onto surfaces and skies, and the way to the procedural patterns (patterns.h).
#include <algorithm>

#include "materials/images.h"
#include "materials/patterns.h"
#include "materials/program.h"

namespace afterglow {
namespace {

enum Projection : uint32_t { kFlat, kBox, kSphere, kTube };

Vec2 on_sphere(const Vec3& p) {
  const float length = glm::length(p);
  if (!(length > 0.0f)) return Vec2(0.0f);
  const float u = p.x == 0.0f && p.y == 0.0f ? 0.0f : 0.5f * (1.0f - std::atan2(p.x, p.y) * kInvPi);
  return {u, 1.0f - std::acos(std::clamp(p.z / length, -1.0f, 1.0f)) * kInvPi};
}

Vec2 on_tube(const Vec3& p) {
  const float length = std::sqrt(p.x * p.x + p.y * p.y);
  if (!(length > 0.0f)) return Vec2(0.0f);
  return {0.5f * (1.0f - std::atan2(p.x / length, p.y / length) * kInvPi), 0.5f * (p.z + 1.0f)};
}

Vec3 object_normal(const HitContext& hit) {
  const SurfacePoint& p = *hit.points[0];
  if (!hit.scene || p.instance >= hit.scene->instances().size()) return p.normal;
  const Vec3 n = hit.scene->instances()[p.instance].to_world.transposed(p.normal);
  const float length = glm::length(n);
  return length > 0.0f ? n / length : p.normal;
}

/// Shares of the three axes' pictures by the direction of the normal: one alone, or mixed within `mix` of the borders.
Vec3 box_shares(const Vec3& normal, float mix) {
  Vec3 n = glm::abs(normal);
  const float sum = n.x + n.y + n.z;
  if (!(sum > 0.0f)) return {1.0f, 0.0f, 0.0f};
  n /= sum;
  const float limit = 0.5f * (1.0f + mix);
  for (int k = 0; k < 3; ++k) {  // one axis leads against both others
    const float a = n[(k + 1) % 3], b = n[(k + 2) % 3];
    if (n[k] > limit * (n[k] + a) && n[k] > limit * (n[k] + b)) {
      Vec3 only(0.0f);
      only[k] = 1.0f;
      return only;
    }
  }
  if (!(mix > 0.0f)) return {1.0f, 0.0f, 0.0f};
  for (int k = 0; k < 3; ++k) {  // two axes against the third
    const float a = n[(k + 1) % 3], b = n[(k + 2) % 3];
    if (n[k] < (1.0f - limit) * (a + b)) {
      Vec3 two(0.0f);
      const float share = std::clamp((a / (a + b) - 0.5f * (1.0f - mix)) / mix, 0.0f, 1.0f);
      two[(k + 1) % 3] = share, two[(k + 2) % 3] = 1.0f - share;
      return two;
    }
  }
  const auto part = [&](float v) { return ((2.0f - limit) * v + (limit - 1.0f)) / (2.0f * limit - 1.0f); };
  return {part(n.x), part(n.y), part(n.z)};
}

Vec3 image(const Vec3& at, const Operands& in, const HitContext& hit, Vec3* alpha) {
  // image, interpolation, extension, projection, blend, unassociate
  const auto interpolation = Interpolation(in.u(1));
  const auto extension = Extension(in.u(2));
  if (!hit.images) {
    *alpha = Vec3(1.0f);
    return {1.0f, 0.0f, 1.0f};
  }
  const auto sample = [&](const Vec2& uv) {
    return hit.images->sample(in.u(0), uv, interpolation, extension, in.u(5) != 0);
  };
  Vec4 value(0.0f);
  switch (in.u(3)) {
    case kBox: {
      const Vec3 normal = object_normal(hit), shares = box_shares(normal, std::clamp(in.p(4), 0.0f, 1.0f));
      if (shares.x > 0.0f) value += shares.x * sample({normal.x < 0.0f ? 1.0f - at.y : at.y, at.z});
      if (shares.y > 0.0f) value += shares.y * sample({normal.y > 0.0f ? 1.0f - at.x : at.x, at.z});
      if (shares.z > 0.0f) value += shares.z * sample({normal.z > 0.0f ? 1.0f - at.y : at.y, at.x});
      break;
    }
    case kSphere:
      value = sample(on_sphere(at * 2.0f - 1.0f));
      break;
    case kTube:
      value = sample(on_tube(at * 2.0f - 1.0f));
      break;
    default:
      value = sample({at.x, at.y});
  }
  *alpha = Vec3(value.w);
  return Vec3(value);
}

Vec3 environment(Vec3 d, const Operands& in, const HitContext& hit) {  // image, interpolation, mirror ball
  if (!hit.images) return {1.0f, 0.0f, 1.0f};
  const float length = glm::length(d);
  if (length > 0.0f) d /= length;
  Vec2 uv;
  if (in.u(2)) {
    d.y -= 1.0f;
    const float scale = 2.0f * std::sqrt(std::max(-0.5f * d.y, 0.0f));
    if (scale > 0.0f) d /= scale;
    uv = {0.5f * (d.x + 1.0f), 0.5f * (d.z + 1.0f)};
  } else {
    uv = {0.5f - std::atan2(d.y, d.x) * (0.5f * kInvPi), 0.5f + std::atan2(d.z, std::hypot(d.x, d.y)) * kInvPi};
  }
  return Vec3(hit.images->sample(in.u(0), uv, Interpolation(in.u(1)), Extension::kRepeat, false));
}

}  // namespace

Vec3 run_texture(const Instruction& ins, const Operands& in, const HitContext& hit, Vec3* second) {
  const auto operand = [&](uint16_t index) { return index == kNoOperand ? Vec3(0.0f) : in.at(index); };
  const Vec3 a = operand(ins.a);
  switch (ins.op) {
    case Op::kImage:
      return image(a, in, hit, second);
    case Op::kEnvironment:
      return environment(a, in, hit);
    default:
      return run_pattern(ins, a, operand(ins.b), operand(ins.c), in, second);
  }
}

}  // namespace afterglow
