// SPDX-License-Identifier: GPL-3.0-or-later
// The layered filter (Roth et al. 2020, 3.4) over a finished picture, for every method and without any library: light
// is divided by the albedo of the first surface that is neither mirror nor glass, filtered along that surface as far as
// the pixel's own samples are believed to be off, and multiplied again.
#pragma once

#include <memory>

#include "film/denoiser.h"

namespace afterglow {

std::unique_ptr<Denoiser> make_layered_denoiser();

}  // namespace afterglow
