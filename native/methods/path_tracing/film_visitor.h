// SPDX-License-Identifier: GPL-3.0-or-later
// What the path tracer does with a walk: light goes into the picture and, where asked for, into the pass of the first
// surface's lobe that it came through; the first surfaces write the data passes.
#pragma once

#include <cstring>

#include "methods/path_tracing/kernel.h"

namespace afterglow::path_tracing {

/// What one contribution may bring at most, as the sum of its channels: a hundred million of them fit into a sum of
/// 32-bit floats, and no light that means something is near. What is above is dropped and counted.
inline constexpr float kMostLight = 1e30f;

/// Clamped, within bounds and not negative; what is dropped is counted.
inline Rgb kept(const Rgb& light, float limit, RayCounts& counts) {
  const float sum = std::fabs(light.x) + std::fabs(light.y) + std::fabs(light.z);
  if (!(sum <= kMostLight)) {
    counts.dropped++;
    return Rgb(0.0f);
  }
  return glm::max(sum > limit ? light * (limit / sum) : light, Rgb(0.0f));
}

template <bool kPasses, bool kLobes = true>
class FilmVisitor {
 public:
  static constexpr bool kIgnoresSurfaces = !kPasses;
  FilmVisitor(const KernelInput& in, RayCounts& counts) : in_(in), layout_(in.film.layout()), counts_(counts) {}

  const float* sums() const { return sums_; }
  float squares() const { return squares_; }  // of the samples' luminances; 0 where no passes are kept
  void begin_pixel() {
    std::memset(sums_, 0, sizeof(float) * size_t(layout_.floats));
    squares_ = 0.0f;
  }
  void begin_sample(const PathState& path, uint32_t index) {
    batch_ = sums_ + layout_[Pass::kBatches] + int(batch_of(index));
    light_ = seen_ = Rgb(0.0f);
    transparent_ = 0.0f;
    if constexpr (kPasses) {
      eye_ = path.ray.origin;
      diffuse_share_ = glossy_share_ = transmission_share_ = Rgb(0.0f);
      surface_known_ = features_known_ = false;
    }
  }
  void end_sample() {
    float* combined = sums_ + layout_[Pass::kCombined];
    for (int c = 0; c < 3; ++c) combined[c] += light_[c];
    combined[3] += transparent_;
    const float noise = luminance(noisy());
    *batch_ += noise;
    if constexpr (kPasses) squares_ += noise * noise;
  }

  /// Depth, position and indexes are those in the middle of the pixel, as in Cycles: a walk before the first sample, of
  /// which nothing else is kept.
  bool wants_place() const {
    return kPasses && (layout_[Pass::kDepth] >= 0 || layout_[Pass::kPosition] >= 0 ||
                       layout_[Pass::kObjectIndex] >= 0 || layout_[Pass::kMaterialIndex] >= 0);
  }
  void begin_place(const PathState& path) {
    begin_sample(path, 0);
    placing_ = true;
  }
  void end_place() {
    placing_ = false;
    begin_pixel();
    if (!surface_known_) return;
    set(Pass::kDepth, place_.depth);
    set(Pass::kObjectIndex, place_.object_index);
    set(Pass::kMaterialIndex, place_.material_index);
    add(Pass::kPosition, place_.position);
  }

  bool surface(const PathState& path, const SurfacePoint& point, const Surface& surface) {
    if constexpr (kPasses) {
      if (placing_) return path.context.depth == 0 && !place(point, surface);
      if (path.context.depth == 0) write_surface(path, point, surface);
      if (!features_known_) write_features(path, point, surface);
    }
    return true;
  }

  void lit(const PathState& path, const BsdfValue& value, const Rgb& light) {
    const bool direct = path.context.depth == 0;
    const Rgb arriving = path.throughput * light;
    const Rgb c = kept(arriving * total<kLobes>(value), direct);
    light_ += c;
    if constexpr (kPasses) {
      if (is_black(c)) return;
      if (direct) {
        const Rgb share = c / glm::max(arriving * value.total(), Rgb(1e-38f));
        add(Pass::kDiffuseDirect, arriving * value.diffuse * share);
        add(Pass::kGlossyDirect, arriving * value.glossy * share);
        add(Pass::kTransmissionDirect, arriving * value.transmission * share);
      } else {
        add_shared(false, c);
      }
    }
  }

  void scattered(const PathState& path, const BsdfSample& s) {
    if constexpr (kPasses) {
      if (path.context.depth != 0) return;
      const Rgb scale = 1.0f / glm::max(s.value.total(), Rgb(1e-38f));
      diffuse_share_ = s.value.diffuse * scale;
      glossy_share_ = s.value.glossy * scale;
      transmission_share_ = s.value.transmission * scale;
    }
  }

