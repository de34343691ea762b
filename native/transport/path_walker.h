// SPDX-License-Identifier: GPL-3.0-or-later
// The walk of a camera path: at every vertex light is looked for (next-event estimation) and run into, both weighted
// against each other (Veach 1995), and a visitor is told. What a scene cannot show is not in the compiled kernel.
//
// A visitor has
//   bool surface(const PathState&, const SurfacePoint&, const Surface&)   a vertex; false ends the walk here
//   void lit(const PathState&, const BsdfValue&, const Rgb& light)        light found: throughput × value × light
//                                                                         arrives
//   void scattered(const PathState&, const BsdfSample&)      before the throughput takes the sample's weight
//   void emitted(const PathState&, const Rgb& light)         light run into, weighted; throughput not applied
//   void escaped(const PathState&, const Rgb& light)         the same of the world, and of nothing at all
//   void held_out(const PathState&, float share)             a holdout seen from the camera
// A visitor that names a type SplitsDiffuse is also told
//   void diffuse(const PathState&, const SurfacePoint&, const Surface& diffuse_lobes)
//   uint32_t lights(const PathState&)         how many times light sources are asked here; 0: by other lobes alone
// and answers for the light that other surfaces send there: the walk goes on through the other lobes alone, and the
// light sources that it looks for are not weighed against diffuse directions that are never taken.
// A visitor that names a type MayAnswer is asked at each vertex, after surface(), whether it has done so:
//   bool answered() const
// A visitor that names a type Carries keeps throughputs of its own, from several vertices of the path at once. It is
// also told
//   void turned(const BsdfSample&)        a direction was asked for, valid or not, after the choice not to go straight
//   Rgb carried(const Rgb& factor)        what the throughput was multiplied with, for whatever reason
// and answers with the throughput by which roulette decides from there on.
// A visitor whose kIgnoresSurfaces is true is not told of surfaces. Where a kernel knows nothing but Lambert's lobe, no
// list of lobes is made then.
#pragma once

#include <algorithm>
#include <new>

#include "base/cancel.h"
#include "base/sampler.h"
#include "transport/committed_scene.h"
#include "transport/path_state.h"

namespace afterglow {

/// Dimensions of the sample point: four of the camera (pixel, lens), then eight a vertex.
inline constexpr uint32_t kCameraDimensions = 4, kVertexDimensions = 8;

struct WalkScene {
  const CommittedScene& scene;
  WalkLimits limits;
  const InstanceMask* shown = nullptr;  // local view; null: everything
  bool with_uv = false;                 // of every point, not only where a material's program reads it
  bool shows(uint32_t instance) const { return !shown || ((*shown)[instance / 64] >> (instance % 64) & 1); }
};

/// Share of light that a shadow ray brings through transparent surfaces; 0 where an opaque one stands.
Rgb transmittance(const WalkScene&, Ray, const PathContext&, RayCounts&);

/// From a surface to a light, neither of which the ray may meet: it begins and ends off them, so that its direction is
/// not quite the sample's where the light stands close before the surface. Lamps have no surface, but often lie in one.
template <class Light>
inline Ray shadow_ray(const SurfacePoint& from, const Light& light) {
  Ray ray;
  ray.origin = offset_origin(from, light.direction);
  ray.direction = light.direction;
  ray.t_max = light.distance;
  ray.mask = kVisibleShadow;
  if (!std::isfinite(light.distance)) return ray;
  const Vec3 way = light.direction * light.distance + light.margin - (ray.origin - from.position);
  ray.t_max = glm::length(way);
  if (ray.t_max > 0.0f) ray.direction = way / ray.t_max;
  if (light.margin == Vec3(0.0f))
    ray.t_max = glm::max(0.0f, ray.t_max * (1.0f - 2e-5f) - 1e-6f * max_component(glm::abs(ray.origin)));
  return ray;
}

template <class Visitor>
inline constexpr bool kSplits = requires {
  typename Visitor::SplitsDiffuse;
};

template <class Visitor>
inline constexpr bool kCarries = requires {
  typename Visitor::Carries;
};

template <class Visitor>
inline constexpr bool kMayAnswer = requires {
  typename Visitor::MayAnswer;
};

template <class Visitor>
inline constexpr bool kIgnores = requires {
  requires Visitor::kIgnoresSurfaces;
};

/// Wants nothing but emitters and the sky: the walk ends at what is neither one nor lets anything through.
template <class Visitor>
inline constexpr bool kOnlyLooks = requires {
  typename Visitor::OnlyLooks;
};

template <uint32_t kFeatures>
class Walker {
  static constexpr bool kLobes = kFeatures & kFeatureLobes;
  static constexpr bool kStraight = kFeatures & kFeatureStraight;
  static constexpr bool kShapes = kFeatures & kFeatureShapes;
  template <class Visitor>
  static constexpr bool kLean = !kLobes && !kStraight && kIgnores<Visitor> && !kSplits<Visitor> && !kCarries<Visitor>;

