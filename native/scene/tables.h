// SPDX-License-Identifier: GPL-3.0-or-later
// The scene's plain tables: what a mesh, an instance, a light, the world and the camera are. No behaviour, no
// rendering: scene.h edits them, rays/, materials/ and lights/ build from them what a render needs.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/math.h"
#include "scene/graph.h"

namespace afterglow {

using Handle = uint32_t;  // 1, 2, 3, …; never reused within a scene; 0 is none

enum Visibility : uint32_t {
  kVisibleCamera = 1,
  kVisibleDiffuse = 2,
  kVisibleGlossy = 4,
  kVisibleTransmission = 8,
  kVisibleShadow = 16,
  kVisibleVolume = 32,
  kVisibleAll = 63,
};

struct UvMap {
  std::string name;
  std::vector<Vec2> values;
};  // one a corner

enum class Domain : uint8_t { kVertex, kCorner, kFace, kMesh };
struct Attribute {
  std::string name;
  Domain domain;
  uint8_t width;
  std::vector<float> values;
};

struct Mesh {
  std::string name;
  std::vector<Vec3> positions;           // V; Embree reads them in place: capacity for 16 bytes more than used
  std::vector<Vec3> previous_positions;  // V or none
  std::vector<uint32_t> triangles;       // 3 T vertex indices
  std::vector<uint32_t> corners;         // 3 T indices into per-corner arrays; none: 3 t + k
  std::vector<Vec3> corner_normals;      // C or none, unit, object space
  std::vector<Vec3> vertex_normals;      // V or none
  std::vector<uint8_t> smooth;           // T or none (then smooth where normals are given)
  std::vector<uint16_t> slots;           // T material slots, or none: all 0
  std::vector<uint32_t> faces;           // T or none
  std::vector<UvMap> uvs;
  uint32_t active_uv = kNone;
  std::vector<Attribute> attributes;
  uint32_t active_color = kNone;
  Box bounds;
  uint32_t triangle_count() const { return uint32_t(triangles.size() / 3); }
};

struct Instance {
  std::string name;
  Handle mesh = 0;
  DMat4 transform{1.0};  // object to world
  std::optional<DMat4> previous;
  std::vector<Handle> materials;  // one a slot
  uint32_t visibility = kVisibleAll;
  int32_t object_index = 0;
  Vec4 color{1.0f};
  float random = 0.0f;
  bool holdout = false, shadow_catcher = false;
};

struct Material {
  std::string name;
  Graph graph;
  int32_t pass_index = 0;
  bool emission_sampling = true, backface_culling = false;
};

enum class LightKind : uint8_t { kPoint, kSpot, kSun, kArea };
enum class AreaShape : uint8_t { kSquare, kRectangle, kDisk, kEllipse };
struct Light {
  std::string name;
  LightKind kind = LightKind::kPoint;
  DMat4 transform{1.0};
  Rgb color{1.0f};
  float power = 0.0f;  // W; sun: W/m²
  float radius = 0.0f, angle = 0.0f, spot_size = 0.0f, spot_blend = 0.0f, spread = kPi;
  AreaShape shape = AreaShape::kSquare;
  Vec2 size{1.0f};
  std::optional<Graph> graph;
  uint32_t visibility = kVisibleAll;
  bool cast_shadow = true, multiple_importance = true, soft_falloff = true;
  int32_t version = 2;  // 1: what spots and suns meant before Blender 4.0
};

struct World {
  std::optional<Graph> graph;  // none: black
  uint32_t visibility = kVisibleAll;
  int32_t importance_resolution = 0;  // 0: chosen
};

enum class CameraKind : uint8_t { kPerspective, kOrthographic, kPanorama };
struct Camera {
  CameraKind kind = CameraKind::kPerspective;
  DMat4 transform{1.0};       // camera to world; looks along −z
  Vec4 window{-1, 1, -1, 1};  // left, right, bottom, top
  Vec2 clip{0.0f, kInfinity};
  float aperture_radius = 0.0f, focus_distance = 1.0f, aperture_rotation = 0.0f, aperture_ratio = 1.0f;
  int32_t aperture_blades = 0;
  Vec4 panorama{-kPi, kPi, -0.5f * kPi, 0.5f * kPi};
};

/// Where an image comes from: a path, an encoded file in memory, or pixels (row 0 at the bottom).
struct ImageSource {
  std::string path;
  std::vector<uint8_t> encoded;
  std::vector<float> pixels;  // height × width × channels
  std::vector<uint8_t> byte_pixels;
  uint32_t width = 0, height = 0, channels = 0;
};
struct Image {
  std::string name, colorspace = "sRGB", alpha = "straight";
  std::map<int, std::shared_ptr<ImageSource>> tiles;  // 1001 alone: no UDIM
};

}  // namespace afterglow
