// SPDX-License-Identifier: GPL-3.0-or-later
// Procedural texture nodes as instructions.
#include <algorithm>
#include <span>

#include "materials/emitter.h"
#include "materials/sky.h"

namespace afterglow {
namespace {

uint32_t among(Emitter& e, const char* parameter, const char* missing, std::span<const char* const> names) {
  const std::string text = e.text(parameter, missing);
  const auto found = std::find_if(names.begin(), names.end(), [&](const char* name) { return text == name; });
  if (found != names.end()) return uint32_t(found - names.begin());
  e.warn("node \"" + e.node().name + "\": " + parameter + " \"" + text + "\" is unknown; " + names[0] + " is taken");
  return 0;
}

uint32_t dimensions(Emitter& e, const char* missing = "3d") {
  const std::string text = e.text("dimensions", missing);
  return text.empty() || text[0] < '1' || text[0] > '4' ? 3u : uint32_t(text[0] - '0');
}

void noise(Emitter& e) {
  static constexpr const char* kKinds[] = {"fbm", "multifractal", "hybrid_multifractal", "ridged_multifractal",
                                           "hetero_terrain"};
  const uint32_t kind = among(e, "noise_type", "fbm", kKinds);
  const auto [color, fac] =
      e.emit2(Op::kNoise,
              {texture_coordinates(e, false), e.input("w", Type::kFloat, 0.0f), e.input("scale", Type::kFloat, 5.0f),
               e.input("detail", Type::kFloat, 2.0f), e.input("roughness", Type::kFloat, 0.5f),
               e.input("lacunarity", Type::kFloat, 2.0f), e.input("offset", Type::kFloat, 0.0f),
               e.input("gain", Type::kFloat, 1.0f), e.input("distortion", Type::kFloat, 0.0f)},
              {dimensions(e), kind, e.flag("normalize", true)});
  e.output("fac", Type::kFloat, fac);
  e.output("color", Type::kColor, color);
}

/// Blender before 4.1: detail counts one octave more, and the roughness comes from a dimension.
void musgrave(Emitter& e) {
  static constexpr const char* kKinds[] = {"fbm", "multifractal", "hybrid_multifractal", "ridged_multifractal",
                                           "hetero_terrain"};
  const uint32_t kind = among(e, "musgrave_type", "fbm", kKinds);
  const Operand zero = e.constant(0.0f), one = e.constant(1.0f), detail = e.input("detail", Type::kFloat, 2.0f);
  const Operand lacunarity = e.input("lacunarity", Type::kFloat, 2.0f);
  const Operand less = e.emit(Op::kMath, {e.emit(Op::kMath, {detail, one, zero}, {1, 0}), zero, zero}, {12, 0});
  const Operand minus = e.emit(Op::kMath, {e.input("dimension", Type::kFloat, 2.0f), e.constant(-1.0f), zero}, {2, 0});
  const Operand roughness = e.emit(Op::kMath, {lacunarity, minus, zero}, {5, 0});
  const Operand value = e.emit2(Op::kNoise,
                                {texture_coordinates(e, false), e.input("w", Type::kFloat, 0.0f),
                                 e.input("scale", Type::kFloat, 5.0f), less, roughness, lacunarity,
                                 e.input("offset", Type::kFloat, 0.0f), e.input("gain", Type::kFloat, 1.0f), zero},
                                {dimensions(e), kind, 0u})
                            .second;
  const Operand share = e.emit(Op::kClamp, {detail, zero, one}, {0});
  const bool scaled = kind == 0;  // a sum: less than one octave is a fraction of it
  e.output("fac", Type::kFloat, scaled ? e.emit(Op::kMath, {value, share, zero}, {2, 0}) : value);
}

void voronoi(Emitter& e) {
  static constexpr const char* kFeatures[] = {"f1", "f2", "smooth_f1", "distance_to_edge", "n_sphere_radius"};
  static constexpr const char* kMetrics[] = {"euclidean", "manhattan", "chebychev", "minkowski"};
  const uint32_t count = dimensions(e), feature = among(e, "feature", "f1", kFeatures);
  const uint32_t metric = among(e, e.node().params.count("metric") ? "metric" : "distance", "euclidean", kMetrics);
  const std::vector<Operand> inputs{texture_coordinates(e, false),
                                    e.input("w", Type::kFloat, 0.0f),
                                    e.input("scale", Type::kFloat, 5.0f),
                                    e.input("detail", Type::kFloat, 0.0f),
                                    e.input("roughness", Type::kFloat, 0.5f),
                                    e.input("lacunarity", Type::kFloat, 2.0f),
                                    e.input("smoothness", Type::kFloat, 1.0f),
                                    e.input("exponent", Type::kFloat, 0.5f),
                                    e.input("randomness", Type::kFloat, 1.0f)};
  const uint32_t normalize = e.flag("normalize", false);
  const auto [color, distance] = e.emit2(Op::kVoronoi, inputs, {count, feature, metric, normalize, 0});
  e.output("distance", Type::kFloat, distance);
  e.output("color", Type::kColor, color);
  e.output("radius", Type::kFloat, distance);
  const auto [position, w] = e.emit2(Op::kVoronoi, inputs, {count, feature, metric, normalize, 1});
  e.output("position", Type::kVector, position);
  e.output("w", Type::kFloat, w);
}

void wave(Emitter& e) {
  static constexpr const char* kDirections[] = {"x", "y", "z", "diagonal", "spherical"};
  static constexpr const char* kProfiles[] = {"sin", "saw", "tri"};
  const bool rings = e.text("wave_type", "bands") == "rings";
  const uint32_t direction = among(e, rings ? "rings_direction" : "bands_direction", "x", kDirections);
  const auto [color, fac] = e.emit2(
      Op::kWave,
      {texture_coordinates(e, false), e.input("scale", Type::kFloat, 5.0f), e.input("distortion", Type::kFloat, 0.0f),
       e.input("detail", Type::kFloat, 2.0f), e.input("detail_scale", Type::kFloat, 1.0f),
       e.input("detail_roughness", Type::kFloat, 0.5f), e.input("phase_offset", Type::kFloat, 0.0f)},
      {rings, direction, among(e, e.node().params.count("profile") ? "profile" : "wave_profile", "sin", kProfiles)});
  e.output("color", Type::kColor, color);
  e.output("fac", Type::kFloat, fac);
}

void gradient(Emitter& e) {
  static constexpr const char* kKinds[] = {"linear", "quadratic",        "easing",   "diagonal",
                                           "radial", "quadratic_sphere", "spherical"};
  const auto [color, fac] =
      e.emit2(Op::kGradient, {texture_coordinates(e, false)}, {among(e, "gradient_type", "linear", kKinds)});
  e.output("color", Type::kColor, color);
  e.output("fac", Type::kFloat, fac);
}

void magic(Emitter& e) {
  const uint32_t depth = uint32_t(std::clamp(e.number("depth", e.number("turbulence_depth", 2.0)), 0.0, 10.0));
  const auto [color, fac] = e.emit2(
      Op::kMagic,
      {texture_coordinates(e, false), e.input("scale", Type::kFloat, 5.0f), e.input("distortion", Type::kFloat, 1.0f)},
      {depth});
  e.output("color", Type::kColor, color);
  e.output("fac", Type::kFloat, fac);
}

void brick(Emitter& e) {
  const Operand place = e.emit(
      Op::kVectorMath,
      {texture_coordinates(e, false), e.constant(0.0f), e.constant(0.0f), e.input("scale", Type::kFloat, 5.0f)}, {13});
  const auto [color, fac] =
      e.emit2(Op::kBrick,
              {place, e.input("color1", Type::kColor, 0.8f), e.input("color2", Type::kColor, 0.2f),
               e.input("mortar", Type::kColor, 0.0f), e.input("mortar_size", Type::kFloat, 0.02f),
               e.input("mortar_smooth", Type::kFloat, 0.1f), e.input("bias", Type::kFloat, 0.0f),
               e.input("brick_width", Type::kFloat, 0.5f), e.input("row_height", Type::kFloat, 0.25f)},
              {Emitter::bits(float(e.number("offset", 0.5))),
               uint32_t(int32_t(std::clamp(e.number("offset_frequency", 2), 0.0, 1e6))),
               Emitter::bits(float(e.number("squash", 1.0))),
               uint32_t(int32_t(std::clamp(e.number("squash_frequency", 2), 0.0, 1e6)))});
  e.output("color", Type::kColor, color);
  e.output("fac", Type::kFloat, fac);
}

void white_noise(Emitter& e) {
  const auto [color, value] =
      e.emit2(Op::kWhiteNoise, {texture_coordinates(e, false), e.input("w", Type::kFloat, 0.0f)}, {dimensions(e)});
  e.output("value", Type::kFloat, value);
  e.output("color", Type::kColor, color);
}

void sky(Emitter& e) {
  const std::string kind = e.text("sky_type", "nishita");
  std::vector<float> numbers;
  const bool analytic = kind == "preetham" || kind == "hosek_wilkie";
  if (analytic) {
    if (kind == "hosek_wilkie") e.warn("node \"" + e.node().name + "\": the Hosek/Wilkie sky is shown as Preetham's");
    Vec3 sun(0, 0, 1);
    if (const std::vector<float>* s = e.table("sun_direction"); s && s->size() >= 3) sun = {(*s)[0], (*s)[1], (*s)[2]};
    numbers = preetham_parameters(sun, float(e.number("turbidity", 2.2)));
  } else {
    if (kind == "multiple_scattering")
      e.warn("node \"" + e.node().name + "\": the sky is shown with single scattering");
    Atmosphere a;
    const auto number = [&](const char* name, float missing) { return float(e.number(name, missing)); };
    a.sun_elevation = number("sun_elevation", 0.2618f), a.sun_rotation = number("sun_rotation", 0.0f);
    a.sun_size = number("sun_size", 0.009512f), a.sun_intensity = number("sun_intensity", 1.0f);
    a.altitude = std::clamp(number("altitude", 0.0f), 0.0f, 59000.0f);
    a.air = number("air_density", 1.0f), a.ozone = number("ozone_density", 1.0f);
    a.dust = e.node().params.count("aerosol_density") ? number("aerosol_density", 1.0f) : number("dust_density", 1.0f);
    a.disc = e.flag("sun_disc", true);
    numbers = atmosphere_parameters(a);
  }
  std::vector<uint32_t> params{analytic ? 0u : 1u};
  for (const float v : numbers) params.push_back(Emitter::bits(v));
  e.output("color", Type::kColor, e.emit(Op::kSky, {texture_coordinates(e, false)}, std::move(params)));
}

}  // namespace

void register_pattern_nodes(std::unordered_map<std::string, Handler>& all) {
  all["noise_texture"] = noise;
  all["musgrave_texture"] = musgrave;
  all["voronoi_texture"] = voronoi;
  all["wave_texture"] = wave;
  all["gradient_texture"] = gradient;
  all["magic_texture"] = magic;
  all["brick_texture"] = brick;
  all["white_noise_texture"] = white_noise;
  all["sky_texture"] = sky;
}

}  // namespace afterglow
