// SPDX-License-Identifier: GPL-3.0-or-later
// Shadow rays through transparent surfaces, one surface after the other.
#include "transport/path_walker.h"

namespace afterglow {

Rgb transmittance(const WalkScene& walk, Ray ray, const PathContext& from, RayCounts& counts) {
  const CommittedScene& scene = walk.scene;
  PathContext context = from;
  context.kind = PathContext::kShadow;
  Rgb through(1.0f);
  const bool finite = std::isfinite(ray.t_max);
  const Vec3 end = finite ? ray.origin + ray.direction * ray.t_max : Vec3(0.0f);
  for (;;) {
    Hit hit;
    if (!scene.rays.closest(ray, hit)) return through;
    const bool shown = walk.shows(hit.instance);
    if (shown && scene.materials.opaque(material_at(scene.scene, hit))) return Rgb(0.0f);
    SurfacePoint point = surface_point(scene.scene, ray, hit, false);
    if (shown) {
      if (scene.materials.reads_uv(point.material)) point.uv = surface_uv(scene.scene, point);
      context.ray_length = hit.t;
      through *= scene.materials.transparency(scene.scene, point, context);
      if (is_black(through) || ++context.transparent_depth > walk.limits.transparent) return Rgb(0.0f);
    }
    ray.origin = offset_origin(point, ray.direction);
    if (finite) {  // towards the same end, which lies just off the light: a step aside must not carry the ray into it
      const Vec3 way = end - ray.origin;
      ray.t_max = glm::dot(way, ray.direction) > 0.0f ? glm::length(way) : 0.0f;
      if (!(ray.t_max > 0.0f)) return through;
      ray.direction = way / ray.t_max;
    }
    counts.shadow++;
  }
}

}  // namespace afterglow
