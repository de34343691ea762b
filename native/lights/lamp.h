// SPDX-License-Identifier: GPL-3.0-or-later
// A light object made ready for kernels: point, spot, sun and area lights as Blender's users know them (powers in watts
// are spread over 4π sr for points, over π for areas; a sun's strength is the irradiance that it causes). How to sample
// one, the density of that, and where a ray meets it.
#pragma once

#include <optional>

#include "lights/shapes.h"
#include "scene/tables.h"

namespace afterglow {

enum class LampShape : uint8_t {
  kPoint,      // no extent: delta
  kSphere,     // point or spot with a radius, true sphere
  kDisk,       // point or spot with a radius and soft falloff: a disk that always faces the receiver
  kRectangle,  // area light
  kEllipse,    // area light
  kDirection,  // sun without an angle: delta
  kCone,       // sun
};

struct Lamp {
  LampShape shape = LampShape::kPoint;
  bool spot = false, spread = false, has_graph = false, cast_shadow = true;
  bool hittable = false;    // rays can run into it, so that its samples take part in MIS
  bool legacy = false;      // a spot or sun as Blender before 4.0 had it
  bool orthogonal = false;  // a rectangle's edges are at right angles
  uint32_t visibility = kVisibleAll;
  Handle handle = 0;
  Vec3 position{0.0f};        // area: its centre
  Vec3 axis{0, 0, -1};        // unit, where it looks
  Vec3 edge_u{0}, edge_v{0};  // area: full edges (ellipse: full axes)
  float radius = 0.0f, area = 0.0f;
  float one_minus_cos = 0.0f;               // sun
  Rgb radiance{0.0f};                       // point: intensity; direction: irradiance
  Vec3 local_x{0}, local_y{0}, local_z{0};  // rows of the direction's way to local space
  float cos_spot = -1.0f, inverse_blend = 0.0f;
  float tan_half_spread = 0.0f, spread_scale = 1.0f;

  bool infinite() const { return shape == LampShape::kDirection || shape == LampShape::kCone; }
  bool is_delta() const { return shape == LampShape::kPoint || shape == LampShape::kDirection; }
};

/// Relative to `origin`. Nothing: it gives no light (black, collapsed); with `problem` set: it is broken.
std::optional<Lamp> make_lamp(const Light&, Handle, const DVec3& origin, std::string& problem);

struct LampSample {
  Vec3 direction{0.0f};
  float distance = kInfinity;
  Rgb radiance{0.0f};    // without the graph's factor
  float density = 0.0f;  // solid angle; delta: 1
  Vec2 uv{0.0f};
};

/// normal is only asked inside sphere lights. False: no light from it arrives here.
bool sample_lamp(const Lamp&, const Vec3& position, const Vec3& normal, const Vec2& u, LampSample&);

/// Where a ray meets the lamp, and what it sends back along it; density: of sample_lamp() at the ray's start.
struct LampHit {
  float t = kInfinity;
  Rgb radiance{0.0f};
  Vec2 uv{0.0f};
};
bool intersect_lamp(const Lamp&, const Vec3& origin, const Vec3& direction, float t_min, float t_max, LampHit&);
/// For a direction that does meet the lamp at distance t.
float lamp_density(const Lamp&, const Vec3& position, const Vec3& normal, const Vec3& direction, float t);

/// Radiance of a sun towards a direction within its disk, without the graph's factor.
Rgb sun_radiance(const Lamp&, const Vec3& direction);

/// A direction from the lamp in its local frame, for its graph.
Vec3 lamp_local(const Lamp&, const Vec3& from_lamp);

}  // namespace afterglow
