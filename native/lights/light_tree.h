// SPDX-License-Identifier: GPL-3.0-or-later
// Chooses one of many lights in proportion to an estimate of the irradiance that each causes (Conty Estevez and Kulla
// 2018, "Importance Sampling of Many Lights with Adaptive Tree Splitting"): a hierarchy of boxes with cones of
// directions; a handful of lights are one leaf and so are chosen by their own estimates.
#pragma once

#include <span>
#include <vector>

#include "base/math.h"

namespace afterglow {

/// What is known of one light or of a group: where, towards where, how strong at most.
struct LightBounds {
  Box box;
  Vec3 axis{0, 0, 1};
  float cos_normals = 1.0f;   // half angle of the cone of the emitters' normals; −1: all directions
  float cos_emission = 0.0f;  // half angle beyond a normal into which light leaves
  float intensity = 0.0f;     // the greatest radiant intensity, luminance (W/sr)
  bool two_sided = false;
};

LightBounds united(const LightBounds&, const LightBounds&);

/// An estimate of the irradiance at a point; 0 only where no light can arrive. normal 0: from all sides.
float light_importance(const LightBounds&, const Vec3& position, const Vec3& normal);

class LightTree {
 public:
  void build(std::span<const LightBounds> lights);
  uint32_t size() const { return uint32_t(lights_.size()); }
  size_t bytes() const;

  /// The estimate for all lights together, to weigh the tree against lights at infinity.
  float importance(const Vec3& position, const Vec3& normal) const;
  /// A light's index, or kNone where none can shine. u is used up.
  uint32_t sample(const Vec3& position, const Vec3& normal, float u, float& probability) const;
  /// The probability with which sample() returns this light.
  float probability(uint32_t light, const Vec3& position, const Vec3& normal) const;

 private:
  static constexpr uint32_t kLeafSize = 8, kSingleLeaf = 16;
  /// Children stand side by side: first, first + 1. A leaf holds lights_[first, first + count).
  struct Node {
    LightBounds bounds;
    uint32_t first = 0, count = 0, parent = kNone;
  };
  /// What a leaf's estimates need, one array a value, so that eight lights are weighed at once.
  struct Columns {
    std::vector<float> center_x, center_y, center_z, radius2, axis_x, axis_y, axis_z, cos_normals, sin_normals,
        cos_emission, intensity, two_sided;
    void fill(std::span<const LightBounds>);
    size_t bytes() const { return 12 * sizeof(float) * intensity.capacity(); }
  };
  using Weights = float[16];
  /// Estimates of the `count` lights from place `first` on; their sum.
  float weigh(uint32_t first, uint32_t count, const Vec3& position, const Vec3& normal, Weights&) const;
  /// A node to be built over lights_[begin, end).
  struct Branch {
    uint32_t node, begin, end;
  };
  static constexpr uint32_t kBranchSize = 4096;
  void build_node(std::vector<Node>& nodes, const Branch&, std::vector<Branch>* branches);
  void append(uint32_t node, const std::vector<Node>& branch);
  uint32_t split(uint32_t begin, uint32_t end, const LightBounds& all);

  std::vector<Node> nodes_;
  std::vector<LightBounds> lights_;  // in the order of leaves
  Columns columns_;                  // the same
  std::vector<uint32_t> order_;      // place → caller's index
  std::vector<uint32_t> place_;      // caller's index → place
  std::vector<uint32_t> leaf_;       // place → node
};

}  // namespace afterglow
