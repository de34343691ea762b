// SPDX-License-Identifier: GPL-3.0-or-later
// Procedural patterns: functions of a place alone. Hashes and gradients are those of Blender's users' files, so that a
// file shows the same pattern.
#pragma once

#include "materials/program.h"

namespace afterglow {

Vec3 run_pattern(const Instruction&, const Vec3& a, const Vec3& b, const Vec3& c, const Operands&, Vec3* second);

}  // namespace afterglow
