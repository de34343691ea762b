// SPDX-License-Identifier: GPL-3.0-or-later
// A node graph made ready to run: a flat list of instructions over registers of three floats, constants and a pool of
// further operands and parameters. No strings, no allocation and no virtual calls while it runs.
#pragma once

#include <bit>
#include <vector>

#include "materials/surface.h"
#include "rays/surface_point.h"

namespace afterglow {

enum class Op : uint16_t {
  // conversions and arithmetic: nothing but their operands
  kLuminance,
  kAverage,
  kReplicate,
  kMath,
  kVectorMath,
  kMixFloat,
  kMixVector,
  kMixColor,
  kClamp,
  kMapRange,
  kMapVectorRange,
  kSeparate,
  kCombine,
  kRamp,
  kCurves,
  kHueSaturation,
  kGamma,
  kInvert,
  kBrightContrast,
  kMapping,
  kBlackbody,
  kWavelength,
  kNormalNode,
  kChecker,
  kNoise,
  kVoronoi,
  kWave,
  kGradient,
  kMagic,
  kBrick,
  kWhiteNoise,
  kGabor,
  kSky,
  kVectorRotate,
  kOneMinus,
  kMatrix,
  // what reads the hit
  kFirstHitOp,
  kTexCoord = kFirstHitOp,
  kUv,
  kAttribute,
  kGeometry,
  kLightPath,
  kObjectInfo,
  kCamera,
  kNormalMap,
  kBump,
  kFresnel,
  kLayerWeight,
  kVectorTransform,
  kTangent,
  kWireframe,
  kImage,
  kEnvironment,
  // closures: add to the Surface
  kFirstClosure,
  kDiffuse = kFirstClosure,
  kTranslucent,
  kGlossy,
  kGlass,
  kRefraction,
  kMetallic,
  kSheenLobe,
  kTransparent,
  kEmission,
  kHoldout,
  kPrincipled,
};

inline constexpr uint16_t kConstantBit = 0x8000, kNoOperand = 0xffff;
inline constexpr int kMaxRegisters = 1024;

struct Instruction {
  Op op;
  uint16_t out, out2;  // kNoOperand: not wanted
  uint16_t a, b, c;    // a register, or a constant with kConstantBit
  uint32_t data;       // into the pool: further operands, then parameters
};

class Images;
struct AttributeTables;

struct Program {
  std::vector<Instruction> code;
  std::vector<Vec3> constants;
  std::vector<uint32_t> pool;
  uint32_t registers = 0;
  uint32_t effects = 0;  // Effect bits
  bool reads_uv = false;
  bool reads_offsets = false;  // has a bump: neighbours of the point are needed
  bool washed = false;         // bumps shadowed as before Blender 4.3
  float offset_scale = 1.0f;   // distance of those neighbours, in pixels
  bool folded = false;         // `ready` is the whole result but for normals
  bool empty = true;           // nothing comes out
  Surface ready;
};

/// What instructions may read of the hit. points[1], [2]: moved by a fraction of the footprint, for bumps.
struct HitContext {
  const SurfacePoint* points[3] = {nullptr, nullptr, nullptr};
  const PathContext* path = nullptr;
  const Scene* scene = nullptr;
  const Images* images = nullptr;
  const AttributeTables* attributes = nullptr;
  float offset_scale = 1.0f;
  bool background = false;  // a world's program: the position is the direction
  int32_t material_index = 0;
};

/// The operands of one instruction while it runs.
struct Operands {
  const Vec3* registers;
  const Vec3* constants;
  const uint32_t* pool;  // at the instruction's data
  const Vec3& at(uint32_t index) const {
    return index & kConstantBit ? constants[index & (kConstantBit - 1u)] : registers[index];
  }
  const Vec3& v(int k) const { return at(pool[k]); }
  float f(int k) const { return at(pool[k]).x; }
  bool given(int k) const { return pool[k] != kNoOperand; }
  uint32_t u(int k) const { return pool[k]; }
  int32_t i(int k) const { return int32_t(pool[k]); }
  float p(int k) const { return std::bit_cast<float>(pool[k]); }
};

/// Runs a program; out may be null when it has no closures. registers: room for Program::registers.
void execute(const Program&, const HitContext&, Vec3* registers, Surface* out);

/// Runs for a hit: registers on the stack, offset points when needed, sampling weights normalised.
void run(const Program&, HitContext&, Surface&);

// Instructions too long for the interpreter's own file.
float run_math(uint32_t operation, float a, float b, float c);
void run_vector_math(uint32_t operation, const Vec3& a, const Vec3& b, const Vec3& c, float scale, Vec3& vector,
                     float& value);
Rgb blend(uint32_t mode, float factor, const Rgb& a, const Rgb& b);
void add_closure(Op, const Operands&, const HitContext&, Surface&);
Vec3 read_hit(const Instruction&, const Operands&, const HitContext&, Vec3* out2);
Vec3 run_texture(const Instruction&, const Operands&, const HitContext&, Vec3* out2);

}  // namespace afterglow