 public:
  Walker(const WalkScene& walk, RayCounts& counts) : walk_(walk), scene_(walk.scene), counts_(counts) {}

  template <class Visitor>
  void walk(PathState& path, Sampler& sampler, Visitor& visitor) const {
    if constexpr (kLean<Visitor>) {
      if (all_plain_ && (kShapes || lone_)) return walk_on<true>(path, sampler, visitor);
    }
    walk_on<false>(path, sampler, visitor);
  }

 private:
  /// kKnown, of lean walks: no material needs to be asked, and no light to be chosen but among shapes.
  template <bool kKnown, class Visitor>
  void walk_on(PathState& path, Sampler& sampler, Visitor& visitor) const {
    constexpr bool lean = kLean<Visitor>;
    counts_.camera++;
    for (uint32_t vertex = 0;; ++vertex) {
      Hit hit;
      visitor.traced(path.ray, false);
      if (!closest(path, hit)) {
        if constexpr (kShapes)
          run_into_shapes(path, kInfinity, visitor);
        else if (lean && !has_world_ && vertex > 0)
          return;  // of nothing, only the camera's rays are told
        escape(path, visitor);
        return;
      }
      if constexpr (kShapes) run_into_shapes(path, hit.t, visitor);
      if constexpr (!kKnown) {
        path.context.ray_length = hit.t;
        path.context.footprint += path.pixel_angle * hit.t;
      }
      if constexpr (kOnlyLooks<Visitor>) {
        if (!(scene_.materials.material_effects(material_at(scene_.scene, hit)) & (kEmissiveMesh | kTransparency)))
          return;
      }
      SurfacePoint point = lean ? surface_point(scene_.scene, path.ray, hit, false) : point_at(path, hit);
      Room room;  // of nothing, until a surface is made there
      auto&& surface = shade<lean, kKnown>(path, point, room);
      if (!is_black(surface.emission)) visitor.emitted(path, surface.emission * emission_weight(path, point));
      if constexpr (kStraight) {
        if (path.context.kind & PathContext::kCamera && !hold_out(path, point, surface, visitor)) return;
        if (path.context.transparent_depth > walk_.limits.transparent) return;
      }
      if (lean ? vertex > most_diffuse_ : path.last) {
        if constexpr (kStraight) {
          if (is_black(surface.transparency)) return;
          surface.count = 0;
        } else {
          return;
        }
      }
      if constexpr (lean) {
        if (!surface.material.scatters) return;
      }
      const uint32_t block = (kCameraDimensions + vertex * kVertexDimensions) / 4;
      const auto [u_light, u_end, u_emitter_x, u_emitter_y] = sampler.block(block);
      const Vec2 u_emitter(u_emitter_x, u_emitter_y);
      if constexpr (!kIgnores<Visitor>) {
        if (!visitor.surface(path, point, surface)) return;
      }
      float straight = 0.0f;
      if constexpr (kSplits<Visitor>) {
        Surface diffuse;
        split_diffuse(surface, diffuse);
        if constexpr (kStraight) straight = straight_probability(surface);
        if (diffuse.count) visitor.diffuse(path, point, diffuse);
        if (diffuse.count || surface.count)
          ask_lights(path, point, surface, diffuse, 1.0f - straight, u_light, u_emitter, visitor);
      } else if constexpr (lean) {
        look_for_light<kKnown>(path, point, surface, u_light, u_emitter, visitor);
      } else if (answered(visitor)) {
        Surface diffuse;
        split_diffuse(surface, diffuse);
        if constexpr (kStraight) straight = straight_probability(surface);
        look_for_light(path, point, surface, &diffuse, 1.0f - straight, u_light, u_emitter, visitor);
      } else {
        if constexpr (kStraight) straight = straight_probability(surface);
        if (surface.count && straight < 1.0f)
          look_for_light(path, point, surface, nullptr, 1.0f - straight, u_light, u_emitter, visitor);
      }
      [[maybe_unused]] const auto [u_lobe, u_straight, u_x, u_y] = sampler.block(block + 1);
      const Vec2 u(u_x, u_y);
      if constexpr (kStraight) {
        if (straight > 0.0f && u_straight < straight) {
          pass_straight(path, point, surface.transparency / straight);
          if constexpr (kCarries<Visitor>) path.throughput = visitor.carried(surface.transparency / straight);
          if (!survives(path, u_end, visitor)) return;
          continue;
        }
      }
      if constexpr (lean) {
        if (!scatter_lambert(path, point, surface, vertex + 1, u)) return;
      } else {
        if (!surface.count || !scatter(path, point, surface, 1.0f - straight, u_lobe, u, visitor)) return;
      }
      if (!survives(path, u_end, visitor)) return;
      counts_.bounce++;
    }
  }