  void emitted(const PathState& path, const Rgb& light) {
    const Rgb c = kept(path.throughput * light, path.context.depth <= 1);
    light_ += c;
    if constexpr (kPasses) {
      if (path.context.depth == 0) {
        seen_ += c;
        add(Pass::kEmission, c);
        if (!features_known_) add(Pass::kAlbedo, glm::min(c, Rgb(1.0f)));
      } else {
        add_shared(path.context.depth == 1, c);
        add_mirrored(c);
      }
    }
  }

  void escaped(const PathState& path, const Rgb& light) {
    const Rgb c = kept(path.throughput * light, path.context.depth <= 1);
    const bool hole = path.context.depth == 0 && in_.film.settings().transparent;
    if (hole)
      transparent_ += (path.throughput.x + path.throughput.y + path.throughput.z) / 3.0f;
    else
      light_ += c;
    if constexpr (kPasses) {
      if (path.context.depth == 0)
        seen_ += hole ? Rgb(0.0f) : c, add(Pass::kEnvironment, c);
      else
        add_shared(path.context.depth == 1, c), add_mirrored(c);
      if (!features_known_) add(Pass::kAlbedo, glm::min(c, Rgb(1.0f)));
    }
  }

  void traced(const Ray&, bool) {}

  void held_out(const PathState& path, float share) {
    transparent_ += share * (path.throughput.x + path.throughput.y + path.throughput.z) / 3.0f;
  }

 protected:
  /// Light of which the samples tell the noise: rays of their own may see to the rest.
  Rgb noisy() const {
    if constexpr (kPasses) {
      if (in_.film.keeps_sight()) return light_ - seen_;
    }
    return light_;
  }

  Rgb kept(const Rgb& light, bool direct) {
    const float sum = std::fabs(light.x) + std::fabs(light.y) + std::fabs(light.z);
    if (sum <= least_limit_) return glm::max(light, Rgb(0.0f));
    return path_tracing::kept(light, direct ? in_.clamp_direct : in_.clamp_indirect, counts_);
  }

  void add(Pass pass, const Rgb& value) {
    const int at = layout_[pass];
    if (at < 0) return;
    for (int c = 0; c < 3; ++c) sums_[at + c] += value[c];
  }

  void add_mirrored(const Rgb& light) {
    const int at = layout_[Pass::kDenoiseSurface];
    for (int c = 0; at >= 0 && !features_known_ && c < 3; ++c) sums_[at + kSurfaceMirrored + c] += light[c];
  }

  void add_shared(bool direct, const Rgb& light) {
    add(direct ? Pass::kDiffuseDirect : Pass::kDiffuseIndirect, light * diffuse_share_);
    add(direct ? Pass::kGlossyDirect : Pass::kGlossyIndirect, light * glossy_share_);
    add(direct ? Pass::kTransmissionDirect : Pass::kTransmissionIndirect, light * transmission_share_);
  }

  static Vec3 mean_normal(const SurfacePoint& point, const Surface& surface) {
    Vec3 sum(0.0f);
    for (int i = 0; i < surface.count; ++i)
      sum +=
          surface.lobes[i].normal * (surface.lobes[i].weight.x + surface.lobes[i].weight.y + surface.lobes[i].weight.z);
    const float length = glm::length(sum);
    return length > 0.0f ? sum / length : point.normal;
  }

  void set(Pass pass, float value) {
    if (layout_[pass] >= 0) sums_[layout_[pass]] = value;
  }

  static bool covers(const Surface& surface) {
    return (surface.transparency.x + surface.transparency.y + surface.transparency.z) / 3.0f <= 0.5f;
  }
  bool place(const SurfacePoint& point, const Surface& surface);
  void write_surface(const PathState& path, const SurfacePoint& point, const Surface& surface);
  void write_features(const PathState& path, const SurfacePoint& point, const Surface& surface);

