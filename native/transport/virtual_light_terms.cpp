// SPDX-License-Identifier: GPL-3.0-or-later
// What a place receives of virtual lights: their bounded geometry terms in columns (Debattista et al. 2009, (2), (3)),
// the terms' slopes (Ward and Heckbert 1992), and the rays that ask which are seen. Declared in virtual_lights.h.
#include <algorithm>

#include "transport/virtual_lights.h"

namespace afterglow {

void VirtualLightColumns::fill(std::vector<VirtualLight> from) {
  lights = std::move(from);
  count = uint32_t(lights.size());
  two_sided = false;
  const size_t size = (size_t(count) + 15) / 16 * 16;
  lights.resize(size);
  for (auto* column : {&x, &y, &z, &nx, &ny, &nz, &front[0], &front[1], &front[2], &back[0], &back[1], &back[2]})
    column->assign(size, 0.0f);
  for (size_t i = 0; i < size; ++i) {
    const VirtualLight& l = lights[i];
    x[i] = l.position.x, y[i] = l.position.y, z[i] = l.position.z;
    if (l.black()) continue;  // no normal: no cosine, no light
    nx[i] = l.normal.x, ny[i] = l.normal.y, nz[i] = l.normal.z;
    for (int c = 0; c < 3; ++c) front[c][i] = l.front[c], back[c][i] = l.back[c];
    two_sided |= !is_black(l.back);
  }
}

void geometry_terms(const VirtualLightColumns& c, const Vec3& p, const Vec3& n, float bound, float* out, uint32_t first,
                    uint32_t count) {
  const float near = 0.8f * bound, scale = bound > 0.0f ? 1.0f / (0.4f * bound) : 0.0f;
  const float *x = c.x.data() + first, *y = c.y.data() + first, *z = c.z.data() + first, *nx = c.nx.data() + first,
              *ny = c.ny.data() + first, *nz = c.nz.data() + first;
  const bool two_sided = c.two_sided;
  for (size_t i = 0; i < count; ++i) {
    const float dx = x[i] - p.x, dy = y[i] - p.y, dz = z[i] - p.z;
    const float d2 = std::max(dx * dx + dy * dy + dz * dz, 1e-30f);
    const float here = std::max(dx * n.x + dy * n.y + dz * n.z, 0.0f);
    const float there = -(dx * nx[i] + dy * ny[i] + dz * nz[i]);
    float t = bound > 0.0f ? (std::sqrt(d2) - near) * scale : 1.0f;
    t = std::min(std::max(t, 0.0f), 1.0f);
    const float f = t * t * (3.0f - 2.0f * t);
    const float g = here * there / d2 / d2 * f;
    out[i] = two_sided ? g : std::max(g, 0.0f);
  }
}

void geometry_slopes(const VirtualLightColumns& c, const Vec3& p, const Frame& frame, float bound,
                     GeometrySlopes& out) {
  const float near = 0.8f * bound, scale = bound > 0.0f ? 1.0f / (0.4f * bound) : 0.0f;
  const Vec3 t = frame.t, b = frame.b, n = frame.n;
  const size_t size = c.padded();
  out.resize(size);
  const float *x = c.x.data(), *y = c.y.data(), *z = c.z.data(), *nx = c.nx.data(), *ny = c.ny.data(),
              *nz = c.nz.data();
  float *step_t = out.step_t.data(), *step_b = out.step_b.data(), *turn_t = out.turn_t.data(),
        *turn_b = out.turn_b.data();
  const float least = c.two_sided ? -kInfinity : 0.0f;
#pragma GCC ivdep
  for (size_t i = 0; i < size; ++i) {
    const float dx = x[i] - p.x, dy = y[i] - p.y, dz = z[i] - p.z;
    const float d2 = std::max(dx * dx + dy * dy + dz * dz, 1e-30f), d = std::sqrt(d2);
    const float here = dx * n.x + dy * n.y + dz * n.z;
    const float there = -(dx * nx[i] + dy * ny[i] + dz * nz[i]);
    float s = bound > 0.0f ? (d - near) * scale : 1.0f;
    s = std::min(std::max(s, 0.0f), 1.0f);
    const float f = s * s * (3.0f - 2.0f * s), slope = 6.0f * s * (1.0f - s) * scale;  // of the bound
    const float over_d4 = 1.0f / d2 / d2, above = here > 0.0f ? over_d4 : 0.0f, lit = there > least ? above : 0.0f;
    // Only the way to the light changes, by −step: cos of the place stays for steps along its plane.
    const float facing = lit * f * here, nearer = lit * here * there * (4.0f * f / d2 - slope / d);
    const float along_t = dx * t.x + dy * t.y + dz * t.z, along_b = dx * b.x + dy * b.y + dz * b.z;
    step_t[i] = facing * (nx[i] * t.x + ny[i] * t.y + nz[i] * t.z) + nearer * along_t;
    step_b[i] = facing * (nx[i] * b.x + ny[i] * b.y + nz[i] * b.z) + nearer * along_b;
    turn_t[i] = lit * f * there * along_t;
    turn_b[i] = lit * f * there * along_b;
  }
}

bool can_see(const Vec3& position, const Vec3& face_normal, const VirtualLight& light, bool front) {
  const Vec3 way = light.position - position;
  return glm::dot(way, face_normal) > 0.0f && (glm::dot(way, light.face_normal) < 0.0f) == front;
}

Ray visibility_ray(const Vec3& from, const VirtualLight& light) {
  const float side = glm::dot(from - light.position, light.face_normal) < 0.0f ? -light.lift : light.lift;
  const Vec3 way = light.position + side * light.face_normal - from;
  const float distance = glm::length(way);
  Ray ray;
  ray.origin = from;
  ray.direction = distance > 0.0f ? way / distance : Vec3(0, 0, 1);
  ray.t_max = distance * (1.0f - 4e-7f);
  ray.mask = kVisibleDiffuse;
  return ray;
}

Rgb visibility(const WalkScene& walk, const Ray& ray, RayCounts& counts) {
  counts.shadow++;
  if (!walk.shown && !walk.scene.effects.has(kTransparency)) return Rgb(walk.scene.rays.occluded(ray) ? 0.0f : 1.0f);
  PathContext context;
  context.depth = 1;
  return transmittance(walk, ray, context, counts);
}

}  // namespace afterglow
