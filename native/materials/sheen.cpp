// SPDX-License-Identifier: GPL-3.0-or-later
// Sheen as a linearly transformed cosine (Zeltner, Burley and Chiang 2022): see sheen.h.
#include "materials/sheen.h"

#include <algorithm>

#include "materials/sheen_table.h"

namespace afterglow {
namespace {

constexpr float kLeastRoughness = 0.01f;

/// The frame whose x axis lies in the plane of normal and view: the transform's coefficients are given there.
Frame view_frame(const Vec3& normal, const Vec3& outgoing) {
  const Vec3 side = outgoing - normal * glm::dot(normal, outgoing);
  const float length = glm::length(side);
  if (!(length > 1e-6f)) return Frame(normal);
  const Vec3 x = side / length;
  return Frame(x, glm::cross(normal, x), normal);
}

}  // namespace

float sheen_albedo(float cosine, float roughness) {
  const float x = saturate(cosine) * (kSheenColumns - 1), y = saturate(roughness) * (kSheenRows - 1);
  const int ix = std::min(int(x), kSheenColumns - 2), iy = std::min(int(y), kSheenRows - 2);
  const float tx = x - float(ix), ty = y - float(iy);
  const float *low = kSheenAlbedo[iy] + ix, *high = kSheenAlbedo[iy + 1] + ix;
  return (low[0] * (1 - tx) + low[1] * tx) * (1 - ty) + (high[0] * (1 - tx) + high[1] * tx) * ty;
}

void sheen_setup(Lobe& lobe, float cosine, float roughness) {
  const float c = saturate(cosine), r = std::fmin(std::fmax(roughness, kLeastRoughness), 1.0f);
  lobe.alpha_x = (2.58126f * c + 0.813703f * r) * r / (1.0f + 0.310327f * c * c + 2.60994f * c * r);
  lobe.alpha_y = std::sqrt(1.0f - c) * (r - 1.0f) * r * r * r /
                 (0.0000254053f + 1.71228f * c - 1.71506f * c * r + 1.34174f * r * r);
}

float sheen_density(const Lobe& lobe, const Vec3& outgoing, const Vec3& incoming) {
  const Vec3 w = view_frame(lobe.normal, outgoing).to_local(incoming);
  if (w.z <= 0.0f) return 0.0f;
  const Vec3 plain(lobe.alpha_x * w.x + lobe.alpha_y * w.z, lobe.alpha_x * w.y, w.z);
  return kInvPi * w.z * sqr(lobe.alpha_x / glm::dot(plain, plain));
}

Vec3 sheen_sample(const Lobe& lobe, const Vec3& outgoing, const Vec2& u) {
  const float r = std::sqrt(u.x), phi = 2.0f * kPi * u.y, z = std::sqrt(std::fmax(0.0f, 1.0f - u.x));
  const Vec3 w((r * std::cos(phi) - lobe.alpha_y * z) / lobe.alpha_x, r * std::sin(phi) / lobe.alpha_x, z);
  return view_frame(lobe.normal, outgoing).to_world(glm::normalize(w));
}

}  // namespace afterglow
