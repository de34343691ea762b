// SPDX-License-Identifier: GPL-3.0-or-later
// Edges of what shines: a pixel that a bright window half fills is the noisiest of all, and what it lacks is not light
// but one ray a sample, which ends at the first surface. Where neighbouring pixels see different light at emitters and
// in the sky, rays of their own tell its mean, and samples with all their shadow rays tell the rest (splitting, Arvo
// and Kirk 1990). A pixel's own samples have no say in whether it
// gets such rays, so that no mean falls or rises.
#pragma once

#include <span>
#include <vector>

#include "methods/walk_settings.h"
#include "render/wavefront.h"

namespace afterglow {

/// How many rays see to an edge when every pixel has `samples` samples; grows as they double.
uint32_t sight_wanted(uint32_t samples);

/// Requests for pixels whose eight neighbours met light that differs by more than two per cent of what they show, and
/// that have less than half of the `wanted` rays: so many that they have all, or that there are eight for each pixel of
/// the film.
std::vector<PixelRequest> sight_requests(const Film&, uint32_t wanted);

/// Traces the requests' rays. What they meet joins the film by see().
void look(const CommittedScene&, std::span<const PixelRequest>, Film&, Work&, const WalkSettings&, RayCounts&);

}  // namespace afterglow
