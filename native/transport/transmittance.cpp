// SPDX-License-Identifier: GPL-3.0-or-later
// Shadow rays through transparent surfaces, one surface after the other.
#include "transport/path_walker.h"

namespace afterglow {

Rgb transmittance(const WalkScene& walk, Ray ray, const PathContext& from, RayCounts& counts) {
  const CommittedScene& scene = walk.scene;
  PathContext context = from;
  context.kind = PathContext::kShadow;
  Rgb through(1.0f);
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
    ray.t_max -= hit.t;
    if (!(ray.t_max > 0.0f)) return through;
    counts.shadow++;
  }
}

}  // namespace afterglow