  bool closest(PathState& path, Hit& hit) const {
    if constexpr (kStraight) {
      for (int skipped = 0; skipped < 4096; ++skipped) {
        if (!scene_.rays.closest(path.ray, hit)) return false;
        if (walk_.shows(hit.instance)) return true;
        path.ray.origin = offset_origin(point_at(path, hit), path.ray.direction);
        hit = Hit{};
      }
      return false;
    } else {
      return scene_.rays.closest(path.ray, hit);
    }
  }

  SurfacePoint point_at(const PathState& path, const Hit& hit) const {
    SurfacePoint point = surface_point(scene_.scene, path.ray, hit, walk_.with_uv);
    if (some_read_uv_ && scene_.materials.reads_uv(point.material)) point.uv = surface_uv(scene_.scene, point);
    return point;
  }

  struct MadeSurface {
    Surface surface;
    PlainMaterial material;
  };
  union Room {
    MadeSurface made;
    Room() {}
  };

  /// Lean: a LambertSurface, which looks at the material's own colours where they are the same everywhere. Else:
  /// the surface made in the room.
  template <bool kLeanOne, bool kKnown>
  decltype(auto) shade(const PathState& path, SurfacePoint& point, Room& room) const {
    if constexpr (kLeanOne) {
      const PlainMaterial& plain = scene_.materials.plain(point.material);
      if (kKnown || plain.plain) return LambertSurface{plain, point.normal};
      if (scene_.materials.reads_uv(point.material)) point.uv = surface_uv(scene_.scene, point);
      auto& [surface, material] = *new (&room.made) MadeSurface;
      scene_.materials.shade(scene_.scene, point, path.context, surface);
      material.emission = surface.emission, material.scatters = surface.count > 0;
      if (surface.count) material.albedo = surface.lobes[0].weight;
      return LambertSurface{material, surface.lobes[0].normal};
    } else {
      Surface& surface = *new (&room.made.surface) Surface;
      scene_.materials.shade(scene_.scene, point, path.context, surface);
      return (surface);
    }
  }

  float emission_weight(const PathState& path, const SurfacePoint& point) const {
    if (!(path.density > 0.0f) || !scene_.materials.emits(point.material)) return 1.0f;
    return power_heuristic(path.density, scene_.lights.density_of_triangle(path.position, path.light_normal, point));
  }

