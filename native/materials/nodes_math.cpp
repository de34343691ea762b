// SPDX-License-Identifier: GPL-3.0-or-later
// Converter and colour nodes: arithmetic that needs nothing but its inputs.
#include <algorithm>
#include <span>

#include "materials/emitter.h"

namespace afterglow {
namespace {

using Names = std::span<const char* const>;

constexpr const char* kMathOperations[] = {
    "add",          "subtract",     "multiply", "divide",     "multiply_add",   "power",     "logarithm",
    "sqrt",         "inverse_sqrt", "absolute", "exponent",   "minimum",        "maximum",   "less_than",
    "greater_than", "sign",         "compare",  "smooth_min", "smooth_max",     "round",     "floor",
    "ceil",         "trunc",        "fract",    "modulo",     "floored_modulo", "wrap",      "snap",
    "pingpong",     "sine",         "cosine",   "tangent",    "arcsine",        "arccosine", "arctangent",
    "arctan2",      "sinh",         "cosh",     "tanh",       "radians",        "degrees"};
constexpr const char* kVectorOperations[] = {
    "add",     "subtract",    "multiply",    "divide",   "multiply_add", "cross_product", "project",   "reflect",
    "refract", "faceforward", "dot_product", "distance", "length",       "scale",         "normalize", "absolute",
    "power",   "sign",        "minimum",     "maximum",  "floor",        "ceil",          "fraction",  "modulo",
    "wrap",    "snap",        "sine",        "cosine",   "tangent",      "round"};
constexpr const char* kBlendModes[] = {"mix",          "darken",     "multiply",  "burn",     "lighten",
                                       "screen",       "dodge",      "add",       "overlay",  "soft_light",
                                       "linear_light", "difference", "exclusion", "subtract", "divide",
                                       "hue",          "saturation", "color",     "value"};
constexpr const char* kRangeKinds[] = {"linear", "stepped", "smoothstep", "smootherstep"};
constexpr const char* kMappingKinds[] = {"point", "texture", "vector", "normal"};
constexpr const char* kColorModels[] = {"rgb", "hsv", "hsl"};
constexpr const char* kRotations[] = {"axis_angle", "x_axis", "y_axis", "z_axis", "euler_xyz"};

/// The place of a parameter among names; unknown: the first, with a warning.
uint32_t choice(Emitter& e, const char* parameter, const char* missing, Names names) {
  const std::string text = e.text(parameter, missing);
  const auto found = std::find_if(names.begin(), names.end(), [&](const char* name) { return text == name; });
  if (found != names.end()) return uint32_t(found - names.begin());
  e.warn("node \"" + e.node().name + "\": " + parameter + " \"" + text + "\" is unknown; " + names[0] + " is taken");
  return 0;
}

Operand clamped(Emitter& e, Operand o) { return e.emit(Op::kClamp, {o, e.constant(0.0f), e.constant(1.0f)}, {0}); }

void math(Emitter& e) {
  const uint32_t operation = choice(e, "operation", "add", kMathOperations);
  e.output("value", Type::kFloat,
           e.emit(Op::kMath,
                  {e.input("value", Type::kFloat, 0.5f), e.input("value_001", Type::kFloat, 0.5f),
                   e.input("value_002", Type::kFloat, 0.5f)},
                  {operation, e.flag("clamp", e.flag("use_clamp", false))}));
}

void vector_math(Emitter& e) {
  const uint32_t operation = choice(e, "operation", "add", kVectorOperations);
  const auto [vector, value] =
      e.emit2(Op::kVectorMath,
              {e.input("vector", Type::kVector, 0.0f), e.input("vector_001", Type::kVector, 0.0f),
               e.input("vector_002", Type::kVector, 0.0f), e.input("scale", Type::kFloat, 1.0f)},
              {operation});
  e.output("vector", Type::kVector, vector);
  e.output("value", Type::kFloat, value);
}

void mix_colors(Emitter& e, Operand factor, Operand a, Operand b, const char* output) {
  const uint32_t mode = choice(e, "blend", "mix", kBlendModes);
  const bool clamp = e.flag("clamp_result", e.flag("clamp", false));
  e.output(output, Type::kColor, e.emit(Op::kMixColor, {factor, a, b}, {mode, clamp}));
}

void mix(Emitter& e) {
  const std::string type = e.text("data_type", "float");
  const bool clamp = e.flag("clamp_factor", true);
  const bool per_channel = type == "vector" && e.text("factor_mode", "uniform") == "non_uniform";
  Operand factor = e.input("factor", per_channel ? Type::kVector : Type::kFloat, 0.5f);
  if (type == "color" || type == "rgba") {
    if (clamp) factor = clamped(e, factor);
    return mix_colors(e, factor, e.input("a", Type::kColor, 0.5f), e.input("b", Type::kColor, 0.5f), "result");
  }
  if (type != "vector") {
    if (clamp) factor = clamped(e, factor);
    e.output("result", Type::kFloat,
             e.emit(Op::kMixFloat, {factor, e.input("a", Type::kFloat, 0.0f), e.input("b", Type::kFloat, 0.0f)}));
    return;
  }
  if (!per_channel) factor = e.emit(Op::kReplicate, {factor});
  if (clamp) {
    factor = e.emit(Op::kVectorMath, {factor, e.constant(0.0f), e.constant(0.0f), e.constant(1.0f)}, {19});
    factor = e.emit(Op::kVectorMath, {factor, e.constant(1.0f), e.constant(0.0f), e.constant(1.0f)}, {18});
  }
  e.output("result", Type::kVector,
           e.emit(Op::kMixVector, {factor, e.input("a", Type::kVector, 0.0f), e.input("b", Type::kVector, 0.0f)}));
}

void mix_rgb(Emitter& e) {
  mix_colors(e, clamped(e, e.input("fac", Type::kFloat, 0.5f)), e.input("color1", Type::kColor, 0.5f),
             e.input("color2", Type::kColor, 0.5f), "color");
}

void separate(Emitter& e) {
  const bool vector = e.node().type == "separate_xyz" || e.text("mode", "rgb") == "xyz" || e.linked("vector");
  const uint32_t mode = vector ? 0u : choice(e, "mode", "rgb", kColorModels);
  const Operand in = e.linked("vector")                ? e.input("vector", Type::kVector, 0.0f)
                     : e.node().inputs.count("vector") ? e.input("vector", Type::kVector, 0.0f)
                                                       : e.input("color", vector ? Type::kVector : Type::kColor, 0.8f);
  static constexpr const char* kNames[3][3] = {{"red", "x", "r"}, {"green", "y", "g"}, {"blue", "z", "b"}};
  for (uint32_t k = 0; k < 3; ++k) {
    const Operand channel = e.emit(Op::kSeparate, {in}, {mode, k});
    for (const char* name : kNames[k]) e.output(name, Type::kFloat, channel);
  }
}

void combine(Emitter& e) {
  const bool vector = e.node().type == "combine_xyz" || e.text("mode", "rgb") == "xyz";
  const uint32_t mode = vector ? 0u : choice(e, "mode", "rgb", kColorModels);
  const auto channel = [&](const char* name, const char* other) {
    return e.node().inputs.count(other) ? e.input(other, Type::kFloat, 0.0f) : e.input(name, Type::kFloat, 0.0f);
  };
  const Operand result =
      e.emit(Op::kCombine, {channel("red", "x"), channel("green", "y"), channel("blue", "z")}, {mode});
  e.output("color", vector ? Type::kVector : Type::kColor, result);
  e.output("vector", vector ? Type::kVector : Type::kColor, result);
}

void color_ramp(Emitter& e) {
  const std::vector<float>* table = e.table("table");
  Operand factor = e.input("fac", Type::kFloat, 0.5f);
  if (!table || table->size() < 4) {
    e.warn("node \"" + e.node().name + "\": a colour ramp without a table passes its factor through");
    return e.output("color", Type::kColor, e.emit(Op::kReplicate, {factor}));
  }
  std::vector<uint32_t> params{e.flag("interpolate", true), uint32_t(table->size() / 4)};
  for (const float v : *table) params.push_back(Emitter::bits(v));
  const auto [color, alpha] = e.emit2(Op::kRamp, {factor}, std::move(params));
  e.output("color", Type::kColor, color);
  e.output("alpha", Type::kFloat, alpha);
}

void curves(Emitter& e) {
  const std::string& type = e.node().type;
  const bool single = type == "float_curve";
  const Type kind = single ? Type::kFloat : type == "vector_curve" ? Type::kVector : Type::kColor;
  const char* name = single ? "value" : type == "vector_curve" ? "vector" : "color";
  const Operand value = e.input(name, kind, 0.0f), factor = e.input("fac", Type::kFloat, 1.0f);
  const std::vector<float>* table = e.table("table");
  const uint32_t width = single ? 1u : 3u;
  if (!table || table->size() < width) return e.output(name, kind, value);
  float low = 0.0f, high = 1.0f;
  if (const std::vector<float>* range = e.table("range"); range && range->size() >= 2)
    low = (*range)[0], high = (*range)[1];
  std::vector<uint32_t> params{width, uint32_t(table->size() / width), Emitter::bits(low), Emitter::bits(high),
                               e.flag("extrapolate", true)};
  for (const float v : *table) params.push_back(Emitter::bits(v));
  e.output(name, kind, e.emit(Op::kCurves, {factor, value}, std::move(params)));
}

void hue_saturation(Emitter& e) {
  e.output("color", Type::kColor,
           e.emit(Op::kHueSaturation, {e.input("hue", Type::kFloat, 0.5f), e.input("saturation", Type::kFloat, 1.0f),
                                       e.input("value", Type::kFloat, 1.0f), e.input("fac", Type::kFloat, 1.0f),
                                       e.input("color", Type::kColor, 0.8f)}));
}

void gamma(Emitter& e) {
  e.output("color", Type::kColor,
           e.emit(Op::kGamma, {e.input("color", Type::kColor, 1.0f), e.input("gamma", Type::kFloat, 1.0f)}));
}

void invert(Emitter& e) {
  e.output("color", Type::kColor,
           e.emit(Op::kInvert, {e.input("fac", Type::kFloat, 1.0f), e.input("color", Type::kColor, 0.0f)}));
}

void bright_contrast(Emitter& e) {
  e.output("color", Type::kColor,
           e.emit(Op::kBrightContrast, {e.input("color", Type::kColor, 1.0f), e.input("bright", Type::kFloat, 0.0f),
                                        e.input("contrast", Type::kFloat, 0.0f)}));
}

void rgb_to_bw(Emitter& e) {
  const Operand value = e.convert(e.input("color", Type::kColor, 0.5f), Type::kColor, Type::kFloat);
  e.output("val", Type::kFloat, value);
}

void clamp(Emitter& e) {
  e.output("result", Type::kFloat,
           e.emit(Op::kClamp,
                  {e.input("value", Type::kFloat, 1.0f), e.input("min", Type::kFloat, 0.0f),
                   e.input("max", Type::kFloat, 1.0f)},
                  {e.text("kind", "minmax") == "range"}));
}

void map_range(Emitter& e) {
  const bool vector = e.text("data_type", "float").find("vector") != std::string::npos;
  const uint32_t kind = choice(e, "interpolation", "linear", kRangeKinds);
  const bool clamp = e.flag("clamp", true) && kind <= 1;
  if (!vector) {
    const Operand result = e.emit(Op::kMapRange,
                                  {e.input("value", Type::kFloat, 1.0f), e.input("from_min", Type::kFloat, 0.0f),
                                   e.input("from_max", Type::kFloat, 1.0f), e.input("to_min", Type::kFloat, 0.0f),
                                   e.input("to_max", Type::kFloat, 1.0f), e.input("steps", Type::kFloat, 4.0f)},
                                  {kind, clamp});
    return e.output("result", Type::kFloat, result);
  }
  const auto either = [&](const char* three, const char* one, float missing) {
    return e.input(e.node().inputs.count(three) ? three : one, Type::kVector, missing);
  };
  e.output("vector", Type::kVector,
           e.emit(Op::kMapVectorRange,
                  {e.input("vector", Type::kVector, 0.0f), either("from_min_float3", "from_min", 0.0f),
                   either("from_max_float3", "from_max", 1.0f), either("to_min_float3", "to_min", 0.0f),
                   either("to_max_float3", "to_max", 1.0f), either("steps_float3", "steps", 4.0f)},
                  {kind, clamp}));
}

void mapping(Emitter& e) {
  e.output("vector", Type::kVector,
           e.emit(Op::kMapping,
                  {e.input("vector", Type::kVector, 0.0f), e.input("location", Type::kVector, 0.0f),
                   e.input("rotation", Type::kVector, 0.0f), e.input("scale", Type::kVector, 1.0f)},
                  {choice(e, e.node().params.count("kind") ? "kind" : "vector_type", "point", kMappingKinds)}));
}

void vector_rotate(Emitter& e) {
  const uint32_t kind = choice(e, "kind", "axis_angle", kRotations);
  const Operand turn =
      kind == 4 ? e.input("rotation", Type::kVector, 0.0f) : e.input("axis", Type::kVector, Vec3(0, 0, 1));
  e.output("vector", Type::kVector,
           e.emit(Op::kVectorRotate,
                  {e.input("vector", Type::kVector, 0.0f), e.input("center", Type::kVector, 0.0f), turn,
                   e.input("angle", Type::kFloat, 0.0f)},
                  {kind, e.flag("invert", false)}));
}

void rgb(Emitter& e) {
  Vec3 color(0.5f);
  if (const std::vector<float>* table = e.table("color"); table && table->size() >= 3)
    color = {(*table)[0], (*table)[1], (*table)[2]};
  e.output("color", Type::kColor,
           e.node().inputs.count("color") ? e.input("color", Type::kColor, 0.5f) : e.constant(color));
}

void value(Emitter& e) { e.output("value", Type::kFloat, e.constant(float(e.number("value", 0.5)))); }

void blackbody(Emitter& e) {
  e.output("color", Type::kColor, e.emit(Op::kBlackbody, {e.input("temperature", Type::kFloat, 1500.0f)}));
}

void wavelength(Emitter& e) {
  e.output("color", Type::kColor, e.emit(Op::kWavelength, {e.input("wavelength", Type::kFloat, 500.0f)}));
}

void normal(Emitter& e) {
  Vec3 direction(0, 0, 1);
  if (const std::vector<float>* table = e.table("direction"); table && table->size() >= 3)
    direction = {(*table)[0], (*table)[1], (*table)[2]};
  const auto [n, dot] =
      e.emit2(Op::kNormalNode, {e.input("normal", Type::kVector, Vec3(0, 0, 1)), e.constant(direction)});
  e.output("normal", Type::kVector, n);
  e.output("dot", Type::kFloat, dot);
}

}  // namespace

void register_math_nodes(std::unordered_map<std::string, Handler>& all) {
  all["math"] = math;
  all["vector_math"] = vector_math;
  all["mix"] = mix;
  all["mix_rgb"] = mix_rgb;
  for (const char* name : {"separate", "separate_rgb", "separate_hsv", "separate_xyz", "separate_color"})
    all[name] = separate;
  for (const char* name : {"combine", "combine_rgb", "combine_hsv", "combine_xyz", "combine_color"})
    all[name] = combine;
  all["color_ramp"] = color_ramp;
  for (const char* name : {"rgb_curve", "vector_curve", "float_curve"}) all[name] = curves;
  all["hue_saturation"] = hue_saturation;
  all["gamma"] = gamma;
  all["invert"] = invert;
  all["bright_contrast"] = bright_contrast;
  all["rgb_to_bw"] = rgb_to_bw;
  all["clamp"] = clamp;
  all["map_range"] = map_range;
  all["mapping"] = mapping;
  all["vector_rotate"] = vector_rotate;
  all["rgb"] = rgb;
  all["value"] = value;
  all["blackbody"] = blackbody;
  all["wavelength"] = wavelength;
  all["normal"] = normal;
}

}  // namespace afterglow
