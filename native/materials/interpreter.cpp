// SPDX-License-Identifier: GPL-3.0-or-later
// Runs programs: one switch over the instructions. Short operations stand here, long ones in math_ops, hit_ops,
// textures and closures.
#include <algorithm>

#include "materials/attributes.h"
#include "materials/closures.h"
#include "materials/color_ops.h"
#include "scene/effects.h"

namespace afterglow {
namespace {

/// Table lookups: `table` holds n rows of `width` floats.
Vec4 row(const Operands& in, int start, int n, int width, float position, bool interpolate) {
  const float f = saturate(position) * float(n - 1);
  int k = std::clamp(int(f), 0, n - 1);
  const int next = std::min(k + 1, n - 1);
  const float t = interpolate ? f - float(k) : 0.0f;
  Vec4 result(0.0f);
  for (int c = 0; c < width; ++c) {
    const float a = in.p(start + k * width + c), b = in.p(start + next * width + c);
    result[c] = a + (b - a) * t;
  }
  return result;
}

/// Curves reach beyond their range along their first or last step.
float curve(const Operands& in, int start, int n, int width, int channel, float position, bool extrapolate) {
  const auto at = [&](int k) { return in.p(start + k * width + channel); };
  if (extrapolate && n > 1 && position < 0.0f) return at(0) + (at(0) - at(1)) * -position * float(n - 1);
  if (extrapolate && n > 1 && position > 1.0f)
    return at(n - 1) + (at(n - 1) - at(n - 2)) * (position - 1.0f) * float(n - 1);
  const float f = saturate(position) * float(n - 1);
  const int k = std::min(int(f), n - 1);
  const float t = f - float(k);
  return t > 0.0f ? at(k) + (at(std::min(k + 1, n - 1)) - at(k)) * t : at(k);
}

Vec3 run_curves(const Operands& in, float factor, const Vec3& value) {  // width, n, lo, hi, extrapolate, table
  const int width = in.i(0), n = in.i(1);
  if (n < 1) return value;
  const float low = in.p(2), span = in.p(3) - low;
  if (span == 0.0f) return value;
  Vec3 result;
  for (int c = 0; c < 3; ++c) {
    result[c] = curve(in, 5, n, width, width == 3 ? c : 0, (value[c] - low) / span, in.u(4) != 0);
  }
  return lerp(value, result, factor);
}

float map_range(uint32_t kind, float v, float a, float b, float c, float d, float steps) {
  if (kind <= 1) {
    if (a == b) return 0.0f;
    float t = (v - a) / (b - a);
    if (kind == 1) t = steps > 0.0f ? std::floor(t * (steps + 1.0f)) / steps : 0.0f;
    return c + t * (d - c);
  }
  const bool turned = a > b;
  float t = a == b ? 0.0f : saturate(turned ? (v - b) / (a - b) : (v - a) / (b - a));
  t = kind == 2 ? t * t * (3.0f - 2.0f * t) : t * t * t * (t * (t * 6.0f - 15.0f) + 10.0f);
  if (turned) t = 1.0f - t;
  return c + t * (d - c);
}

float clamp_between(float v, float a, float b) { return a > b ? std::clamp(v, b, a) : std::clamp(v, a, b); }

Vec3 rotate_euler(const Vec3& v, const Vec3& e, bool inverse) {  // x, then y, then z
  const float cx = std::cos(e.x), sx = std::sin(e.x), cy = std::cos(e.y), sy = std::sin(e.y), cz = std::cos(e.z),
              sz = std::sin(e.z);
  const Vec3 r0(cy * cz, sy * sx * cz - cx * sz, sy * cx * cz + sx * sz);
  const Vec3 r1(cy * sz, sy * sx * sz + cx * cz, sy * cx * sz - sx * cz);
  const Vec3 r2(-sy, cy * sx, cy * cx);
  if (inverse) return r0 * v.x + r1 * v.y + r2 * v.z;
  return {glm::dot(r0, v), glm::dot(r1, v), glm::dot(r2, v)};
}

Vec3 safe_divide(const Vec3& a, const Vec3& b) {
  return {b.x != 0 ? a.x / b.x : 0.0f, b.y != 0 ? a.y / b.y : 0.0f, b.z != 0 ? a.z / b.z : 0.0f};
}

Vec3 run_mapping(uint32_t kind, const Vec3& v, const Vec3& location, const Vec3& rotation, const Vec3& scale) {
  switch (kind) {
    case 1:
      return safe_divide(rotate_euler(v - location, rotation, true), scale);  // texture
    case 2:
      return rotate_euler(v * scale, rotation, false);  // vector
    case 3: {                                           // normal
      const Vec3 n = rotate_euler(safe_divide(v, scale), rotation, false);
      const float length = glm::length(n);
      return length > 0.0f ? n / length : n;
    }
    default:
      return rotate_euler(v * scale, rotation, false) + location;
  }
}

/// Axis–angle or Euler rotation about a centre.
Vec3 run_vector_rotate(uint32_t kind, bool invert, const Vec3& v, const Vec3& centre, const Vec3& axis_or_euler,
                       float angle) {
  const Vec3 from = v - centre;
  if (kind == 4) return rotate_euler(from, axis_or_euler, invert) + centre;
  Vec3 axis = kind == 1 ? Vec3(1, 0, 0) : kind == 2 ? Vec3(0, 1, 0) : kind == 3 ? Vec3(0, 0, 1) : axis_or_euler;
  const float length = glm::length(axis);
  if (!(length > 0.0f)) return v;
  axis /= length;
  const float a = invert ? -angle : angle, c = std::cos(a), s = std::sin(a);
  return from * c + glm::cross(axis, from) * s + axis * (glm::dot(axis, from) * (1.0f - c)) + centre;
}

float safe_gamma(float v, float gamma) { return v > 0.0f ? std::pow(v, gamma) : v; }

Vec3 to_model(uint32_t mode, const Rgb& c) { return mode == 1 ? rgb_to_hsv(c) : mode == 2 ? rgb_to_hsl(c) : c; }
Rgb from_model(uint32_t mode, const Vec3& c) { return mode == 1 ? hsv_to_rgb(c) : mode == 2 ? hsl_to_rgb(c) : c; }

Rgb hue_saturation(float hue, float saturation, float value, float factor, const Rgb& color) {
  Vec3 hsv = rgb_to_hsv(color);
  hsv.x = hsv.x + hue + 0.5f;
  hsv.x -= std::floor(hsv.x);
  hsv.y = saturate(hsv.y * saturation);
  hsv.z *= value;
  return glm::max(lerp(color, hsv_to_rgb(hsv), factor), Rgb(0.0f));
}

Rgb checker(const Vec3& p, const Rgb& a, const Rgb& b, bool& first) {
  // An offset keeps whole numbers, where faces of cubes lie, from flickering.
  const Vec3 q = (p + 0.000001f) * 0.999999f;
  const auto parity = [](float v) { return std::fabs(v) < 1e9f ? uint32_t(int32_t(std::floor(v))) : 0u; };
  const uint32_t sum = parity(q.x) + parity(q.y) + parity(q.z);
  first = (sum & 1u) != 0;
  return first ? a : b;
}

}  // namespace

void execute(const Program& program, const HitContext& hit, Vec3* r, Surface* out) {
  const Vec3* constants = program.constants.data();
  const uint32_t* pool = program.pool.data();
  for (const Instruction& ins : program.code) {
    const Operands in{r, constants, pool + ins.data};
    if (ins.op >= Op::kFirstClosure) {
      if (out) add_closure(ins.op, in, hit, *out);
      continue;
    }
    static const Vec3 zero(0.0f);
    const Vec3& a = ins.a == kNoOperand ? zero : in.at(ins.a);
    const Vec3& b = ins.b == kNoOperand ? zero : in.at(ins.b);
    const Vec3& c = ins.c == kNoOperand ? zero : in.at(ins.c);
    Vec3 result(0.0f), second(0.0f);
    switch (ins.op) {
      case Op::kLuminance:
        result = Vec3(luminance(a));
        break;
      case Op::kAverage:
        result = Vec3((a.x + a.y + a.z) * (1.0f / 3.0f));
        break;
      case Op::kReplicate:
        result = Vec3(a.x);
        break;
      case Op::kOneMinus:
        result = Vec3(1.0f - a.x);
        break;
      case Op::kMath: {
        const float v = run_math(in.u(0), a.x, b.x, c.x);
        result = Vec3(in.u(1) ? saturate(v) : v);
        break;
      }
      case Op::kVectorMath:
        run_vector_math(in.u(1), a, b, c, in.f(0), result, second.x);
        second = Vec3(second.x);
        break;
      case Op::kMixFloat:
        result = Vec3(b.x + (c.x - b.x) * a.x);
        break;
      case Op::kMixVector:
        result = b + (c - b) * a;
        break;
      case Op::kMixColor: {
        result = blend(in.u(0), a.x, b, c);
        if (in.u(1)) result = saturate(result);
        break;
      }
      case Op::kClamp:
        result = Vec3(in.u(0) ? clamp_between(a.x, b.x, c.x) : std::fmin(std::fmax(a.x, b.x), c.x));
        break;
      case Op::kMapRange: {
        float v = map_range(in.u(3), a.x, b.x, c.x, in.f(0), in.f(1), in.f(2));
        if (in.u(4)) v = clamp_between(v, in.f(0), in.f(1));
        result = Vec3(v);
        break;
      }
      case Op::kMapVectorRange:
        for (int k = 0; k < 3; ++k) {
          float v = map_range(in.u(3), a[k], b[k], c[k], in.v(0)[k], in.v(1)[k], in.v(2)[k]);
          if (in.u(4)) v = clamp_between(v, in.v(0)[k], in.v(1)[k]);
          result[k] = v;
        }
        break;
      case Op::kSeparate:
        result = Vec3(to_model(in.u(0), a)[int(in.u(1))]);
        break;
      case Op::kCombine:
        result = from_model(in.u(0), {a.x, b.x, c.x});
        break;
      case Op::kRamp: {
        const Vec4 v = row(in, 2, in.i(1), 4, a.x, in.u(0) != 0);
        result = Vec3(v), second = Vec3(v.w);
        break;
      }
      case Op::kCurves:
        result = run_curves(in, a.x, b);
        break;
      case Op::kHueSaturation:
        result = hue_saturation(a.x, b.x, c.x, in.f(0), in.v(1));
        break;
      case Op::kGamma:
        result = {safe_gamma(a.x, b.x), safe_gamma(a.y, b.x), safe_gamma(a.z, b.x)};
        break;
      case Op::kInvert:
        result = lerp(b, Rgb(1.0f) - b, a.x);
        break;
      case Op::kBrightContrast: {
        const float scale = 1.0f + c.x, offset = b.x - c.x * 0.5f;
        result = glm::max(a * scale + offset, Rgb(0.0f));
        break;
      }
      case Op::kMapping:
        result = run_mapping(in.u(1), a, b, c, in.v(0));
        break;
      case Op::kMatrix:
        for (int k = 0; k < 3; ++k) {
          result[k] = in.p(4 * k) * a.x + in.p(4 * k + 1) * a.y + in.p(4 * k + 2) * a.z + in.p(4 * k + 3);
        }
        break;
      case Op::kVectorRotate:
        result = run_vector_rotate(in.u(1), in.u(2) != 0, a, b, c, in.f(0));
        break;
      case Op::kBlackbody:
        result = blackbody(a.x);
        break;
      case Op::kWavelength:
        result = wavelength(a.x);
        break;
      case Op::kNormalNode: {
        const float la = glm::length(a), lb = glm::length(b);
        result = lb > 0.0f ? b / lb : b;
        second = Vec3(la > 0.0f ? glm::dot(a / la, result) : 0.0f);
        break;
      }
      case Op::kChecker: {
        bool first;
        result = checker(a * in.f(0), b, c, first);
        second = Vec3(first ? 1.0f : 0.0f);
        break;
      }
      case Op::kNoise:
      case Op::kVoronoi:
      case Op::kWave:
      case Op::kGradient:
      case Op::kMagic:
      case Op::kBrick:
      case Op::kWhiteNoise:
      case Op::kGabor:
      case Op::kSky:
      case Op::kImage:
      case Op::kEnvironment:
        result = run_texture(ins, in, hit, &second);
        break;
      default:
        result = read_hit(ins, in, hit, &second);
    }
    if (ins.out != kNoOperand) r[ins.out] = result;
    if (ins.out2 != kNoOperand) r[ins.out2] = second;
  }
}

namespace {

/// Neighbours on the plane of the face, a pixel away (or of a camera of a thousand pixels, where the path does not
/// say), with the surface's coordinates continued there. To both sides of the same axes as in Cycles: forward
/// differences over a pixel are not the same along others.
void move_points(HitContext& hit, SurfacePoint moved[2]) {
  const SurfacePoint& p = *hit.points[0];
  const Vec3 n = p.face_normal, across(n.z - n.y, n.x - n.z, n.y - n.x);  // (1, 1, 1) × n
  const float size = glm::length(across);
  const Vec3 t = size > 1e-3f ? across / size : Frame(n).t, b = glm::cross(n, t);
  const float pixel = hit.path && hit.path->footprint > 0.0f ? hit.path->footprint : 1e-3f * p.t;
  const float step = std::fmax(pixel * hit.offset_scale, 2e-5f * glm::length(p.position));
  const InstanceRecord* record =
      hit.scene && p.instance < hit.scene->instances().size() ? &hit.scene->instances()[p.instance] : nullptr;
  for (int k = 0; k < 2; ++k) {
    moved[k] = p;
    const Vec3 d = (k == 0 ? t : b) * (step > 0.0f ? step : 1e-4f);
    moved[k].position += d;
    hit.points[k + 1] = &moved[k];
    if (!record || !record->mesh) continue;
    const Mesh& mesh = *record->mesh;
    const uint32_t* v = &mesh.triangles[3 * p.triangle];
    const Vec3 e1 = record->to_world.vector(mesh.positions[v[1]] - mesh.positions[v[0]]);
    const Vec3 e2 = record->to_world.vector(mesh.positions[v[2]] - mesh.positions[v[0]]);
    const float a = glm::dot(e1, e1), b = glm::dot(e1, e2), c = glm::dot(e2, e2), det = a * c - b * b;
    if (!(det > 0.0f)) continue;
    const float d1 = glm::dot(d, e1), d2 = glm::dot(d, e2);
    const float du = (c * d1 - b * d2) / det, dv = (a * d2 - b * d1) / det;
    moved[k].u += du, moved[k].v += dv;
    if (mesh.active_uv >= mesh.uvs.size()) continue;
    Vec2 uv[3];
    corner_values({&mesh.uvs[mesh.active_uv].values.front().x, 2, Domain::kCorner}, mesh, p.triangle, uv);
    moved[k].uv += (uv[1] - uv[0]) * du + (uv[2] - uv[0]) * dv;
  }
}

}  // namespace

void run(const Program& program, HitContext& hit, Surface& out) {
  struct alignas(16) Room {  // not cleared: a register is written before it is read
    Room() {}
    union {
      Vec3 registers[1];
      std::byte bytes[kMaxRegisters * sizeof(Vec3)];
    };
  } room;
  hit.points[1] = hit.points[2] = hit.points[0];
  if (program.reads_offsets && !hit.background) {
    SurfacePoint moved[2];
    hit.offset_scale = program.offset_scale;
    move_points(hit, moved);
    execute(program, hit, room.registers, &out);
  } else {
    execute(program, hit, room.registers, &out);
  }
  for (int k = 0; k < out.count; ++k) {
    Lobe& lobe = out.lobes[k];
    if (!lobe.bumped || lobe.kind > LobeKind::kBurley) continue;
    lobe.tangent = hit.points[0]->normal;  // what its normal was bent from: diffuse lobes have no tangent
    if (program.washed) lobe.distribution = Distribution::kGgxSeparable;
  }
  float sum = 0.0f;
  for (int k = 0; k < out.count; ++k) sum += out.lobes[k].sampling_weight;
  if (out.count == 1 && sum > 0.0f) {
    out.lobes[0].sampling_weight = 1.0f;
    return;
  }
  if (!(sum > 0.0f)) {
    out.count = 0;
    return;
  }
  const float scale = 1.0f / sum;
  for (int k = 0; k < out.count; ++k) out.lobes[k].sampling_weight *= scale;
}

}  // namespace afterglow
