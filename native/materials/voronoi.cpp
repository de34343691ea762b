// SPDX-License-Identifier: GPL-3.0-or-later
// Cellular patterns: see voronoi.h.
#include "materials/voronoi.h"

#include <algorithm>

#include "materials/microfacet.h"
#include "materials/noise.h"

namespace afterglow {
namespace {

template <int N>
struct Place {
  float v[N];
};

/// The cells around a place: offsets from −reach to reach in every dimension, the first running fastest.
template <int N, class Visit>
void around(int reach, Visit visit) {
  int32_t offset[N];
  std::fill(offset, offset + N, -reach);
  while (true) {
    visit(offset);
    int k = 0;
    while (k < N && ++offset[k] > reach) offset[k++] = -reach;
    if (k == N) return;
  }
}

template <int N>
struct Cells {
  int32_t cell[N];
  float base[N], local[N];
  const VoronoiShape& shape;

  Cells(const float* p, const VoronoiShape& s) : shape(s) {
    for (int k = 0; k < N; ++k) {
      base[k] = std::floor(p[k]);
      cell[k] = int32_t(std::clamp(base[k], -2.0e9f, 2.0e9f));
      local[k] = p[k] - base[k];
    }
  }
  Place<N> point(const int32_t* offset) const {
    Place<N> result;
    float random[N];
    if constexpr (N == 1) {
      const float at = base[0] + float(offset[0]);
      random[0] = hash_floats(&at, 1);
    } else {
      int32_t at[N];
      for (int k = 0; k < N; ++k) at[k] = int32_t(uint32_t(cell[k]) + uint32_t(offset[k]));
      pcg(at, N, random);
    }
    for (int k = 0; k < N; ++k) result.v[k] = float(offset[k]) + random[k] * shape.randomness;
    return result;
  }
  Vec3 color(const int32_t* offset) const {
    if constexpr (N == 1) {
      const float at = base[0] + float(offset[0]);
      return hash_color(&at, 1);
    } else {
      int32_t at[4] = {0, 0, 0, 0};
      float random[4];
      for (int k = 0; k < N; ++k) at[k] = int32_t(uint32_t(cell[k]) + uint32_t(offset[k]));
      pcg(at, N == 2 ? 3 : N, random);
      return {random[0], random[1], random[2]};
    }
  }
  float distance(const Place<N>& a) const {
    float sum = 0.0f;
    for (int k = 0; k < N; ++k) {
      const float d = std::fabs(a.v[k] - local[k]);
      if (N == 1 || shape.metric == VoronoiMetric::kManhattan)
        sum += d;
      else if (shape.metric == VoronoiMetric::kChebychev)
        sum = std::max(sum, d);
      else if (shape.metric == VoronoiMetric::kMinkowski)
        sum += std::pow(d, shape.exponent);
      else
        sum += d * d;
    }
    if (N == 1) return sum;
    if (shape.metric == VoronoiMetric::kMinkowski) return std::pow(sum, 1.0f / shape.exponent);
    return shape.metric == VoronoiMetric::kEuclidean ? std::sqrt(sum) : sum;
  }
  Vec4 world(const Place<N>& a) const {
    if constexpr (N == 1) return {0.0f, 0.0f, 0.0f, base[0] + a.v[0]};
    Vec4 result(0.0f);
    for (int k = 0; k < N; ++k) result[k] = base[k] + a.v[k];
    return result;
  }
};

template <int N>
VoronoiValue nearest(const Cells<N>& cells, bool second) {
  float best[2] = {kInfinity, kInfinity};
  int32_t offsets[2][N] = {};
  Place<N> points[2] = {};
  around<N>(1, [&](const int32_t* offset) {
    const Place<N> p = cells.point(offset);
    const float d = cells.distance(p);
    const int place = d < best[0] ? 0 : d < best[1] ? 1 : 2;
    if (place == 2) return;
    if (place == 0) {
      best[1] = best[0], points[1] = points[0];
      std::copy(offsets[0], offsets[0] + N, offsets[1]);
    }
    best[place] = d, points[place] = p;
    std::copy(offset, offset + N, offsets[place]);
  });
  const int k = second ? 1 : 0;
  return {best[k], cells.color(offsets[k]), cells.world(points[k])};
}

template <int N>
VoronoiValue smooth_nearest(const Cells<N>& cells) {
  const float smoothness = cells.shape.smoothness;
  VoronoiValue value;
  Place<N> place{};
  bool first = true;
  around<N>(2, [&](const int32_t* offset) {
    const Place<N> p = cells.point(offset);
    const float d = cells.distance(p);
    float h = 1.0f;
    if (!first) {
      const float t = saturate(0.5f + 0.5f * (value.distance - d) / smoothness);
      h = t * t * (3.0f - 2.0f * t);
    }
    first = false;
    float correction = smoothness * h * (1.0f - h);
    value.distance = value.distance + (d - value.distance) * h - correction;
    correction /= 1.0f + 3.0f * smoothness;
    value.color = lerp(value.color, cells.color(offset), h) - correction;
    for (int k = 0; k < N; ++k) place.v[k] += (p.v[k] - place.v[k]) * h - correction;
  });
  value.position = cells.world(place);
  return value;
}

template <int N>
float edge_distance(const Cells<N>& cells) {
  if constexpr (N == 1) {
    const int32_t left = -1, middle = 0, right = 1;
    const float m = cells.point(&middle).v[0];
    return std::min(std::fabs(0.5f * (m + cells.point(&left).v[0]) - cells.local[0]),
                    std::fabs(0.5f * (m + cells.point(&right).v[0]) - cells.local[0]));
  }
  float closest[N] = {}, best = kInfinity;
  const auto to_point = [&](const int32_t* offset, float* way) {
    const Place<N> p = cells.point(offset);
    float square = 0.0f;
    for (int k = 0; k < N; ++k) way[k] = p.v[k] - cells.local[k], square += way[k] * way[k];
    return square;
  };
  around<N>(1, [&](const int32_t* offset) {
    float way[N];
    const float square = to_point(offset, way);
    if (square < best) best = square, std::copy(way, way + N, closest);
  });
  best = kInfinity;
  around<N>(1, [&](const int32_t* offset) {
    float way[N], across = 0.0f, dot = 0.0f;
    to_point(offset, way);
    for (int k = 0; k < N; ++k) {
      const float d = way[k] - closest[k];
      across += d * d;
      dot += 0.5f * (way[k] + closest[k]) * d;
    }
    if (across > 0.0001f) best = std::min(best, dot / std::sqrt(across));
  });
  return best;
}

template <int N>
float sphere_radius(const Cells<N>& cells) {
  const auto square_between = [](const float* a, const float* b) {
    float sum = 0.0f;
    for (int k = 0; k < N; ++k) sum += sqr(a[k] - b[k]);
    return sum;
  };
  Place<N> closest{};
  int32_t centre[N] = {};
  float best = kInfinity;
  around<N>(1, [&](const int32_t* offset) {
    const Place<N> p = cells.point(offset);
    const float d = square_between(p.v, cells.local);
    if (d < best) best = d, closest = p, std::copy(offset, offset + N, centre);
  });
  best = kInfinity;
  around<N>(1, [&](const int32_t* offset) {
    if (std::all_of(offset, offset + N, [](int32_t k) { return k == 0; })) return;
    int32_t at[N];
    for (int k = 0; k < N; ++k) at[k] = offset[k] + centre[k];
    best = std::min(best, square_between(cells.point(at).v, closest.v));
  });
  return 0.5f * std::sqrt(best);
}

template <int N>
VoronoiValue one_octave(const float* p, const VoronoiShape& shape) {
  const Cells<N> cells(p, shape);
  switch (shape.feature) {
    case VoronoiFeature::kF1:
      return nearest<N>(cells, false);
    case VoronoiFeature::kF2:
      return nearest<N>(cells, true);
    case VoronoiFeature::kSmoothF1:
      return shape.smoothness > 0.0f ? smooth_nearest<N>(cells) : nearest<N>(cells, false);
    case VoronoiFeature::kEdge:
      return {edge_distance<N>(cells), Vec3(0.0f), Vec4(0.0f)};
    default:
      return {sphere_radius<N>(cells), Vec3(0.0f), Vec4(0.0f)};
  }
}

VoronoiValue octave(const float* p, int count, const VoronoiShape& shape) {
  switch (count) {
    case 1:
      return one_octave<1>(p, shape);
    case 2:
      return one_octave<2>(p, shape);
    case 3:
      return one_octave<3>(p, shape);
    default:
      return one_octave<4>(p, shape);
  }
}

/// The largest distance that can occur, for normalising.
float most_distance(int count, const VoronoiShape& s) {
  const float d = 0.5f + 0.5f * s.randomness, n = float(count);
  float most = d;
  if (count > 1 && s.metric == VoronoiMetric::kEuclidean) most = d * std::sqrt(n);
  if (count > 1 && s.metric == VoronoiMetric::kManhattan) most = d * n;
  if (count > 1 && s.metric == VoronoiMetric::kMinkowski) most = d * std::pow(n, 1.0f / s.exponent);
  return s.feature == VoronoiFeature::kF2 ? 2.0f * most : most;
}

VoronoiValue edge_octaves(const float* p, int count, const VoronoiShape& s) {
  float scale = 1.0f, amplitude = 1.0f, distance = 8.0f, most = 2.0f - s.randomness;
  const bool plain = s.detail == 0.0f || s.roughness == 0.0f;
  const int last = int(std::ceil(s.detail));
  for (int k = 0; k <= last; ++k) {
    float at[4];
    for (int d = 0; d < count; ++d) at[d] = p[d] * scale;
    const float here = octave(at, count, s).distance;
    if (plain) {
      distance = here, most = 0.5f + 0.5f * s.randomness;
      break;
    }
    const float closer = std::min(distance, here / scale), reach = (0.5f + 0.5f * s.randomness) / scale;
    if (float(k) <= s.detail) {
      most += (reach - most) * amplitude;
      distance += (closer - distance) * amplitude;
      scale *= s.lacunarity, amplitude *= s.roughness;
    } else if (const float rest = s.detail - std::floor(s.detail); rest != 0.0f) {
      const float lerped = most + (reach - most) * amplitude;
      most += (lerped - most) * rest;
      distance += (distance + (closer - distance) * amplitude - distance) * rest;
    }
  }
  if (s.normalize) distance /= most;
  return {distance, Vec3(0.0f), Vec4(0.0f)};
}

}  // namespace

VoronoiValue voronoi(const float* p, int count, const VoronoiShape& s) {
  if (s.feature == VoronoiFeature::kSphereRadius) return octave(p, count, s);
  if (s.feature == VoronoiFeature::kEdge) return edge_octaves(p, count, s);
  VoronoiValue sum;
  float amplitude = 1.0f, most = 0.0f, scale = 1.0f;
  const bool plain = s.detail == 0.0f || s.roughness == 0.0f;
  const int last = int(std::ceil(s.detail));
  for (int k = 0; k <= last; ++k) {
    float at[4];
    for (int d = 0; d < count; ++d) at[d] = p[d] * scale;
    const VoronoiValue v = octave(at, count, s);
    if (plain) {
      most = 1.0f, sum = v;
      break;
    }
    const float share = float(k) <= s.detail ? 1.0f : s.detail - std::floor(s.detail);
    most += amplitude * share;
    sum.distance += v.distance * amplitude * share;
    sum.color += v.color * (amplitude * share);
    sum.position += (v.position / scale - sum.position) * (amplitude * share);
    scale *= s.lacunarity, amplitude *= s.roughness;
  }
  if (s.normalize) {
    sum.distance /= most * most_distance(count, s);
    sum.color /= most;
  }
  sum.position = s.scale != 0.0f ? sum.position / s.scale : Vec4(0.0f);
  return sum;
}

}  // namespace afterglow
