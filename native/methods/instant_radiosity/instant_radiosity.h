// SPDX-License-Identifier: GPL-3.0-or-later
// Instant radiosity by ray tracing (Keller 1997; Wald et al. 2002): every pixel asks a part of the virtual point lights
// anew. Nothing is remembered between frames; it is the baseline that the instant cache is measured against.
#pragma once

#include "methods/method.h"

namespace afterglow::instant_radiosity {

MethodDescription describe();
std::unique_ptr<IndirectMethod> make();

}  // namespace afterglow::instant_radiosity
