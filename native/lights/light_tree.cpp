// SPDX-License-Identifier: GPL-3.0-or-later
// The light tree: bounds of directions as in Conty Estevez and Kulla 2018 (section 4), built top down by the surface
// area orientation heuristic over bins. Probabilities are found from leaf to root, so that no light needs to remember
// its way.
#include "lights/light_tree.h"

#include <algorithm>
#include <array>
#include <numeric>

#include "base/lanes.h"
#include "base/parallel.h"

namespace afterglow {

namespace {

float sine_of(float cosine) { return std::sqrt(std::max(1.0f - cosine * cosine, 0.0f)); }

/// cos(max(0, a − b)) from the cosines and sines of both.
float cos_difference(float sin_a, float cos_a, float sin_b, float cos_b) {
  return cos_a > cos_b ? 1.0f : cos_a * cos_b + sin_a * sin_b;
}
float sin_difference(float sin_a, float cos_a, float sin_b, float cos_b) {
  return cos_a > cos_b ? 0.0f : sin_a * cos_b - cos_a * sin_b;
}

struct Cone {
  Vec3 axis;
  float cosine;
};

/// The smallest cone around two (Conty Estevez and Kulla 2018, algorithm 1).
Cone united(const Cone& a, const Cone& b) {
  if (a.cosine <= -1.0f || b.cosine <= -1.0f) return {a.axis, -1.0f};
  if (a.cosine > b.cosine) return united(b, a);
  const float half_a = std::acos(std::clamp(a.cosine, -1.0f, 1.0f)),
              half_b = std::acos(std::clamp(b.cosine, -1.0f, 1.0f));
  const float between = std::acos(std::clamp(glm::dot(a.axis, b.axis), -1.0f, 1.0f));
  if (std::min(between + half_b, kPi) <= half_a) return a;
  const float half = 0.5f * (half_a + between + half_b);
  if (half >= kPi) return {a.axis, -1.0f};
  const Vec3 pivot = glm::cross(a.axis, b.axis);
  const float length = glm::length(pivot);
  if (!(length > 1e-6f)) return {a.axis, -1.0f};
  const float turn = half - half_a;
  const Vec3 side = glm::cross(pivot / length, a.axis);
  // A little wider, since arc cosines of nearly equal vectors are coarse.
  return {glm::normalize(a.axis * std::cos(turn) + side * std::sin(turn)), std::cos(std::min(half + 1e-3f, kPi))};
}

/// Cost of a group: intensity × area × spread of directions (the SAOH's terms).
float group_cost(const LightBounds& b, float regularity) {
  if (b.box.empty() || !(b.intensity > 0.0f)) return 0.0f;
  const float half = std::acos(std::clamp(b.cos_normals, -1.0f, 1.0f));
  const float out = std::min(half + std::acos(std::clamp(b.cos_emission, -1.0f, 1.0f)), kPi);
  const float sin_half = std::sin(half);
  const float directions =
      2.0f * kPi * (1.0f - b.cos_normals) +
      0.5f * kPi * (2.0f * out * sin_half - std::cos(half - 2.0f * out) - 2.0f * half * sin_half + std::cos(half));
  const Vec3 s = b.box.size();
  const float area = 2.0f * (s.x * s.y + s.y * s.z + s.z * s.x), diagonal2 = glm::dot(s, s);
  return b.intensity * std::max(directions, 1e-3f) * regularity * (area + 1e-3f * diagonal2);
}

}  // namespace

LightBounds united(const LightBounds& a, const LightBounds& b) {
  if (!(a.intensity > 0.0f)) return b;
  if (!(b.intensity > 0.0f)) return a;
  LightBounds r = a;
  r.box.extend(b.box);
  const Cone cone = united(Cone{a.axis, a.cos_normals}, Cone{b.axis, b.cos_normals});
  r.axis = cone.axis, r.cos_normals = cone.cosine;
  r.cos_emission = std::min(a.cos_emission, b.cos_emission);
  r.intensity = a.intensity + b.intensity;
  r.two_sided = a.two_sided || b.two_sided;
  return r;
}

float light_importance(const LightBounds& b, const Vec3& position, const Vec3& normal) {
  if (!(b.intensity > 0.0f)) return 0.0f;
  const Vec3 center = b.box.center(), to_point = position - center, half_size = b.box.upper - center;
  const float d2 = glm::dot(to_point, to_point), r2 = glm::dot(half_size, half_size);
  // Half angle under which the box is seen at most.
  const bool inside = d2 <= r2;
  const float sin_box = inside ? 0.0f : std::sqrt(r2 / d2), cos_box = inside ? -1.0f : std::sqrt(1.0f - r2 / d2);
  const float inverse_d = d2 > 0.0f ? 1.0f / std::sqrt(d2) : 0.0f;
  float cos_out = 1.0f;
  if (!inside && b.cos_normals > -1.0f) {
    float cosine = glm::dot(b.axis, to_point) * inverse_d;
    if (b.two_sided) cosine = std::fabs(cosine);
    cosine = std::clamp(cosine, -1.0f, 1.0f);
    const float sin_normals = sine_of(b.cos_normals), sine = sine_of(cosine);
    const float cos_x = cos_difference(sine, cosine, sin_normals, b.cos_normals);
    const float sin_x = sin_difference(sine, cosine, sin_normals, b.cos_normals);
    cos_out = cos_difference(sin_x, cos_x, sin_box, cos_box);
    if (cos_out <= b.cos_emission) return 0.0f;
    // A cone of normals wider than a half turn together with the box can go beyond what the cosines can say.
    cos_out = std::max(cos_out, 0.0f);
  }
  float cos_in = 1.0f;
  if (!inside && (normal.x != 0.0f || normal.y != 0.0f || normal.z != 0.0f)) {
    const float cosine = std::clamp(-glm::dot(normal, to_point) * inverse_d, -1.0f, 1.0f);
    cos_in = cos_difference(sine_of(cosine), cosine, sin_box, cos_box);
    if (!(cos_in > 0.0f)) return 0.0f;
  }
  const float floor2 = std::max(r2, 1e-30f);
  return std::max(b.intensity * cos_out * cos_in / std::max(d2, floor2), 1e-35f);
}

void LightTree::Columns::fill(std::span<const LightBounds> lights) {
  const size_t size = lights.size() + kSingleLeaf;  // blocks of eight may read beyond the end
  for (auto* column : {&center_x, &center_y, &center_z, &radius2, &axis_x, &axis_y, &axis_z, &cos_normals, &sin_normals,
                       &cos_emission, &intensity, &two_sided})
    column->assign(size, 0.0f);
  for (size_t i = 0; i < lights.size(); ++i) {
    const LightBounds& b = lights[i];
    const Vec3 center = b.box.empty() ? Vec3(0.0f) : b.box.center(),
               half = b.box.empty() ? center : b.box.upper - center;
    center_x[i] = center.x, center_y[i] = center.y, center_z[i] = center.z;
    radius2[i] = glm::dot(half, half);
    axis_x[i] = b.axis.x, axis_y[i] = b.axis.y, axis_z[i] = b.axis.z;
    cos_normals[i] = b.cos_normals, sin_normals[i] = sine_of(b.cos_normals);
    cos_emission[i] = b.cos_emission;
    intensity[i] = b.intensity > 0.0f ? b.intensity : 0.0f;
    two_sided[i] = b.two_sided ? 1.0f : 0.0f;
  }
}

namespace {

/// Whether all of a box lies below the plane through the point; never for normal 0.
bool behind(const Box& box, const Vec3& position, const Vec3& normal) {
  const Vec3 center = box.center() - position, half = box.upper - box.center();
  return glm::dot(center, normal) + glm::dot(half, glm::abs(normal)) < 0.0f;
}

Eight load(const std::vector<float>& column, uint32_t at) { return load_eight(column.data() + at); }

}  // namespace

/// light_importance() of eight lights at once.
float LightTree::weigh(uint32_t first, uint32_t count, const Vec3& p, const Vec3& n, Weights& weights) const {
  const Eight zero = {}, one = zero + 1.0f;
  const bool one_side = n.x != 0.0f || n.y != 0.0f || n.z != 0.0f;
  float sum = 0.0f;
  for (uint32_t block = 0; block < count; block += 8) {
    const uint32_t at = first + block;
    const Columns& c = columns_;
    const Eight x = p.x - load(c.center_x, at), y = p.y - load(c.center_y, at), z = p.z - load(c.center_z, at);
    const Eight r2 = load(c.radius2, at), cos_n = load(c.cos_normals, at), sin_n = load(c.sin_normals, at);
    const Eight d2 = x * x + y * y + z * z, share = smaller(r2 / larger(d2, zero + 1e-37f), one);
    const EightBits outside = share < one;
    const Eight sin_box = square_root(share), cos_box = square_root(one - share),
                inverse_d = one / square_root(larger(d2, zero + 1e-37f));

    Eight cosine = (load(c.axis_x, at) * x + load(c.axis_y, at) * y + load(c.axis_z, at) * z) * inverse_d;
    cosine = load(c.two_sided, at) > zero ? larger(cosine, -cosine) : cosine;
    cosine = larger(smaller(cosine, one), -one);
    const Eight sine = square_root(one - cosine * cosine);
    const EightBits within = cosine > cos_n;
    const Eight cos_x = within ? one : cosine * cos_n + sine * sin_n;
    const Eight sin_x = within ? zero : sine * cos_n - cosine * sin_n;
    const Eight nearest = cos_x > cos_box ? one : cos_x * cos_box + sin_x * sin_box;
    // A cone of normals wider than a half turn together with the box can go beyond what the cosines can say.
    const Eight directed = nearest > load(c.cos_emission, at) ? larger(nearest, zero) : -one;
    const Eight cos_out = (outside & (cos_n > -one)) ? directed : one;

    Eight cos_in = one;
    if (one_side) {
      const Eight k = larger(smaller(-(n.x * x + n.y * y + n.z * z) * inverse_d, one), -one);
      const Eight facing = k > cos_box ? one : k * cos_box + square_root(one - k * k) * sin_box;
      cos_in = outside ? facing : one;
    }
    const Eight intensity = load(c.intensity, at);
    const Eight w = larger(intensity * cos_out * cos_in / larger(d2, larger(r2, zero + 1e-30f)), zero + 1e-35f);
    const Eight alive = ((cos_out >= zero) & (cos_in > zero) & (intensity > zero)) ? w : zero;
    for (uint32_t i = 0; i < 8; ++i) weights[block + i] = alive[i];
  }
  for (uint32_t i = 0; i < count; ++i) sum += weights[i];
  return sum;
}

void LightTree::build(std::span<const LightBounds> lights) {
  nodes_.clear();
  order_.resize(lights.size());
  std::iota(order_.begin(), order_.end(), 0u);
  lights_.assign(lights.begin(), lights.end());
  place_.resize(lights.size());
  leaf_.assign(lights.size(), 0);
  if (lights.empty()) return;
  // The upper part here, down to branches that are built side by side, each into nodes of its own; the same cuts on any
  // number of threads.
  nodes_.emplace_back();
  std::vector<Branch> branches;
  build_node(nodes_, {0, 0, uint32_t(lights.size())}, &branches);
  std::vector<std::vector<Node>> built(branches.size());
  parallel_blocks(branches.size(), 1, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      built[i].emplace_back();
      build_node(built[i], {0, branches[i].begin, branches[i].end}, nullptr);
    }
  });
  for (size_t i = 0; i < branches.size(); ++i) append(branches[i].node, built[i]);
  for (uint32_t node = 0; node < nodes_.size(); ++node)
    if (nodes_[node].count) std::fill_n(leaf_.begin() + nodes_[node].first, nodes_[node].count, node);
  columns_.fill(lights_);
  for (uint32_t place = 0; place < order_.size(); ++place) place_[order_[place]] = place;
}

