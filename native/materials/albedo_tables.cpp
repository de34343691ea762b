// SPDX-License-Identifier: GPL-3.0-or-later
// Tables of directional albedo, made on first use by quadrature over visible normals: a few ten milliseconds once,
// instead of a binary blob in the repository. Kulla and Conty 2017; Turquin 2019.
#include "materials/albedo_tables.h"

#include <vector>

#include "materials/microfacet.h"

namespace afterglow {
namespace {

constexpr int kSide = 32;  // two-dimensional tables
constexpr int kCube = 16;  // three-dimensional ones
constexpr int kPlanePoints = 1024, kCubePoints = 384;
constexpr float kLeastZ = 0.01f;  // Fresnel tables: sqrt(|ior − 1| / (ior + 1)) from here

/// Points of the additive recurrence with the plastic number (Roberts 2018).
Vec2 point(int k) {
  const double x = 0.5 + 0.7548776662466927 * k, y = 0.5 + 0.5698402909980532 * k;
  return {float(x - std::floor(x)), float(y - std::floor(y))};
}

/// Tables are dense where albedo changes quickly: near grazing.
float cosine_at(int k, int side) { return std::fmax(sqr(float(k) / float(side - 1)), 1e-3f); }
float axis_of_cosine(float cosine) { return std::sqrt(saturate(cosine)); }
/// 0 … 1 over all indices above 1: 1 is 0, 2 is 0.577, infinity 1.
float axis_of_ior(float ior) { return std::sqrt(std::fabs(ior - 1.0f) / (ior + 1.0f)); }
float ior_at(float axis) {
  const float f = sqr(std::fmin(std::fmax(axis, kLeastZ), 0.995f));
  return (1.0f + f) / (1.0f - f);
}

/// Calls visit(o·h, G2/G1 of the reflection or 0, h, o) over the visible normals.
template <class Visit>
void integrate(float cosine, float alpha, int points, Visit visit) {
  const Vec3 o(std::sqrt(1.0f - cosine * cosine), 0.0f, cosine);
  for (int k = 0; k < points; ++k) visit(o, ggx_sample(o, alpha, alpha, point(k)));
}

float weight(const Vec3& o, const Vec3& i, float alpha) {
  const float lo = ggx_lambda(o, alpha, alpha), li = ggx_lambda(i, alpha, alpha);
  return (1.0f + lo) / (1.0f + lo + li);
}

struct Plane {
  std::vector<float> values;
  float at(float x, float y, int side) const {
    const float fx = saturate(x) * float(side - 1), fy = saturate(y) * float(side - 1);
    const int ix = std::min(int(fx), side - 2), iy = std::min(int(fy), side - 2);
    const float tx = fx - float(ix), ty = fy - float(iy);
    const float* row = values.data() + iy * side + ix;
    return (row[0] * (1 - tx) + row[1] * tx) * (1 - ty) + (row[side] * (1 - tx) + row[side + 1] * tx) * ty;
  }
};

struct Cube {
  std::vector<float> values;
  float at(float x, float y, float z) const {
    const float fz = saturate(z) * float(kCube - 1);
    const int iz = std::min(int(fz), kCube - 2);
    const float tz = fz - float(iz);
    const auto slice = [&](int k) {
      const float fx = saturate(x) * float(kCube - 1), fy = saturate(y) * float(kCube - 1);
      const int ix = std::min(int(fx), kCube - 2), iy = std::min(int(fy), kCube - 2);
      const float tx = fx - float(ix), ty = fy - float(iy);
      const float* row = values.data() + (k * kCube + iy) * kCube + ix;
      return (row[0] * (1 - tx) + row[1] * tx) * (1 - ty) + (row[kCube] * (1 - tx) + row[kCube + 1] * tx) * ty;
    };
    return slice(iz) * (1.0f - tz) + slice(iz + 1) * tz;
  }
};

float alpha_at(int k, int side) { return std::fmax(sqr(float(k) / float(side - 1)), 1e-3f); }

struct Reflection {
  Plane albedo;
  std::vector<float> mean;
  Reflection() : mean(kSide) {
    for (int r = 0; r < kSide; ++r) {
      const float alpha = alpha_at(r, kSide);
      for (int c = 0; c < kSide; ++c) {
        float sum = 0.0f;
        integrate(cosine_at(c, kSide), alpha, kPlanePoints, [&](const Vec3& o, const Vec3& h) {
          const Vec3 i = h * (2.0f * glm::dot(o, h)) - o;
          if (i.z > 0.0f) sum += weight(o, i, alpha);
        });
        albedo.values.push_back(std::fmin(sum / kPlanePoints, 1.0f));
      }
    }
    for (int r = 0; r < kSide; ++r) {
      for (int k = 0; k < 64; ++k) {  // ∫ 2 E(c) c dc
        const float cosine = (float(k) + 0.5f) / 64.0f;
        mean[r] += albedo.at(axis_of_cosine(cosine), float(r) / (kSide - 1), kSide) * 2.0f * cosine / 64.0f;
      }
    }
  }
};

/// As Blender reckons it: every visible normal counts the same, those that reflect below the surface as nothing.
struct Share {
  Cube cube;
  Share() {
    for (int z = 0; z < kCube; ++z) {
      const float ior = ior_at(float(z) / (kCube - 1)), start = f0_from_ior(ior);
      for (int r = 0; r < kCube; ++r) {
        const float alpha = alpha_at(r, kCube);
        for (int c = 0; c < kCube; ++c) {
          float sum = 0.0f;
          integrate(std::fmax(float(c) / (kCube - 1), 1e-3f), alpha, kPlanePoints, [&](const Vec3& o, const Vec3& h) {
            const float oh = glm::dot(o, h);
            const Vec3 i = h * (2.0f * oh) - o;
            if (i.z > 0.0f) sum += saturate((fresnel_dielectric(oh, ior) - start) / (1.0f - start));
          });
          cube.values.push_back(sum / kPlanePoints);
        }
      }
    }
  }
};

struct Glass {
  Cube cube;
  Plane mean;  // roughness, index
  explicit Glass(bool inside) {
    for (int z = 0; z < kCube; ++z) {
      const float outer = ior_at(float(z) / (kCube - 1)), ior = inside ? 1.0f / outer : outer;
      for (int r = 0; r < kCube; ++r) {
        const float alpha = alpha_at(r, kCube);
        for (int c = 0; c < kCube; ++c) {
          float sum = 0.0f;
          integrate(cosine_at(c, kCube), alpha, kCubePoints, [&](const Vec3& o, const Vec3& h) {
            const float oh = glm::dot(o, h), f = fresnel_dielectric(oh, ior);
            const Vec3 i = h * (2.0f * oh) - o;
            if (i.z > 0.0f) sum += f * weight(o, i, alpha);
            const float cos2 = 1.0f - (1.0f - oh * oh) / sqr(ior);
            if (cos2 <= 0.0f) return;
            const Vec3 t = h * (oh / ior - std::sqrt(cos2)) - o / ior;
            if (t.z < 0.0f) sum += (1.0f - f) * weight(o, t, alpha);
          });
          cube.values.push_back(std::fmin(sum / kCubePoints, 1.0f));
        }
      }
    }
    for (int z = 0; z < kCube; ++z) {
      for (int r = 0; r < kCube; ++r) {
        float sum = 0.0f;
        for (int k = 0; k < 32; ++k) {
          const float cosine = (float(k) + 0.5f) / 32.0f, step = 1.0f / float(kCube - 1);
          sum += cube.at(axis_of_cosine(cosine), float(r) * step, float(z) * step) * 2.0f * cosine / 32.0f;
        }
        mean.values.push_back(sum);
      }
    }
  }
};

const Reflection& reflection() {
  static const Reflection table;
  return table;
}

}  // namespace

float ggx_albedo(float cosine, float roughness) {
  return reflection().albedo.at(axis_of_cosine(cosine), roughness, kSide);
}

float ggx_mean_albedo(float roughness) {
  const float f = saturate(roughness) * (kSide - 1);
  const int k = std::min(int(f), kSide - 2);
  const std::vector<float>& mean = reflection().mean;
  return mean[k] + (mean[k + 1] - mean[k]) * (f - float(k));
}

float schlick_share(float cosine, float roughness, float ior) {
  static const Share table;
  return table.cube.at(cosine, roughness, axis_of_ior(std::fmax(ior, 1.0f / ior)));
}

namespace {

const Glass& glass(float ior) {
  static const Glass entering(false), leaving(true);
  return ior >= 1.0f ? entering : leaving;
}

}  // namespace

float glass_albedo(float cosine, float roughness, float ior) {
  return glass(ior).cube.at(axis_of_cosine(cosine), roughness, axis_of_ior(std::fmax(ior, 1.0f / ior)));
}

float glass_mean_albedo(float roughness, float ior) {
  return glass(ior).mean.at(roughness, axis_of_ior(std::fmax(ior, 1.0f / ior)), kCube);
}

}  // namespace afterglow
