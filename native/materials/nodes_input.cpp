// SPDX-License-Identifier: GPL-3.0-or-later
// Input nodes: what a program may read of the hit, the path and the object.
#include <algorithm>

#include "materials/attributes.h"
#include "materials/emitter.h"

namespace afterglow {
namespace {

void outputs(Emitter& e, Op op, std::initializer_list<std::pair<const char*, Type>> names, bool with_offset) {
  uint32_t k = 0;
  for (const auto& [name, type] : names) {
    e.output(name, type, with_offset ? e.emit(op, {}, {k, e.offset()}) : e.emit(op, {}, {k}));
    ++k;
  }
}

void texture_coordinate(Emitter& e) {
  const uint32_t offset = e.offset();
  std::vector<uint32_t> object{2, offset, 0};
  if (const std::vector<float>* m = e.table("object_to_world"); m && m->size() >= 12) {
    object[2] = 1;
    for (int k = 0; k < 12; ++k) object.push_back(Emitter::bits((*m)[size_t(k)]));
  }
  e.output("generated", Type::kVector, e.emit(Op::kTexCoord, {}, {0, offset}));
  e.output("normal", Type::kVector, e.emit(Op::kTexCoord, {}, {1, offset}));
  e.output("uv", Type::kVector, e.emit(Op::kUv, {}, {offset}));
  e.output("object", Type::kVector, e.emit(Op::kTexCoord, {}, object));
  e.output("camera", Type::kVector, e.emit(Op::kTexCoord, {}, {3, offset}));
  e.output("window", Type::kVector, e.emit(Op::kTexCoord, {}, {4, offset}));
  e.output("reflection", Type::kVector, e.emit(Op::kTexCoord, {}, {5, offset}));
}

std::string exact_text(Emitter& e, const char* name) {  // attribute names keep their case
  const auto found = e.node().params.find(name);
  const std::string* text = found == e.node().params.end() ? nullptr : std::get_if<std::string>(&found->second);
  return text ? *text : std::string();
}

void uv_map(Emitter& e) {
  const std::string name = exact_text(e, "uv_map");
  e.output(
      "uv", Type::kVector,
      name.empty() ? e.emit(Op::kUv, {}, {e.offset()}) : e.emit(Op::kAttribute, {}, {e.attribute(name), e.offset()}));
}

void attribute(Emitter& e) {
  const std::string name = exact_text(e, "name"), kind = e.text("kind", "geometry");
  if (kind != "geometry") {
    e.warn("node \"" + e.node().name + "\": attribute \"" + name + "\" of kind " + kind + " is 0");
  }
  const auto [value, alpha] = e.emit2(Op::kAttribute, {}, {kind == "geometry" ? e.attribute(name) : kNone, e.offset()});
  e.output("color", Type::kColor, value);
  e.output("vector", Type::kVector, value);
  e.output("fac", Type::kFloat, e.emit(Op::kAverage, {value}));
  e.output("alpha", Type::kFloat, alpha);
}

void color_attribute(Emitter& e) {
  const std::string name = exact_text(e, "name");
  const auto [value, alpha] =
      e.emit2(Op::kAttribute, {}, {e.attribute(name.empty() ? kActiveColor : name), e.offset()});
  e.output("color", Type::kColor, value);
  e.output("alpha", Type::kFloat, alpha);
}

void geometry(Emitter& e) {
  outputs(e, Op::kGeometry,
          {{"position", Type::kVector},
           {"normal", Type::kVector},
           {"tangent", Type::kVector},
           {"true_normal", Type::kVector},
           {"incoming", Type::kVector},
           {"parametric", Type::kVector},
           {"backfacing", Type::kFloat},
           {"pointiness", Type::kFloat},
           {"random_per_island", Type::kFloat}},
          true);
}

void light_path(Emitter& e) {
  outputs(e, Op::kLightPath,
          {{"is_camera_ray", Type::kFloat},
           {"is_shadow_ray", Type::kFloat},
           {"is_diffuse_ray", Type::kFloat},
           {"is_glossy_ray", Type::kFloat},
           {"is_singular_ray", Type::kFloat},
           {"is_reflection_ray", Type::kFloat},
           {"is_transmission_ray", Type::kFloat},
           {"ray_length", Type::kFloat},
           {"ray_depth", Type::kFloat},
           {"diffuse_depth", Type::kFloat},
           {"glossy_depth", Type::kFloat},
           {"transparent_depth", Type::kFloat},
           {"transmission_depth", Type::kFloat}},
          false);
}

void object_info(Emitter& e) {
  outputs(e, Op::kObjectInfo,
          {{"location", Type::kVector},
           {"color", Type::kColor},
           {"alpha", Type::kFloat},
           {"object_index", Type::kFloat},
           {"material_index", Type::kFloat},
           {"random", Type::kFloat}},
          false);
}

void zeros(Emitter& e) {  // particles and hair: not there
  for (const char* name :
       {"index", "random", "age", "lifetime", "size", "is_strand", "intercept", "length", "thickness"}) {
    e.output(name, Type::kFloat, e.constant(0.0f));
  }
  for (const char* name : {"location", "velocity", "angular_velocity", "tangent_normal"})
    e.output(name, Type::kVector, e.constant(0.0f));
}

void camera(Emitter& e) {
  const auto [vector, depth] = e.emit2(Op::kCamera, {}, {0});
  e.output("view_vector", Type::kVector, vector);
  e.output("view_z_depth", Type::kFloat, depth);
  e.output("view_distance", Type::kFloat, e.emit2(Op::kCamera, {}, {1}).second);
}

void fresnel(Emitter& e) {
  e.output("fac", Type::kFloat,
           e.emit(Op::kFresnel, {e.input("ior", Type::kFloat, 1.5f), e.linked_input("normal", Type::kVector)}));
}

void layer_weight(Emitter& e) {
  const auto [fresnel, facing] =
      e.emit2(Op::kLayerWeight, {e.input("blend", Type::kFloat, 0.5f), e.linked_input("normal", Type::kVector)});
  e.output("fresnel", Type::kFloat, fresnel);
  e.output("facing", Type::kFloat, facing);
}

void normal_map(Emitter& e) {
  const std::string space = e.text("space", "tangent"), map = exact_text(e, "uv_map");
  const uint32_t number = space == "object"           ? 1
                          : space == "world"          ? 2
                          : space == "blender_object" ? 3
                          : space == "blender_world"  ? 4
                                                      : 0;
  e.washed |= e.text("shadowing", "") == "chiang";
  const uint32_t tangents = number == 0 ? e.attribute(kTangents + map) : kNone;
  e.output("normal", Type::kVector,
           e.emit(Op::kNormalMap,
                  {e.input("strength", Type::kFloat, 1.0f), e.input("color", Type::kColor, Vec3(0.5f, 0.5f, 1.0f))},
                  {number, map.empty() ? kNone : e.attribute(map), e.version(), tangents}));
}

void bump(Emitter& e) {
  const Operand normal = e.linked_input("normal", Type::kVector);
  if (e.offset() != 0 || !e.linked("height")) {  // nothing to bend by
    return e.output("normal", Type::kVector, normal.none() ? e.emit(Op::kGeometry, {}, {1, 0}) : normal);
  }
  // One pair of neighbours serves a whole program: the last bump's width.
  e.washed |= e.text("shadowing", "") == "chiang";
  e.offset_scale = float(std::clamp(e.number("filter_width", 1.0), 1e-3, 1e3));
  e.output("normal", Type::kVector,
           e.emit(Op::kBump,
                  {e.input_at("height", Type::kFloat, 0, 1.0f), e.input_at("height", Type::kFloat, 1, 1.0f),
                   e.input_at("height", Type::kFloat, 2, 1.0f), e.input("strength", Type::kFloat, 1.0f),
                   e.input("distance", Type::kFloat, 1.0f), normal},
                  {Emitter::bits(e.flag("invert", false) ? -1.0f : 1.0f), e.version()}));
}

void vector_transform(Emitter& e) {
  const auto space = [&](const char* name, const char* missing) {
    const std::string s = e.text(name, missing);
    return s == "object" ? 1u : s == "camera" ? 2u : 0u;
  };
  const std::string kind = e.text("kind", "vector");
  e.output("vector", Type::kVector,
           e.emit(Op::kVectorTransform, {e.input("vector", Type::kVector, 0.5f)},
                  {kind == "point"    ? 1u
                   : kind == "normal" ? 2u
                                      : 0u,
                   space("from", "world"), space("to", "object")}));
}

void tangent(Emitter& e) {
  const bool radial = e.text("direction_type", e.text("kind", "radial").c_str()) != "uv_map";
  const std::string axis = e.text("axis", "z"), map = exact_text(e, "uv_map");
  const uint32_t which = radial ? (axis == "x" ? 0u : axis == "y" ? 1u : 2u) : (map.empty() ? kNone : e.attribute(map));
  e.output("tangent", Type::kVector, e.emit(Op::kTangent, {}, {radial ? 1u : 0u, which}));
}

void wireframe(Emitter& e) {
  e.output("fac", Type::kFloat,
           e.emit(Op::kWireframe, {e.input("size", Type::kFloat, 0.01f)}, {e.flag("use_pixel_size", false)}));
}

void plain_occlusion(Emitter& e) {  // needs rays: unoccluded
  e.warn("node \"" + e.node().name + "\": ambient occlusion and bevels need rays; taken as unoccluded and sharp");
  e.output("color", Type::kColor, e.input("color", Type::kColor, 1.0f));
  e.output("ao", Type::kFloat, e.constant(1.0f));
  e.output("normal", Type::kVector, e.emit(Op::kGeometry, {}, {1, 0}));
}

}  // namespace

void register_input_nodes(std::unordered_map<std::string, Handler>& all) {
  all["texture_coordinate"] = texture_coordinate;
  all["uv_map"] = uv_map;
  all["attribute"] = attribute;
  all["color_attribute"] = all["vertex_color"] = color_attribute;
  all["geometry"] = geometry;
  all["light_path"] = light_path;
  all["object_info"] = object_info;
  for (const char* name : {"particle_info", "hair_info", "curves_info", "point_info", "volume_info"}) all[name] = zeros;
  all["camera"] = camera;
  all["fresnel"] = fresnel;
  all["layer_weight"] = layer_weight;
  all["normal_map"] = normal_map;
  all["bump"] = bump;
  all["vector_transform"] = vector_transform;
  all["tangent"] = tangent;
  all["wireframe"] = wireframe;
  all["ambient_occlusion"] = all["bevel"] = plain_occlusion;
}

}  // namespace afterglow
