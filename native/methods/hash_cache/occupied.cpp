// SPDX-License-Identifier: GPL-3.0-or-later
// Marking cells: see occupied.h. A triangle is cut by planes into layers, then rows; what is left of it in a row spans
// the cells that it touches. That is the triangle–box test exactly, without asking boxes that it misses.
#include "methods/hash_cache/occupied.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <new>

#include "base/errors.h"
#include "base/parallel.h"

namespace afterglow::hash_cache {

namespace {

/// In cells: more than single precision loses.
float slack_at(int resolution) { return std::max(1.0f, float(resolution) / 4096.0f) / 512.0f; }

constexpr int kKeyBits = 31;  // of a map's keys: a level of 4096³ fills them, and none is the mark of an empty slot

/// Layers of blocks that one map takes, as a power of two.
uint32_t layers_shift(int level) { return level < 2 ? 0u : uint32_t(std::clamp(kKeyBits - 2 * (level - 2), 0, 30)); }

double now() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

struct Triangle {
  Vec3 a, b, c;  // in cells
};

struct Polygon {
  Vec3 points[8];
  int count = 0;
};

/// What of the polygon lies between two planes across an axis.
Polygon cut(const Polygon& in, int axis, float low, float high) {
  Polygon half, out;
  const auto clip = [axis](const Polygon& from, float at, float sign, Polygon& to) {
    for (int i = 0; i < from.count; ++i) {
      const Vec3 &p = from.points[i], &q = from.points[i + 1 == from.count ? 0 : i + 1];
      const float dp = sign * (p[axis] - at), dq = sign * (q[axis] - at);
      if (dp >= 0.0f) to.points[to.count++] = p;
      if ((dp < 0.0f) != (dq < 0.0f) && to.count < 8) {
        Vec3 r = p + (q - p) * (dp / (dp - dq));
        r[axis] = at;
        to.points[to.count++] = r;
      }
      if (to.count >= 7) break;  // a triangle cut by four planes has seven corners at most
    }
  };
  clip(in, low, 1.0f, half);
  clip(half, high, -1.0f, out);
  return out;
}

/// One layer of blocks, dense, with a list of what was touched.
class Layer {
 public:
  explicit Layer(uint32_t width) : width_(width), bits_(size_t(width) * width, 0) {}
  void mark(uint32_t bx, uint32_t by, uint32_t bits) {
    uint32_t& at = bits_[size_t(by) * width_ + bx];
    if (!at) touched_.push_back(by * width_ + bx);
    at |= bits;
  }
  /// Blocks in order of their keys; the layer, counted from its map's first, is empty again.
  std::vector<Block> take(uint32_t layer) {
    std::sort(touched_.begin(), touched_.end());
    std::vector<Block> blocks;
    blocks.reserve(touched_.size());
    for (const uint32_t at : touched_) {
      blocks.push_back({{bits_[at], 0}, layer * width_ * width_ + at});
      bits_[at] = 0;
    }
    touched_.clear();
    return blocks;
  }