  /// Russian roulette, before the next ray is traced: what it would cost is what is to be saved.
  template <class Visitor>
  static bool survives(PathState& path, float u, [[maybe_unused]] Visitor& visitor) {
    const float p = survival(path.throughput, path.context.depth, kStraight ? path.context.transparent_depth : 0);
    if (p >= 1.0f) return true;
    path.throughput /= p;
    if constexpr (kCarries<Visitor>) path.throughput = visitor.carried(Rgb(1.0f / p));
    return u < p;
  }

  template <class Visitor>
  void run_into_shapes(const PathState& path, float t_max, Visitor& visitor) const {
    if (!scene_.lights.has_shapes()) return;
    Ray ray = path.ray;
    ray.t_max = t_max;
    const uint32_t mask = visibility_of(path.context.kind);
    scene_.lights.for_each_hit(ray, [&](const LightHit& hit) {
      if (!(hit.visibility & mask)) return;
      const float other = path.density > 0.0f ? scene_.lights.density_of_light(path.position, path.light_normal,
                                                                               path.ray.direction, hit)
                                              : 0.0f;
      visitor.emitted(path, hit.radiance * (other > 0.0f ? power_heuristic(path.density, other) : 1.0f));
    });
  }

  template <class Visitor>
  void escape(PathState& path, Visitor& visitor) const {
    Rgb light{0.0f};
    const uint32_t mask = visibility_of(path.context.kind);
    path.context.ray_length = kInfinity;
    if (has_world_ && (scene_.scene.world().visibility & mask)) {
      light = scene_.materials.world(path.ray.direction, path.context);
      if (path.density > 0.0f && !is_black(light))
        light *= power_heuristic(path.density,
                                 scene_.lights.density_of_world(path.position, path.light_normal, path.ray.direction));
    }
    visitor.escaped(path, light);
    if constexpr (kShapes) {
      for (uint32_t i = 0, n = scene_.lights.sun_count(); i < n; ++i) {
        float density = 0.0f;
        const Rgb sun =
            scene_.lights.escaped_suns(path.ray.direction, mask, i, density, path.position, path.light_normal);
        if (!is_black(sun))
          visitor.emitted(path, sun * (path.density > 0.0f ? power_heuristic(path.density, density) : 1.0f));
      }
    }
  }

  /// A holdout cuts a hole into the picture: what it covers is neither seen nor lit. False: nothing is left.
  template <class Visitor>
  bool hold_out(PathState& path, const SurfacePoint& point, Surface& surface, Visitor& visitor) const {
    float share = surface.holdout;
    if (scene_.scene.instances()[point.instance].holdout) {
      share = 1.0f - (surface.transparency.x + surface.transparency.y + surface.transparency.z) / 3.0f;
      surface.count = 0;
      if (share > 0.0f) visitor.held_out(path, share);
      return !is_black(surface.transparency);
    }
    if (share > 0.0f) visitor.held_out(path, share);
    return share < 1.0f;
  }

  static float straight_probability(const Surface& surface) {
    if (is_black(surface.transparency)) return 0.0f;
    Rgb scattered{0.0f};
    for (int i = 0; i < surface.count; ++i) scattered += surface.lobes[i].weight;
    const float through = surface.transparency.x + surface.transparency.y + surface.transparency.z;
    const float rest = scattered.x + scattered.y + scattered.z;
    return surface.count && rest > 0.0f ? through / (through + rest) : 1.0f;
  }

  void pass_straight(PathState& path, const SurfacePoint& point, const Rgb& weight) const {
    path.throughput *= weight;
    path.context.transparent_depth++;
    path.ray.origin = offset_origin(point, path.ray.direction);
    path.ray.t_min = 0.0f;
  }

