// SPDX-License-Identifier: GPL-3.0-or-later
// The walk of one request of a wavefront: see wavefront.h. Compiled for scenes with and without transparent surfaces,
// with and without passes; all else costs little beside the rays.
#pragma once

#include "methods/path_tracing/film_visitor.h"
#include "methods/path_tracing/kernel_body.h"
#include "render/wavefront.h"

namespace afterglow {

/// Notes a question at every diffuse lobe; light that needs no answer goes where the path tracer's goes.
template <bool kPasses>
class AskingVisitor : public path_tracing::FilmVisitor<kPasses> {
  using Base = path_tracing::FilmVisitor<kPasses>;

 public:
  using SplitsDiffuse = void;
  AskingVisitor(const path_tracing::KernelInput& in, WalkedRequest& out) : Base(in, out.counts), out_(out) {}

  void begin_path(uint32_t pixel, uint32_t sample, uint16_t x, uint16_t y) {
    pixel_ = pixel, sample_ = sample, x_ = x, y_ = y;
    layer_ = 0;
  }

  void end_path() {
    if (out_.noise)
      out_.luminances.push_back(luminance(this->noisy()));
    this->end_sample();
  }

  /// More where more of the light reaches the picture.
  uint32_t lights(const PathState& path) const {
    if (!out_.lights) return 0;
    return glm::max(1u, uint32_t(std::lround(float(out_.lights) * glm::min(1.0f, max_component(path.throughput)))));
  }

  void diffuse(const PathState& path, const SurfacePoint& point, const Surface& surface) {
    if (this->placing_) return;
    Rgb front(0.0f), back(0.0f);
    Vec3 front_normal(0.0f), back_normal(0.0f);
    for (int i = 0; i < surface.count; ++i) {
      const auto& lobe = surface.lobes[i];
      const bool behind = lobe.kind == LobeKind::kTranslucent;
      (behind ? back : front) += lobe.weight;
      (behind ? back_normal : front_normal) += max_component(lobe.weight) * lobe.normal;
    }
    if (!is_black(front)) ask(path, point, front, front_normal, false);
    if (!is_black(back)) ask(path, point, back, back_normal, true);
    if (layer_ < 255) layer_++;
  }

 private:
  void ask(const PathState& path, const SurfacePoint& point, const Rgb& albedo, const Vec3& bent, bool translucent) {
    const float side = translucent ? -1.0f : 1.0f;
    CachePoint ask;
    ask.position = point.position;
    ask.normal = point.normal * side, ask.face_normal = point.face_normal * side;
    const float length = glm::length(bent);
    ask.bent = length > 0.0f ? bent * (side / length) : ask.normal;
    ask.outgoing = point.outgoing;
    ask.footprint = path.context.footprint;
    ask.segment = path.context.ray_length;
    ask.instance = point.instance, ask.triangle = point.triangle;
    ask.u = point.u, ask.v = point.v, ask.error = point.error;
    ask.x = x_, ask.y = y_, ask.sample = sample_;
    ask.layer = layer_, ask.translucent = translucent;
    out_.points.push_back(ask);
    Question q;
    q.weight = path.throughput * albedo * kInvPi;
    q.pixel = pixel_, q.sample = sample_, q.path = uint32_t(out_.luminances.size());
    q.direct = path.context.depth == 0;
    if constexpr (kPasses)
      q.diffuse = this->diffuse_share_, q.glossy = this->glossy_share_, q.transmission = this->transmission_share_;
    out_.questions.push_back(q);
  }

  WalkedRequest& out_;
  uint32_t pixel_ = 0, sample_ = 0;
  uint16_t x_ = 0, y_ = 0;
  uint8_t layer_ = 0;
};

template <uint32_t kFeatures>
void walk_request(const path_tracing::KernelInput& in, const PixelRequest& request, WalkedRequest& out) {
  constexpr bool kPasses = kFeatures & kFeaturePasses;
  const Walker<kFeatures & 7u> walker(in.walk, out.counts);
  const bool lens = in.camera.needs_lens();
  const size_t floats = size_t(in.film.layout().floats);
  AskingVisitor<kPasses> visitor(in, out);
  uint32_t pixel = 0;
  for (uint32_t y = request.y; y < uint32_t(request.y) + request.height; y += request.step)
    for (uint32_t x = request.x; x < uint32_t(request.x) + request.width; x += request.step) {
      if (in.stop.stop()) return;
      if (request.skip && (x - in.film.settings().x0) % request.skip == 0 &&
          (y - in.film.settings().y0) % request.skip == 0)
        continue;
      visitor.begin_pixel();
      const uint32_t pixel_seed = hash(x, y, request.extra ? ~in.seed : in.seed);
      // One walk more, before the first sample.
      bool placing = kPasses && request.first == 0 && !request.extra && visitor.wants_place();
      for (uint32_t i = request.first; i < request.first + request.count;) {
        // One stratified set for all samples of a pixel: batches of their own would be worth less, and tell nothing of
        // the bias that a method has.
        Sampler sampler(pixel_seed, i);
        const Vec2 in_pixel = in.film.filter().offset(sampler.next2());
        const Vec2 on_lens = lens ? sampler.next2() : Vec2(0.5f);
        const Vec2 middle(float(x) + 0.5f, float(y) + 0.5f);
        const CameraRay camera_ray = in.camera.ray(placing ? middle : middle + in_pixel, on_lens);
        PathState path;
        path.ray = camera_ray.ray;
        path.ray.mask = kVisibleCamera;
        path.context.footprint = path_tracing::mean_length(camera_ray.origin_dx, camera_ray.origin_dy);
        path.pixel_angle = path_tracing::mean_length(camera_ray.direction_dx, camera_ray.direction_dy);
        placing ? visitor.begin_place(path) : visitor.begin_sample(path, i);
        visitor.begin_path(pixel, request.extra ? ~i : i, uint16_t(x / request.step), uint16_t(y / request.step));
        walker.walk(path, sampler, visitor);
        placing ? visitor.end_place() : visitor.end_path();
        i += placing ? 0 : 1;
        placing = false;
      }
      out.sums.insert(out.sums.end(), visitor.sums(), visitor.sums() + floats);
      ++pixel;
    }
  out.done = true;
}

}  // namespace afterglow
