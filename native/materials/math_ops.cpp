// SPDX-License-Identifier: GPL-3.0-or-later
// What the Math, Vector Math and Mix nodes compute. Undefined results (division by zero, roots of negative numbers) are
// 0, as Blender's users know it.
#include <algorithm>

#include "materials/color_ops.h"
#include "materials/microfacet.h"
#include "materials/program.h"

namespace afterglow {
namespace {

float divide(float a, float b) { return b != 0.0f ? a / b : 0.0f; }
float modulo(float a, float b) { return b != 0.0f ? std::fmod(a, b) : 0.0f; }
float floored_modulo(float a, float b) { return b != 0.0f ? a - std::floor(a / b) * b : 0.0f; }
float wrap(float v, float high, float low) {
  const float range = high - low;
  return range != 0.0f ? v - range * std::floor((v - low) / range) : low;
}
float power(float a, float b) {
  if (a < 0.0f && b != std::floor(b)) return 0.0f;
  return b == 0.0f ? 1.0f : std::pow(a, b);
}
float pingpong(float v, float scale) {
  if (scale == 0.0f) return 0.0f;
  const float t = (v - scale) / (scale * 2.0f);
  return std::fabs((t - std::floor(t)) * scale * 2.0f - scale);
}
float smooth_min(float a, float b, float k) {
  if (k == 0.0f) return std::fmin(a, b);
  const float h = std::fmax(k - std::fabs(a - b), 0.0f) / k;
  return std::fmin(a, b) - h * h * h * k * (1.0f / 6.0f);
}
float sign(float a) { return a > 0.0f ? 1.0f : (a < 0.0f ? -1.0f : 0.0f); }

}  // namespace

float run_math(uint32_t operation, float a, float b, float c) {
  switch (operation) {  // the order of kMathOperations in nodes_math.cpp
    case 0:
      return a + b;
    case 1:
      return a - b;
    case 2:
      return a * b;
    case 3:
      return divide(a, b);
    case 4:
      return a * b + c;
    case 5:
      return power(a, b);
    case 6:
      return a > 0.0f && b > 0.0f ? divide(std::log(a), std::log(b)) : 0.0f;
    case 7:
      return a > 0.0f ? std::sqrt(a) : 0.0f;
    case 8:
      return a > 0.0f ? 1.0f / std::sqrt(a) : 0.0f;
    case 9:
      return std::fabs(a);
    case 10:
      return std::exp(a);
    case 11:
      return std::fmin(a, b);
    case 12:
      return std::fmax(a, b);
    case 13:
      return a < b ? 1.0f : 0.0f;
    case 14:
      return a > b ? 1.0f : 0.0f;
    case 15:
      return sign(a);
    case 16:
      return a == b || std::fabs(a - b) <= std::fmax(c, 1e-5f) ? 1.0f : 0.0f;
    case 17:
      return smooth_min(a, b, c);
    case 18:
      return -smooth_min(-a, -b, c);
    case 19:
      return std::floor(a + 0.5f);
    case 20:
      return std::floor(a);
    case 21:
      return std::ceil(a);
    case 22:
      return std::trunc(a);
    case 23:
      return a - std::floor(a);
    case 24:
      return modulo(a, b);
    case 25:
      return floored_modulo(a, b);
    case 26:
      return wrap(a, b, c);
    case 27:
      return std::floor(divide(a, b)) * b;
    case 28:
      return pingpong(a, b);
    case 29:
      return std::sin(a);
    case 30:
      return std::cos(a);
    case 31:
      return std::tan(a);
    case 32:
      return std::asin(std::clamp(a, -1.0f, 1.0f));
    case 33:
      return std::acos(std::clamp(a, -1.0f, 1.0f));
    case 34:
      return std::atan(a);
    case 35:
      return std::atan2(a, b);
    case 36:
      return std::sinh(a);
    case 37:
      return std::cosh(a);
    case 38:
      return std::tanh(a);
    case 39:
      return a * (kPi / 180.0f);
    case 40:
      return a * (180.0f / kPi);
    default:
      return a;
  }
}

void run_vector_math(uint32_t operation, const Vec3& a, const Vec3& b, const Vec3& c, float scale, Vec3& v, float& s) {
  const auto each = [&](auto f) { return Vec3(f(a.x, b.x, c.x), f(a.y, b.y, c.y), f(a.z, b.z, c.z)); };
  const auto unit = [](const Vec3& x) {
    const float length = glm::length(x);
    return length > 0.0f ? x / length : Vec3(0.0f);
  };
  v = Vec3(0.0f), s = 0.0f;
  switch (operation) {  // the order of kVectorOperations in nodes_math.cpp
    case 0:
      v = a + b;
      break;
    case 1:
      v = a - b;
      break;
    case 2:
      v = a * b;
      break;
    case 3:
      v = each([](float x, float y, float) { return divide(x, y); });
      break;
    case 4:
      v = a * b + c;
      break;
    case 5:
      v = glm::cross(a, b);
      break;
    case 6: {
      const float square = glm::dot(b, b);
      v = square != 0.0f ? b * (glm::dot(a, b) / square) : Vec3(0.0f);
      break;
    }
    case 7: {
      const Vec3 n = unit(b);
      v = a - n * (2.0f * glm::dot(a, n));
      break;
    }
    case 8: {
      const Vec3 n = unit(b);
      const float d = glm::dot(n, a), k = 1.0f - scale * scale * (1.0f - d * d);
      v = k < 0.0f ? Vec3(0.0f) : a * scale - n * (scale * d + std::sqrt(k));
      break;
    }
    case 9:
      v = glm::dot(c, b) < 0.0f ? a : -a;
      break;
    case 10:
      s = glm::dot(a, b);
      break;
    case 11:
      s = glm::length(a - b);
      break;
    case 12:
      s = glm::length(a);
      break;
    case 13:
      v = a * scale;
      break;
    case 14:
      v = unit(a);
      break;
    case 15:
      v = glm::abs(a);
      break;
    case 16:
      v = each([](float x, float y, float) { return power(x, y); });
      break;
    case 17:
      v = each([](float x, float, float) { return sign(x); });
      break;
    case 18:
      v = glm::min(a, b);
      break;
    case 19:
      v = glm::max(a, b);
      break;
    case 20:
      v = glm::floor(a);
      break;
    case 21:
      v = glm::ceil(a);
      break;
    case 22:
      v = a - glm::floor(a);
      break;
    case 23:
      v = each([](float x, float y, float) { return modulo(x, y); });
      break;
    case 24:
      v = each([](float x, float y, float z) { return wrap(x, y, z); });
      break;
    case 25:
      v = each([](float x, float y, float) { return std::floor(divide(x, y)) * y; });
      break;
    case 26:
      v = {std::sin(a.x), std::sin(a.y), std::sin(a.z)};
      break;
    case 27:
      v = {std::cos(a.x), std::cos(a.y), std::cos(a.z)};
      break;
    case 28:
      v = {std::tan(a.x), std::tan(a.y), std::tan(a.z)};
      break;
    case 29:
      v = glm::floor(a + 0.5f);
      break;
    default:
      v = a;
  }
}

Rgb blend(uint32_t mode, float t, const Rgb& a, const Rgb& b) {
  const float m = 1.0f - t;
  const auto each = [&](auto f) { return Rgb(f(a.x, b.x), f(a.y, b.y), f(a.z, b.z)); };
  switch (mode) {  // the order of kBlendModes in nodes_math.cpp
    case 1:
      return lerp(a, glm::min(a, b), t);
    case 2:
      return lerp(a, a * b, t);
    case 3:  // burn
      return each([&](float x, float y) {
        const float low = m + t * y;
        return low <= 0.0f ? 0.0f : saturate(1.0f - (1.0f - x) / low);
      });
    case 4:
      return lerp(a, glm::max(a, b), t);
    case 5:
      return Rgb(1.0f) - (Rgb(m) + t * (Rgb(1.0f) - b)) * (Rgb(1.0f) - a);
    case 6:  // dodge
      return each([&](float x, float y) {
        if (x == 0.0f) return x;
        const float low = 1.0f - t * y;
        return low <= 0.0f ? 1.0f : std::fmin(x / low, 1.0f);
      });
    case 7:
      return a + b * t;
    case 8:  // overlay
      return each([&](float x, float y) {
        return x < 0.5f ? x * (m + 2.0f * t * y) : 1.0f - (m + 2.0f * t * (1.0f - y)) * (1.0f - x);
      });
    case 9:  // soft light
      return each([&](float x, float y) {
        const float screen = 1.0f - (1.0f - y) * (1.0f - x);
        return m * x + t * ((1.0f - x) * y * x + x * screen);
      });
    case 10:
      return a + t * (2.0f * b - Rgb(1.0f));
    case 11:
      return lerp(a, glm::abs(a - b), t);
    case 12:
      return glm::max(lerp(a, a + b - 2.0f * a * b, t), Rgb(0.0f));
    case 13:
      return a - b * t;
    case 14:
      return each([&](float x, float y) { return y != 0.0f ? m * x + t * x / y : x; });
    case 15:
    case 17: {  // hue; colour
      const Vec3 hb = rgb_to_hsv(b);
      if (hb.y == 0.0f) return a;
      const Vec3 ha = rgb_to_hsv(a);
      return lerp(a, hsv_to_rgb({hb.x, mode == 15 ? ha.y : hb.y, ha.z}), t);
    }
    case 16: {  // saturation
      const Vec3 ha = rgb_to_hsv(a);
      return ha.y == 0.0f ? a : hsv_to_rgb({ha.x, m * ha.y + t * rgb_to_hsv(b).y, ha.z});
    }
    case 18: {  // value
      const Vec3 ha = rgb_to_hsv(a);
      return hsv_to_rgb({ha.x, ha.y, m * ha.z + t * rgb_to_hsv(b).z});
    }
    default:
      return lerp(a, b, t);
  }
}

}  // namespace afterglow