/// Puts a branch, whose nodes count from 0, in the place of a node.
void LightTree::append(uint32_t node, const std::vector<Node>& branch) {
  const uint32_t offset = uint32_t(nodes_.size()) - 1;  // of all its nodes but the first
  const auto moved = [&](uint32_t index) { return index ? index + offset : node; };
  const uint32_t parent = nodes_[node].parent;
  nodes_.resize(nodes_.size() + branch.size() - 1);
  for (uint32_t i = 0; i < branch.size(); ++i) {
    Node& to = nodes_[moved(i)];
    to = branch[i];
    to.parent = i ? moved(to.parent) : parent;
    if (!to.count) to.first = moved(to.first);
  }
}

/// Builds the node and all below it. branches: where it is small enough for one thread, it is noted there instead.
void LightTree::build_node(std::vector<Node>& nodes, const Branch& of, std::vector<Branch>* branches) {
  const uint32_t count = of.end - of.begin;
  const bool whole = count == lights_.size();
  if (branches && !whole && count <= kBranchSize) return branches->push_back(of);
  LightBounds all;
  for (uint32_t i = of.begin; i < of.end; ++i) all = united(all, lights_[i]);
  nodes[of.node].bounds = all;
  if (count <= (whole ? kSingleLeaf : kLeafSize)) {
    nodes[of.node].first = of.begin, nodes[of.node].count = count;
    return;
  }
  const uint32_t middle = split(of.begin, of.end, all);
  const uint32_t first = uint32_t(nodes.size());
  nodes.resize(nodes.size() + 2);
  nodes[of.node].first = first;
  nodes[first].parent = nodes[first + 1].parent = of.node;
  build_node(nodes, {first, of.begin, middle}, branches);
  build_node(nodes, {first + 1, middle, of.end}, branches);
}

