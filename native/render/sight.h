// SPDX-License-Identifier: GPL-3.0-or-later
// Edges of what shines: a pixel that a bright window half fills is the noisiest of all, and what it lacks is not light
// but one ray a sample, which ends at the first surface. Where neighbouring pixels see different light at emitters and
// in the sky, rays of their own tell its mean, and samples with all their shadow rays tell the rest (splitting, Arvo
// and Kirk 1990). Whether a pixel gets such rays is never for its own samples to say; what
// rays saw at its neighbours does: a bar thinner than a pixel, which one sample in five meets, is found along its
// length.
#pragma once

#include <span>
#include <vector>

#include "methods/walk_settings.h"
#include "render/wavefront.h"

namespace afterglow {

/// How many rays see to an edge when every pixel has `samples` samples: `least`, or 16 for each, growing as they
/// double.
uint32_t sight_wanted(uint32_t samples, uint32_t least);
inline constexpr uint32_t kLeastSight = 128, kLeastSightInViewport = 32;

/// Requests for pixels around which, no farther than `near` pixels, light was met that differs by more than two per
/// cent of what they show, and that have less than half of the `wanted` rays: so many that they have all, or `most` in
/// all.
std::vector<PixelRequest> sight_requests(const Film&, uint32_t wanted, int near, uint64_t most);

/// A few rays find the edges, those that samples missed, too, in some rounds; then more look at what is next to one.
inline constexpr int kFindingRounds = 4, kFindingNear = 2;
inline constexpr uint32_t kFindingRays = 16;
inline constexpr uint64_t kSightMost = 8;  // rays in all, for each pixel of the film

/// Traces the requests' rays. What they meet joins the film by see().
void look(const CommittedScene&, std::span<const PixelRequest>, Film&, Work&, const WalkSettings&, RayCounts&);

/// A library knows nothing of how well a pixel is known, and draws a thin bar before a window anew. Where rays looked,
/// it goes no farther from `shown` (RGBA) than two standard errors of all other light. noise: film.noise() of all
/// pixels.
void keep_edges(const Film&, const std::vector<PixelNoise>& noise, const float* shown, float* denoised);

}  // namespace afterglow
