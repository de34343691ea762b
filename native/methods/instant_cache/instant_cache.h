// SPDX-License-Identifier: GPL-3.0-or-later
// The temporal instant cache (Debattista, Dubla, Banterle, Santos and Chalmers 2009, "Instant Caching for Interactive
// Global Illumination"): light from virtual point lights is gathered at sparse records and interpolated; after an edit
// only the visibility that it can have changed is asked again.
#pragma once

#include "methods/method.h"

namespace afterglow::instant_cache {

MethodDescription describe();
std::unique_ptr<IndirectMethod> make();

}  // namespace afterglow::instant_cache
