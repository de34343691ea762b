// SPDX-License-Identifier: GPL-3.0-or-later
// Vectors, colours and small affine arithmetic that all else speaks in. GLM underneath; nothing here allocates.
#pragma once

#include <cmath>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <limits>

namespace afterglow {

using Vec2 = glm::vec2;
using Vec3 = glm::vec3;
using Vec4 = glm::vec4;
using DVec3 = glm::dvec3;
using DMat4 = glm::dmat4;
using Rgb = glm::vec3;  // scene-linear Rec. 709

inline constexpr float kPi = 3.14159265358979323846f;
inline constexpr float kInvPi = 1.0f / kPi;
inline constexpr float kInfinity = std::numeric_limits<float>::infinity();
inline constexpr uint32_t kNone = 0xffffffffu;

inline float max_component(const Vec3& v) { return glm::max(v.x, glm::max(v.y, v.z)); }  // fmax would be a call
inline float luminance(const Rgb& c) { return 0.2126f * c.x + 0.7152f * c.y + 0.0722f * c.z; }
inline bool is_black(const Rgb& c) { return !(c.x > 0.0f || c.y > 0.0f || c.z > 0.0f); }
inline bool is_finite(const Vec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

/// Three columns and a translation: object to world and the like, relative to the scene's origin.
struct Affine {
  Vec3 x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1}, p{0, 0, 0};
  Vec3 point(const Vec3& v) const { return x * v.x + y * v.y + z * v.z + p; }
  Vec3 vector(const Vec3& v) const { return x * v.x + y * v.y + z * v.z; }
  /// Transposed linear part times v: with the inverse's Affine this carries normals.
  Vec3 transposed(const Vec3& v) const { return {glm::dot(x, v), glm::dot(y, v), glm::dot(z, v)}; }
};

struct Box {
  Vec3 lower{kInfinity}, upper{-kInfinity};
  void extend(const Vec3& v) { lower = glm::min(lower, v), upper = glm::max(upper, v); }
  void extend(const Box& b) { lower = glm::min(lower, b.lower), upper = glm::max(upper, b.upper); }
  bool empty() const { return !(lower.x <= upper.x); }
  bool contains(const Vec3& v) const {
    return v.x >= lower.x && v.y >= lower.y && v.z >= lower.z && v.x <= upper.x && v.y <= upper.y && v.z <= upper.z;
  }
  Vec3 center() const { return 0.5f * (lower + upper); }
  Vec3 size() const { return upper - lower; }
};

/// An orthonormal basis around a unit normal (Duff et al. 2017).
struct Frame {
  Vec3 t, b, n;
  explicit Frame(const Vec3& normal) : n(normal) {
    const float sign = std::copysign(1.0f, n.z);
    const float a = -1.0f / (sign + n.z), c = n.x * n.y * a;
    t = {1.0f + sign * n.x * n.x * a, sign * c, -sign * n.x};
    b = {c, sign + n.y * n.y * a, -n.y};
  }
  Frame(const Vec3& tangent, const Vec3& bitangent, const Vec3& normal) : t(tangent), b(bitangent), n(normal) {}
  Vec3 to_local(const Vec3& v) const { return {glm::dot(v, t), glm::dot(v, b), glm::dot(v, n)}; }
  Vec3 to_world(const Vec3& v) const { return t * v.x + b * v.y + n * v.z; }
};

}  // namespace afterglow
