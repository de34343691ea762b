// SPDX-License-Identifier: GPL-3.0-or-later
// What a place receives of virtual lights: their bounded geometry terms in columns (Debattista et al. 2009, (2), (3)),
// the terms' slopes (Ward and Heckbert 1992), and the rays that ask which are seen. Declared in virtual_lights.h.
#include <algorithm>
#include <cstring>

#include "base/lanes.h"
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
  rows.resize(size);
  for (size_t i = 0; i < size; ++i)
    rows[i] = {x[i],        y[i],        z[i],        nx[i],      ny[i],      nz[i],
               front[0][i], front[1][i], front[2][i], back[0][i], back[1][i], back[2][i]};
}

/// Four rows become four numbers of twelve columns at a time: a number at a time takes as long as what it spares.
void VirtualLightColumns::choose(std::span<const uint32_t> which, uint32_t chosen, LightColumns& out) const {
  using Four = float __attribute__((vector_size(16)));
  using Order = int __attribute__((vector_size(16)));
  constexpr Order kLow{0, 4, 1, 5}, kHigh{2, 6, 3, 7}, kFirst{0, 1, 4, 5}, kLast{2, 3, 6, 7};
  const uint32_t size = (chosen + 15) / 16 * 16;
  std::vector<float>* const columns[12] = {&out.x,        &out.y,       &out.z,        &out.nx,
                                           &out.ny,       &out.nz,      &out.front[0], &out.front[1],
                                           &out.front[2], &out.back[0], &out.back[1],  &out.back[2]};
  float* to[12];
  for (int c = 0; c < 12; ++c) {
    columns[c]->resize(size);
    to[c] = columns[c]->data();
  }
  for (uint32_t i = 0; i < chosen; i += 4)
    for (int part = 0; part < 12; part += 4) {
      Four row[4];
      for (int k = 0; k < 4; ++k) std::memcpy(&row[k], rows[which[i + k]].data() + part, sizeof(Four));
      const Four a = __builtin_shuffle(row[0], row[1], kLow), b = __builtin_shuffle(row[0], row[1], kHigh),
                 c = __builtin_shuffle(row[2], row[3], kLow), d = __builtin_shuffle(row[2], row[3], kHigh);
      const Four column[4] = {__builtin_shuffle(a, c, kFirst), __builtin_shuffle(a, c, kLast),
                              __builtin_shuffle(b, d, kFirst), __builtin_shuffle(b, d, kLast)};
      for (int k = 0; k < 4; ++k) std::memcpy(to[part + k] + i, &column[k], sizeof(Four));
    }
  for (float* column : to) std::fill(column + chosen, column + size, 0.0f);
  out.two_sided = two_sided;
}

void geometry_terms(const LightColumns& c, const Vec3& p, const Vec3& n, float bound, float* out, uint32_t first,
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
    const float nearness = 1.0f / d2;  // one division: they are what the loop waits for
    const float g = here * there * nearness * nearness * f;
    out[i] = two_sided ? g : std::max(g, 0.0f);
  }
}

namespace {

constexpr uint32_t kLanes = 8;
using Lanes = Eight;

Lanes lanes(const std::vector<float>& column, size_t first) { return load_eight(column.data() + first); }

/// Always in the same order.
Rgb total(const Lanes (&sums)[3]) {
  Rgb result;
  for (int c = 0; c < 3; ++c) {
    const Lanes& s = sums[c];
    result[c] = ((s[0] + s[4]) + (s[2] + s[6])) + ((s[1] + s[5]) + (s[3] + s[7]));
  }
  return result;
}

}  // namespace

LightSums sum_lights(const LightColumns& lights, const Vec3& p, const Frame& frame, float bound) {
  const float near = 0.8f * bound, scale = bound > 0.0f ? 1.0f / (0.4f * bound) : 0.0f;
  const Vec3 t = frame.t, b = frame.b, n = frame.n;
  const float least = lights.two_sided ? -kInfinity : 0.0f;
  const Lanes none = {}, one = none + 1.0f;
  Lanes light[3] = {}, step_t[3] = {}, step_b[3] = {}, turn_t[3] = {}, turn_b[3] = {};
  for (size_t i = 0; i < lights.padded(); i += kLanes) {
    const Lanes dx = lanes(lights.x, i) - p.x, dy = lanes(lights.y, i) - p.y, dz = lanes(lights.z, i) - p.z;
    const Lanes nx = lanes(lights.nx, i), ny = lanes(lights.ny, i), nz = lanes(lights.nz, i);
    const Lanes square = dx * dx + dy * dy + dz * dz, d2 = square > 1e-30f ? square : none + 1e-30f;
    const Lanes d = square_root(d2), nearness = 1.0f / d2;
    const Lanes here = dx * n.x + dy * n.y + dz * n.z, there = -(dx * nx + dy * ny + dz * nz);
    Lanes s = bound > 0.0f ? (d - near) * scale : one;
    s = s > 0.0f ? s : none;
    s = s < 1.0f ? s : one;
    const Lanes f = s * s * (3.0f - 2.0f * s), slope = 6.0f * s * (1.0f - s) * scale;  // of the bound
    const Lanes lit = (here > 0.0f) & (there > least) ? nearness * nearness : none;
    // Only the way to the light changes, by −step: cos of the place stays for steps along its plane.
    const Lanes facing = lit * f * here, turned = lit * f * there, term = facing * there;
    const Lanes nearer = lit * here * there * (4.0f * f - slope * d) * nearness;
    const Lanes along_t = dx * t.x + dy * t.y + dz * t.z, along_b = dx * b.x + dy * b.y + dz * b.z;
    const Lanes by_t = facing * (nx * t.x + ny * t.y + nz * t.z) + nearer * along_t;
    const Lanes by_b = facing * (nx * b.x + ny * b.y + nz * b.z) + nearer * along_b;
    for (int c = 0; c < 3; ++c) {
      Lanes shines = lanes(lights.front[c], i);
      if (lights.two_sided) shines = term > 0.0f ? shines : -lanes(lights.back[c], i);
      light[c] += term * shines;
      step_t[c] += by_t * shines, step_b[c] += by_b * shines;
      turn_t[c] += turned * along_t * shines, turn_b[c] += turned * along_b * shines;
    }
  }
  return {total(light), total(step_t), total(step_b), total(turn_t), total(turn_b)};
}

bool can_see(const Vec3& position, const Vec3& face_normal, const VirtualLight& light, bool front) {
  // What lies in one plane sees nothing of it: which side of it rounding puts each on is chance, and the way between
  // both sides of a flat wall would lead through it.
  const Vec3 way = light.position - position;
  const float above = glm::dot(way, light.face_normal) * (front ? -1.0f : 1.0f);
  return glm::dot(way, face_normal) > light.lift && above > light.lift;
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

void visibility(const WalkScene& walk, std::span<const Ray> rays, std::span<Rgb> out, RayCounts& counts) {
  if (walk.shown || walk.scene.effects.has(kTransparency)) {
    for (size_t i = 0; i < rays.size(); ++i) out[i] = visibility(walk, rays[i], counts);
    return;
  }
  counts.shadow += rays.size();
  const uint32_t hidden = walk.scene.rays.occluded(rays);
  for (size_t i = 0; i < rays.size(); ++i) out[i] = Rgb(hidden >> i & 1 ? 0.0f : 1.0f);
}

}  // namespace afterglow
