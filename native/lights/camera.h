// SPDX-License-Identifier: GPL-3.0-or-later
// Rays of the camera: perspective, orthographic, equirectangular panorama, with a thin lens.
#pragma once

#include "rays/ray_caster.h"

namespace afterglow {

struct CameraRay {
  Ray ray;
  Vec3 origin_dx{0.0f}, origin_dy{0.0f};  // differentials a pixel
  Vec3 direction_dx{0.0f}, direction_dy{0.0f};
};

/// A camera made ready for one image size, relative to the scene's origin.
class CameraRays {
 public:
  CameraRays(const Camera&, const DVec3& origin, uint32_t width, uint32_t height);
  /// pixel: in pixels from the lower left corner of the full image; lens in [0,1)².
  CameraRay ray(const Vec2& pixel, const Vec2& lens) const;
  /// Depth as Blender's pass has it: along the view axis (panorama: distance).
  float depth(const Vec3& position) const;
  bool needs_lens() const { return lens_; }
  /// One eye, no lens: pinhole_ray() is the ray.
  bool is_pinhole() const { return pinhole_; }
  /// The ray alone, without differentials.
  void pinhole_ray(const Vec2& pixel, Ray& ray) const {
    const Vec2 at = pixel / size_;
    const Vec3 v(Vec2(camera_.window.x, camera_.window.z) + extent_ * at, -1.0f);
    const Vec3 direction = v / glm::length(v);
    ray.origin = to_world_.p;
    ray.direction = glm::normalize(to_world_.vector(direction));
    ray.t_min = camera_.clip.x / -direction.z;
    ray.t_max = camera_.clip.y / -direction.z;
    ray.mask = kVisibleCamera;
  }

 private:
  Camera camera_;
  Affine to_world_;
  Vec2 size_, extent_;
  bool lens_ = false, pinhole_ = false;
};

}  // namespace afterglow