 private:
  uint32_t width_;
  std::vector<uint32_t> bits_, touched_;
};

struct Range {
  int first, last;
};
Range cells_between(float low, float high, int resolution) {
  const float slack = slack_at(resolution);
  return {std::clamp(int(std::floor(low - slack)), 0, resolution - 1),
          std::clamp(int(std::floor(high + slack)), 0, resolution - 1)};
}

void mark_triangle(const Triangle& t, int layer, int resolution, Layer& out) {
  Polygon whole;
  whole.points[0] = t.a, whole.points[1] = t.b, whole.points[2] = t.c;
  whole.count = 3;
  const Vec3 low = glm::min(t.a, glm::min(t.b, t.c)), high = glm::max(t.a, glm::max(t.b, t.c));
  const Range z = cells_between(low.z, high.z, resolution);
  const float slack = slack_at(resolution);
  for (int k = std::max(z.first, 2 * layer); k <= std::min(z.last, 2 * layer + 1); ++k) {
    const Polygon slab = z.first == z.last ? whole : cut(whole, 2, float(k) - slack, float(k + 1) + slack);
    float y0 = kInfinity, y1 = -kInfinity;
    for (int i = 0; i < slab.count; ++i) y0 = std::min(y0, slab.points[i].y), y1 = std::max(y1, slab.points[i].y);
    if (!slab.count) continue;
    const Range y = cells_between(y0, y1, resolution);
    for (int j = y.first; j <= y.last; ++j) {
      const Polygon row = y.first == y.last ? slab : cut(slab, 1, float(j) - slack, float(j + 1) + slack);
      float x0 = kInfinity, x1 = -kInfinity;
      for (int i = 0; i < row.count; ++i) x0 = std::min(x0, row.points[i].x), x1 = std::max(x1, row.points[i].x);
      if (!row.count) continue;
      const Range x = cells_between(x0, x1, resolution);
      for (int i = x.first; i <= x.last;) {
        const int end = std::min(x.last, i | 3);
        const uint32_t run = ((2u << (end & 3)) - 1u) & ~((1u << (i & 3)) - 1u);
        out.mark(uint32_t(i) >> 2, uint32_t(j) >> 2, run << (4 * (j & 3) + 16 * (k & 1)));
        i = end + 1;
      }
    }
  }
}

/// Four by four by two cells seen from the level above: two by two by one.
uint32_t halved(uint32_t bits) {
  uint32_t out = 0;
  for (uint32_t y = 0; y < 4; ++y)
    for (uint32_t x = 0; x < 4; ++x)
      if ((bits >> (x + 4 * y) | bits >> (16 + x + 4 * y)) & 1u) out |= 1u << ((x >> 1) + 4 * (y >> 1));
  return out;
}

}  // namespace

void Occupied::build(const Scene& scene, int finest, unsigned threads, StopToken stop) {
  const double begun = now();
  finest = std::clamp(finest, 0, kFinest);
  levels_.clear();
  levels_.resize(size_t(finest) + 1);
  Box bounds = scene.bounds();
  if (bounds.empty()) bounds.extend(Vec3(0.0f));
  edge_ = max_component(bounds.size()) * 1.0001f;
  if (!(edge_ > 0.0f)) edge_ = 1.0f;
  corner_ = bounds.center() - 0.5f * edge_;
  const int resolution = 1 << finest;
  const float scale = float(resolution) / edge_;
  const auto width_of = [](int level) { return std::max(1u, (1u << level) / 4u); };
  const auto layers_of = [](int level) { return std::max(1u, (1u << level) / 2u); };

  const auto in_map = [](size_t layer, int level) { return uint32_t(layer) & ((1u << layers_shift(level)) - 1u); };

  // Triangles by the layer where they begin; those that reach farther are met again in each.
  std::vector<size_t> first_triangle{0};
  for (const InstanceRecord& r : scene.instances())
    first_triangle.push_back(first_triangle.back() + (r.mesh ? r.mesh->triangles.size() / 3 : 0));
  std::vector<Triangle> triangles(first_triangle.back());
  std::vector<Range> reach(triangles.size());
  parallel_blocks(scene.instances().size(), 1, threads, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      const InstanceRecord& r = scene.instances()[i];
      for (size_t t = 0; t < first_triangle[i + 1] - first_triangle[i]; ++t) {
        const auto corner = [&](size_t k) {
          return (r.to_world.point(r.mesh->positions[r.mesh->triangles[3 * t + k]]) - corner_) * scale;
        };
        const Triangle triangle{corner(0), corner(1), corner(2)};
        const Range z = cells_between(std::min({triangle.a.z, triangle.b.z, triangle.c.z}),
                                      std::max({triangle.a.z, triangle.b.z, triangle.c.z}), resolution);
        triangles[first_triangle[i] + t] = triangle;
        reach[first_triangle[i] + t] = {z.first >> 1, z.last >> 1};
      }
    }
  });
  const uint32_t layers = layers_of(finest);
  std::vector<uint32_t> starts(layers + 1, 0);
  for (const Range& r : reach)
    for (int l = r.first; l <= r.last; ++l) starts[size_t(l) + 1]++;
  for (uint32_t l = 0; l < layers; ++l) starts[l + 1] += starts[l];
  std::vector<uint32_t> order(starts[layers]), next(starts.begin(), starts.end() - 1);
  for (uint32_t t = 0; t < reach.size(); ++t)
    for (int l = reach[t].first; l <= reach[t].last; ++l) order[next[size_t(l)]++] = t;

  std::vector<std::vector<Block>> blocks(layers);
  parallel_blocks(
      layers, std::max<size_t>(1, layers / 64), threads,
      [&](size_t begin, size_t end) {
        Layer layer(width_of(finest));
        for (size_t l = begin; l < end && !stop.stop(); ++l) {
          for (uint32_t i = starts[l]; i < starts[l + 1]; ++i)
            mark_triangle(triangles[order[i]], int(l), resolution, layer);
          blocks[l] = layer.take(in_map(l, finest));
        }
      },
      stop);
  peak_bytes_ = triangles.size() * (sizeof(Triangle) + sizeof(Range)) + order.size() * 4;
  triangles = {}, reach = {}, order = {};
  seconds_mark_ = now() - begun;

  seconds_maps_ = 0.0;
  for (int level = finest; level >= 0 && !stop.stop(); --level) {
    OccupiedLevel& out = levels_[size_t(level)];
    out.width_ = width_of(level);
    const double at = now();
    out.layers_shift_ = layers_shift(level);
    uint64_t cells = 0;
    size_t most = 0;
    for (size_t first = 0, each = size_t(1) << out.layers_shift_; first < blocks.size(); first += each) {
      std::vector<Block> all;
      for (size_t l = first; l < std::min(first + each, blocks.size()); ++l)
        all.insert(all.end(), blocks[l].begin(), blocks[l].end());
      for (Block& b : all) b.first = uint32_t(cells), cells += uint32_t(std::popcount(b.bits));
      if (cells >= kNone) throw Unsupported("cells: a level holds more of them than 32 bits count");
      out.blocks_ += all.size(), most = std::max(most, all.size());
      out.maps_.emplace_back().build(all);
    }
    out.cells_ = cells;
    size_t held = out.map_bytes() + (out.blocks_ + most) * sizeof(Block);
    for (int l = level + 1; l <= finest; ++l) held += levels_[size_t(l)].map_bytes();
    peak_bytes_ = std::max(peak_bytes_, held);
    seconds_maps_ += now() - at;
    if (!level) break;
    const uint32_t width = out.width_, coarse_width = width_of(level - 1);
    std::vector<std::vector<Block>> coarse(layers_of(level - 1));
    parallel_blocks(coarse.size(), std::max<size_t>(1, coarse.size() / 64), threads, [&](size_t begin, size_t end) {
      Layer layer(coarse_width);
      for (size_t l = begin; l < end; ++l) {
        for (size_t half = 0; half < 2 && 2 * l + half < blocks.size(); ++half)
          for (const Block& b : blocks[2 * l + half]) {
            const uint32_t in_layer = b.key % (width * width);
            const uint32_t bx = in_layer % width, by = in_layer / width;
            layer.mark(bx >> 1, by >> 1, halved(b.bits) << (2 * (bx & 1u) + 8 * (by & 1u) + 16 * half));
          }
        coarse[l] = layer.take(in_map(l, level - 1));
      }
    });
    blocks = std::move(coarse);
  }
  size_t finished = 0;
  for (OccupiedLevel& level : levels_) {
    if (!level.cells_) continue;
    level.data_.reset(static_cast<BothSidesRecord*>(std::calloc(level.cells_, sizeof(BothSidesRecord))));
    if (!level.data_) throw std::bad_alloc();
    finished += level.map_bytes() + level.data_bytes();
  }
  peak_bytes_ = std::max(peak_bytes_, finished);
}

void Occupied::add(const Vec3& position, const Vec3& normal, const Rgb& light, uint32_t frame, uint32_t changed,
                   uint32_t salt) {
  for (int level = 0; size_t(level) < levels_.size(); ++level)
    if (const uint32_t at = index(position, level); at != kNone)
      levels_[size_t(level)].data(at).add(normal, light, 1, frame, changed, salt);
}

uint32_t Occupied::index(const Vec3& position, int level) const {
  if (level < 0 || size_t(level) >= levels_.size()) return kNone;
  const Vec3 at = (position - corner_) * (float(1 << level) / edge_);
  const float last = float((1 << level) - 1);
  const Vec3 cell = glm::clamp(glm::floor(at), Vec3(0.0f), Vec3(last));
  return levels_[size_t(level)].index(uint32_t(cell.x), uint32_t(cell.y), uint32_t(cell.z));
}

}  // namespace afterglow::hash_cache