uint32_t LightTree::split(uint32_t begin, uint32_t end, const LightBounds& all) {
  constexpr int kBins = 12;
  Box centers;
  for (uint32_t i = begin; i < end; ++i) centers.extend(lights_[i].box.center());
  const Vec3 size = centers.size(), whole = all.box.size();
  auto bin_of = [&](const LightBounds& b, int axis) {
    return std::clamp(int(kBins * (b.box.center()[axis] - centers.lower[axis]) / size[axis]), 0, kBins - 1);
  };
  float best = kInfinity;
  int best_axis = -1, best_bin = 0;
  for (int axis = 0; axis < 3; ++axis) {
    if (!(size[axis] > 0.0f)) continue;
    std::array<LightBounds, kBins> bins{};
    for (uint32_t i = begin; i < end; ++i) {
      LightBounds& bin = bins[bin_of(lights_[i], axis)];
      bin = united(bin, lights_[i]);
    }
    const float regularity = max_component(whole) / std::max(whole[axis], 1e-6f * max_component(whole));
    std::array<float, kBins> right{};
    LightBounds sum;
    for (int b = kBins - 1; b > 0; --b) sum = united(sum, bins[b]), right[b] = group_cost(sum, regularity);
    sum = LightBounds{};
    for (int b = 0; b + 1 < kBins; ++b) {
      sum = united(sum, bins[b]);
      const float cost = group_cost(sum, regularity) + right[b + 1];
      if (cost < best && sum.intensity > 0.0f && right[b + 1] > 0.0f) best = cost, best_axis = axis, best_bin = b;
    }
  }
  uint32_t middle = begin;
  std::vector<uint32_t> places(end - begin);
  std::iota(places.begin(), places.end(), begin);
  if (best_axis >= 0) {
    auto half = std::stable_partition(places.begin(), places.end(),
                                      [&](uint32_t i) { return bin_of(lights_[i], best_axis) <= best_bin; });
    middle = begin + uint32_t(half - places.begin());
  }
  if (middle == begin || middle == end) return begin + (end - begin) / 2;  // all in one place: any halves do
  std::vector<LightBounds> lights(places.size());
  std::vector<uint32_t> order(places.size());
  for (size_t i = 0; i < places.size(); ++i) lights[i] = lights_[places[i]], order[i] = order_[places[i]];
  std::copy(lights.begin(), lights.end(), lights_.begin() + begin);
  std::copy(order.begin(), order.end(), order_.begin() + begin);
  return middle;
}