  /// The lean way: nothing is chosen where there is a lone light, and nothing but a density is known of a direction.
  template <bool kKnown, class Visitor>
  void look_for_light(const PathState& path, const SurfacePoint& point, const LambertSurface& surface, float u_light,
                      const Vec2& u, Visitor& visitor) const {
    if constexpr (!kShapes) {
      if (kKnown || lone_) {
        LoneSample light(*lone_);
        if (sample_lone(*lone_, point.position, point.normal, u, light))
          take_light(path, point, surface, light, visitor);
        return;
      }
    }
    LightSample light;
    if (scene_.lights.sample(point.position, point.normal, u_light, u, light))
      take_light(path, point, surface, light, visitor);
  }

  template <class Visitor, class Light>
  void take_light(const PathState& path, const SurfacePoint& point, const LambertSurface& surface, const Light& light,
                  Visitor& visitor) const {
    BsdfValue value;
    if (!lambert_density(surface.normal, point.face_normal, light.direction, value.density)) return;
    const float factor = (light.delta ? 1.0f : power_heuristic(light.density, value.density)) / light.density;
    if (light.cast_shadow && shadowed(point, light, visitor)) return;
    value.diffuse = surface.material.albedo * value.density;
    visitor.lit(path, value, light.radiance * factor);
  }

  template <class Visitor, class Light>
  bool shadowed(const SurfacePoint& point, const Light& light, Visitor& visitor) const {
    const Ray ray = shadow_ray(point, light);
    counts_.shadow++;
    visitor.traced(ray, true);
    return scene_.rays.occluded(ray);
  }

  template <class Visitor>
  static bool answered(const Visitor& visitor) {
    if constexpr (kMayAnswer<Visitor>)
      return visitor.answered();
    else
      return false;
  }

  /// Several samples of the lights: their choice in even steps, the place on them by a lattice (Roberts 2018).
  template <class Visitor>
  void ask_lights(const PathState& path, const SurfacePoint& point, const Surface& surface, const Surface& diffuse,
                  float scatter_share, float u_light, const Vec2& u, Visitor& visitor) const {
    const uint32_t count = visitor.lights(path);
    if (!count) {  // the visitor knows the diffuse lobes' direct light as well
      Surface none;
      if (surface.count) look_for_light(path, point, surface, &none, scatter_share, u_light, u, visitor);
      return;
    }
    const float share = 1.0f / float(count);
    const auto fraction = [](float x) { return std::fmin(x - std::floor(x), 0x1.fffffep-1f); };
    for (uint32_t k = 0; k < count; ++k) {
      const Vec2 place = k ? Vec2(fraction(u.x + 0.7548777f * float(k)), fraction(u.y + 0.5698403f * float(k))) : u;
      look_for_light(path, point, surface, &diffuse, scatter_share, k ? fraction(u_light + share * float(k)) : u_light,
                     place, visitor, share);
    }
  }

  template <class Visitor>
  void look_for_light(const PathState& path, const SurfacePoint& point, const Surface& surface,
                      [[maybe_unused]] const Surface* diffuse, [[maybe_unused]] float scatter_share, float u_light,
                      const Vec2& u, Visitor& visitor, [[maybe_unused]] float share = 1.0f) const {
    LightSample light;
    if (!scene_.lights.sample(point.position, light_normal(point, surface), u_light, u, light)) return;
    if constexpr (!kStraight) scatter_share = 1.0f;  // a constant to the compiler
    BsdfValue value = evaluate<!kLobes>(surface, point.face_normal, point.outgoing, light.direction);
    float weight = 1.0f;
    const bool split = kSplits<Visitor> || (kMayAnswer<Visitor> && diffuse);
    if (split) {  // nothing but this sample looks for the diffuse lobes' light
      if (!light.delta) weight = power_heuristic(light.density, value.density * scatter_share);
      const BsdfValue whole = evaluate<!kLobes>(*diffuse, point.face_normal, point.outgoing, light.direction);
      value.diffuse = value.diffuse * weight + whole.diffuse;
      value.glossy = value.glossy * weight + whole.glossy;
      value.transmission = value.transmission * weight + whole.transmission;
      weight = 1.0f;
    }
    if constexpr (kShapes || kStraight) {
      if ((light.visibility & kVisibleAll) != kVisibleAll) {
        if (!(light.visibility & kVisibleDiffuse)) value.diffuse = Rgb(0.0f);
        if (!(light.visibility & kVisibleGlossy)) value.glossy = Rgb(0.0f);
        if (!(light.visibility & kVisibleTransmission)) value.transmission = Rgb(0.0f);
      }
    }
    if (is_black(total<kLobes>(value))) return;
    if (!split) weight = light.delta ? 1.0f : power_heuristic(light.density, value.density * scatter_share);
    if constexpr (kSplits<Visitor>) weight *= share;
    Rgb arriving = light.radiance * (weight / light.density);
    if (light.cast_shadow) {
      if constexpr (kStraight) {
        const Ray ray = shadow_ray(point, light);
        counts_.shadow++;
        visitor.traced(ray, true);
        arriving *= transmittance(walk_, ray, path.context, counts_);
        if (is_black(arriving)) return;
      } else {
        if (shadowed(point, light, visitor)) return;
      }
    }
    visitor.lit(path, value, arriving);
  }