  const KernelInput& in_;
  const FilmLayout& layout_;
  RayCounts& counts_;
  const float least_limit_ = std::fmin(kMostLight, std::fmin(in_.clamp_indirect, in_.clamp_direct));
  float* batch_ = nullptr;
  float squares_ = 0.0f;
  Rgb light_{0.0f}, seen_{0.0f};  // seen: of light, what the camera's ray met itself
  float transparent_ = 0.0f;
  Vec3 eye_{0.0f};
  Rgb diffuse_share_{0.0f}, glossy_share_{0.0f}, transmission_share_{0.0f};  // of the first surface's lobes
  bool surface_known_ = false, features_known_ = false, placing_ = false;
  struct Place {
    float depth = 0.0f, object_index = 0.0f, material_index = 0.0f;
    Vec3 position{0.0f};
  } place_;
  float sums_[FilmLayout::kMaxFloats];
};

/// True: this is the surface that the pixel's middle shows.
template <bool kPasses, bool kLobes>
bool FilmVisitor<kPasses, kLobes>::place(const SurfacePoint& point, const Surface& surface) {
  if (!covers(surface)) return false;
  const Scene& scene = in_.walk.scene.scene;
  const Handle material = scene.material_handles()[point.material];
  place_.depth = in_.camera.depth(point.position);
  place_.object_index = float(scene.instances()[point.instance].object_index);
  place_.material_index = material ? float(scene.material(material).pass_index) : 0.0f;
  place_.position = Vec3(DVec3(point.position) + scene.origin());
  return surface_known_ = true;
}

/// Data passes of the first surface that is more opaque than not, colours and mist of all up to there, weighted by what
/// shows through.
template <bool kPasses, bool kLobes>
void FilmVisitor<kPasses, kLobes>::write_surface(const PathState& path, const SurfacePoint& point,
                                                 const Surface& surface) {
  const Rgb alpha = Rgb(1.0f) - surface.transparency;
  if (!surface_known_ && covers(surface)) {
    surface_known_ = true;
    add(Pass::kNormal, mean_normal(point, surface));
    const Mesh& mesh = *in_.walk.scene.scene.instances()[point.instance].mesh;
    if (mesh.active_uv < mesh.uvs.size()) add(Pass::kUv, Vec3(point.uv, 1.0f));
  }
  if (layout_[Pass::kDiffuseColor] >= 0 || layout_[Pass::kGlossyColor] >= 0 || layout_[Pass::kTransmissionColor] >= 0) {
    const SurfaceAlbedo color = albedo(surface, point.outgoing);
    add(Pass::kDiffuseColor, path.throughput * color.diffuse);
    add(Pass::kGlossyColor, path.throughput * color.glossy);
    add(Pass::kTransmissionColor, path.throughput * color.transmission);
  }
  if (const int at = layout_[Pass::kMist]; at >= 0) {
    const FilmSettings& s = in_.film.settings();
    float mist =
        glm::clamp((glm::distance(eye_, point.position) - s.mist_start) / std::fmax(s.mist_depth, 1e-6f), 0.0f, 1.0f);
    mist = s.mist_falloff == 0 ? mist * mist : s.mist_falloff == 1 ? mist : std::sqrt(mist);
    const Rgb covered = path.throughput * alpha;
    sums_[at] += (1.0f - mist) * (covered.x + covered.y + covered.z) / 3.0f;
  }
}

/// Albedo and normal for the denoiser: of the first surface of which less than three quarters are a mirror or clear
/// glass, each lobe counted by the light that it sends on.
template <bool kPasses, bool kLobes>
void FilmVisitor<kPasses, kLobes>::write_features(const PathState& path, const SurfacePoint& point,
                                                  const Surface& surface) {
  if (layout_[Pass::kAlbedo] < 0 && layout_[Pass::kDenoiseNormal] < 0 && layout_[Pass::kDenoiseSurface] < 0) return;
  constexpr float kSharp = 0.075f * 0.075f;
  float sharp = 0.0f, all = 0.0f;
  for (int i = 0; i < surface.count; ++i) {
    const Lobe& lobe = surface.lobes[i];
    all += lobe.sampling_weight;
    if (lobe.kind >= LobeKind::kMicrofacetReflection && lobe.alpha_x * lobe.alpha_y < kSharp)
      sharp += lobe.sampling_weight;
  }
  const float through = (surface.transparency.x + surface.transparency.y + surface.transparency.z) / 3.0f;
  sharp = through + (1.0f - through) * sharp, all = through + (1.0f - through) * all;
  if (sharp > 0.75f * all && !path.last && path.context.depth < 4) return;
  features_known_ = true;
  const SurfaceAlbedo color = albedo(surface, point.outgoing);
  const Rgb reflected =
      glm::min(path.throughput, Rgb(1.0f)) * glm::min(color.diffuse + color.glossy + color.transmission, Rgb(1.0f));
  add(Pass::kAlbedo, reflected);
  add(Pass::kDenoiseNormal, mean_normal(point, surface));
  const int at = layout_[Pass::kDenoiseSurface];
  if (at < 0) return;
  float* kept = sums_ + at;
  for (int c = 0; c < 3; ++c) kept[kSurfacePosition + c] += point.position[c], kept[kSurfaceAlbedo + c] += reflected[c];
  kept[kSurfaceFootprint] += path.context.footprint, kept[kSurfaceSegment] += path.context.ray_length;
  kept[kSurfaceMet] += 1.0f;
}

}  // namespace afterglow::path_tracing