float LightTree::importance(const Vec3& position, const Vec3& normal) const {
  if (nodes_.empty()) return 0.0f;
  if (nodes_[0].count == 0) {
    float sum = 0.0f;
    for (uint32_t child = nodes_[0].first; child < nodes_[0].first + 2; ++child)
      sum += light_importance(nodes_[child].bounds, position, normal);
    return sum;
  }
  Weights weights;
  return weigh(nodes_[0].first, nodes_[0].count, position, normal, weights);
}

uint32_t LightTree::sample(const Vec3& position, const Vec3& normal, float u, float& probability) const {
  if (nodes_.empty()) return kNone;
  if (lights_.size() == 1) {  // nothing to choose from
    probability = 1.0f;
    return behind(lights_[0].box, position, normal) ? kNone : order_[0];
  }
  const Node* node = &nodes_[0];
  probability = 1.0f;
  while (node->count == 0) {
    const Node* child = &nodes_[node->first];
    const float a = light_importance(child[0].bounds, position, normal);
    const float b = light_importance(child[1].bounds, position, normal);
    if (!(a + b > 0.0f)) return kNone;
    const float p = a / (a + b);
    if (u < p) {
      node = child, probability *= p, u = std::min(u / p, 0x1.fffffep-1f);
    } else {
      node = child + 1, probability *= b / (a + b), u = std::clamp((u - p) / (1.0f - p), 0.0f, 0x1.fffffep-1f);
    }
  }
  Weights weight;
  const float sum = weigh(node->first, node->count, position, normal, weight);
  if (!(sum > 0.0f)) return kNone;
  float target = u * sum;
  uint32_t chosen = kNone;
  for (uint32_t i = 0; i < node->count; ++i) {
    if (!(weight[i] > 0.0f)) continue;
    chosen = i;
    if (target < weight[i]) break;
    target -= weight[i];
  }
  probability *= weight[chosen] / sum;
  return order_[node->first + chosen];
}

float LightTree::probability(uint32_t light, const Vec3& position, const Vec3& normal) const {
  if (lights_.size() == 1) return behind(lights_[0].box, position, normal) ? 0.0f : 1.0f;
  const uint32_t place = place_[light];
  uint32_t node = leaf_[place];
  Weights weights;
  const float sum = weigh(nodes_[node].first, nodes_[node].count, position, normal, weights);
  const float own = weights[place - nodes_[node].first];
  if (!(own > 0.0f)) return 0.0f;
  float probability = own / sum;
  for (; nodes_[node].parent != kNone; node = nodes_[node].parent) {
    const uint32_t first = nodes_[nodes_[node].parent].first;
    const float a = light_importance(nodes_[first].bounds, position, normal);
    const float b = light_importance(nodes_[first + 1].bounds, position, normal);
    probability *= (node == first ? a : b) / (a + b);
  }
  return probability;
}

size_t LightTree::bytes() const {
  return nodes_.capacity() * sizeof(Node) + columns_.bytes() + lights_.capacity() * sizeof(LightBounds) +
         order_.capacity() * 4 * 3;
}

}  // namespace afterglow
