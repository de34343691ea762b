// SPDX-License-Identifier: GPL-3.0-or-later
// Texture instructions.
#include "materials/program.h"

namespace afterglow {

Vec3 run_texture(const Instruction&, const Operands&, const HitContext&, Vec3* second) {
  *second = Vec3(1.0f);
  return Vec3(1.0f, 0.0f, 1.0f);
}

}  // namespace afterglow
