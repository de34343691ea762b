// SPDX-License-Identifier: GPL-3.0-or-later
// Path tracing (Kajiya 1986) with next-event estimation: the truth that every cached method is held against.
// docs/methods/path_tracing.md has the equations.
#pragma once

#include "methods/method.h"

namespace afterglow::path_tracing {

MethodDescription describe();
std::unique_ptr<IndirectMethod> make();

}  // namespace afterglow::path_tracing
