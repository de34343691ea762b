// SPDX-License-Identifier: GPL-3.0-or-later
// See layered_denoiser.h.
#include "film/layered_denoiser.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "base/errors.h"
#include "base/parallel.h"
#include "film/layered_filter.h"

namespace afterglow {

namespace {

/// Taps spread by 1, 2, 4 and 8 pixels: whole pictures have more noise than a cache's answers.
constexpr int kPasses = 4;
constexpr float kDarkest = 0.02f;  // of albedo: what is darker is as good as black
constexpr float kUnknown = 1.0f;   // relative error of a pixel that tells none
/// Of standard errors, in (6): wider ones carry bright strips into what is dark beside them.
constexpr float kSpread = 4.0f;

Rgb rgb(const float* image, size_t pixel) { return {image[pixel * 3], image[pixel * 3 + 1], image[pixel * 3 + 2]}; }

Rgb albedo_of(const float* surface) {
  return glm::max(Rgb(surface[kSurfaceAlbedo], surface[kSurfaceAlbedo + 1], surface[kSurfaceAlbedo + 2]),
                  Rgb(kDarkest));
}

bool all_finite(const float* values, int count) {
  return std::all_of(values, values + count, [](float v) { return std::isfinite(v); });
}

Rgb seen(const DenoiseInput& in, size_t p) { return in.seen ? rgb(in.seen, p) : Rgb(0.0f); }

Rgb reflected(const DenoiseInput& in, size_t p) {
  const Rgb light = rgb(in.color, p) - seen(in, p);
  return is_finite(light) ? glm::max(light, Rgb(0.0f)) : light;
}

float error_of(const DenoiseInput& in, size_t p) {
  return std::isfinite(in.error[p]) ? std::max(0.0f, in.error[p]) : kUnknown;
}

float squared(float x) { return x * x; }

class LayeredDenoiser final : public Denoiser {
 public:
  uint64_t filter(const DenoiseInput& in, float* output) override {
    if (!in.color || !output || in.width == 0 || in.height == 0) throw InvalidInput("denoise: an image without pixels");
    if (!in.normal || !in.surface || !in.error)
      throw InvalidInput(
          "denoise: the layered filter needs the passes denoise_normal and denoise_surface and each pixel's error");
    const size_t pixels = size_t(in.width) * in.height;
    filter_.begin(in.width, in.height);
    std::atomic<uint64_t> broken{0};
    const auto each = [&](const auto& body) {
      parallel_blocks(
          pixels, 1 << 13, in.threads,
          [&](size_t begin, size_t end) {
            for (size_t p = begin; p < end; ++p) body(p);
          },
          in.stop);
      if (in.stop.stop()) throw Cancelled("denoising was cancelled");
    };
    each([&](size_t p) {
      if (!all_finite(in.color + p * 3, 3)) broken++;
      if (reflects(in, p)) filter_.set(p, pixel_of(in, p));
    });
    filter_.run(in.threads, in.stop, kPasses);
    each([&](size_t p) {
      const Rgb own = rgb(in.color, p);
      Rgb made = is_finite(own) ? own : Rgb(0.0f);
      if (reflects(in, p)) made = filter_.light(p) * albedo_of(in.surface + p * kSurfaceFloats) + seen(in, p);
      for (int c = 0; c < 3; ++c) output[p * 3 + size_t(c)] = made[c];
    });
    return broken;
  }

  void rest() override { filter_ = {}; }

 private:
  /// Whether any of the pixel's samples met a surface that can guide the filter.
  static bool reflects(const DenoiseInput& in, size_t p) {
    const float* surface = in.surface + p * kSurfaceFloats;
    const Rgb normal = rgb(in.normal, p);
    return surface[kSurfaceMet] > 0.0f && all_finite(surface, kSurfaceFloats) && is_finite(normal) &&
           glm::dot(normal, normal) > 0.0f && is_finite(seen(in, p));
  }

  /// Pixels whose light is not finite are holes.
  static LayerPixel pixel_of(const DenoiseInput& in, size_t p) {
    const float* surface = in.surface + p * kSurfaceFloats;
    const float met = 1.0f / surface[kSurfaceMet];
    LayerPixel pixel;
    pixel.position = Vec3(surface[0], surface[1], surface[2]) * met;
    pixel.normal = glm::normalize(rgb(in.normal, p));
    pixel.footprint = surface[kSurfaceFootprint] * met, pixel.segment = surface[kSurfaceSegment] * met;
    pixel.error = std::cbrt(squared(kSpread / 16.0f * error_of(in, p)));  // of which the filter takes the power 3/2
    const Rgb light = reflected(in, p);
    pixel.hole = !is_finite(light);
    if (!pixel.hole) pixel.light = light / albedo_of(surface);
    return pixel;
  }

  LayeredFilter filter_;
};

}  // namespace

std::unique_ptr<Denoiser> make_layered_denoiser() { return std::make_unique<LayeredDenoiser>(); }

}  // namespace afterglow