  static Vec3 light_normal(const SurfacePoint& point, [[maybe_unused]] const Surface& surface) {
    if constexpr (kLobes) {
      if (surface.effects & kTransmission) return Vec3(0.0f);
    }
    return point.normal;
  }

  /// All bounces are diffuse, and this is the depth-th.
  bool scatter_lambert(PathState& path, const SurfacePoint& point, const LambertSurface& surface, uint32_t depth,
                       const Vec2& u) const {
    Vec3 direction;
    if (!sample_lambert(surface.normal, point.face_normal, u, direction, path.density)) return false;
    path.throughput *= surface.material.albedo * path.density / path.density;
    if (is_black(path.throughput)) return false;
    leave(path, point, direction);
    path.light_normal = point.normal;
    path.context.kind = PathContext::kReflection | PathContext::kDiffuse;
    path.context.depth = path.context.diffuse_depth = uint16_t(depth);
    path.ray.mask = kVisibleDiffuse;
    return true;
  }

  static void leave(PathState& path, const SurfacePoint& point, const Vec3& direction) {
    path.position = point.position;
    path.ray.origin = offset_origin(point, direction);
    path.ray.direction = direction;
    path.ray.t_min = 0.0f;
    path.ray.t_max = kInfinity;
  }

  template <class Visitor>
  bool scatter(PathState& path, const SurfacePoint& point, const Surface& surface, float share, float u_lobe,
               const Vec2& u, Visitor& visitor) const {
    if constexpr (!kStraight) share = 1.0f;
    const BsdfSample s = sample<!kLobes>(surface, point.face_normal, point.outgoing, u_lobe, u);
    if constexpr (kCarries<Visitor>) visitor.turned(s);
    if (!s.valid || !(s.value.density > 0.0f)) return false;
    visitor.scattered(path, s);
    const Rgb factor = total<kLobes>(s.value) / (s.value.density * share);
    path.throughput *= factor;
    if constexpr (kCarries<Visitor>) path.throughput = visitor.carried(factor);
    if (is_black(path.throughput)) return false;
    path.density = kLobes && s.delta ? 0.0f : s.value.density * share;
    leave(path, point, s.direction);
    path.light_normal = light_normal(point, surface);
    path.last = count_bounce(path.context, walk_.limits, s.pass, s.transmitted, s.delta);
    path.ray.mask = visibility_of(path.context.kind);
    return true;
  }

  const WalkScene& walk_;
  const CommittedScene& scene_;
  RayCounts& counts_;
  const uint32_t most_diffuse_ = std::min(walk_.limits.max_bounces, walk_.limits.diffuse);
  const LoneLight* const lone_ = scene_.lights.lone();
  const bool has_world_ = scene_.materials.has_world();
  const bool all_plain_ = scene_.materials.all_plain();
  const bool some_read_uv_ = !walk_.with_uv && scene_.materials.some_read_uv();
};

}  // namespace afterglow
