// SPDX-License-Identifier: GPL-3.0-or-later
// Cellular patterns (Worley 1996) in one to four dimensions: nearest points, smooth minimum, distance to the border
// between cells (Quilez 2012), and sums of octaves.
#pragma once

#include "base/math.h"

namespace afterglow {

enum class VoronoiFeature : uint32_t { kF1, kF2, kSmoothF1, kEdge, kSphereRadius };
enum class VoronoiMetric : uint32_t { kEuclidean, kManhattan, kChebychev, kMinkowski };

struct VoronoiShape {
  VoronoiFeature feature = VoronoiFeature::kF1;
  VoronoiMetric metric = VoronoiMetric::kEuclidean;
  float detail = 0.0f, roughness = 0.5f, lacunarity = 2.0f, smoothness = 1.0f, exponent = 0.5f, randomness = 1.0f,
        scale = 1.0f;
  bool normalize = false;
};

struct VoronoiValue {
  float distance = 0.0f;
  Vec3 color{0.0f};
  Vec4 position{0.0f};  // of the point, in the dimensions used; one dimension: w
};

/// p: the place times the scale.
VoronoiValue voronoi(const float* p, int count, const VoronoiShape&);

}  // namespace afterglow
