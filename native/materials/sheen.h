// SPDX-License-Identifier: GPL-3.0-or-later
// Sheen of cloth: a volume of fibres over the surface, as a linearly transformed cosine (Zeltner, Burley and Chiang
// 2022). The transform's two coefficients come from rational fits to the paper's table (their numbers as the MaterialX
// standard publishes them), the albedo from a table (sheen_table.h).
#pragma once

#include "materials/microfacet.h"

namespace afterglow {

/// Share of light that sheen returns; roughness as users set it, 0 … 1.
float sheen_albedo(float cosine, float roughness);
/// Fills lobe.alpha_x, alpha_y with the transform's coefficients for this cosine.
void sheen_setup(Lobe&, float cosine, float roughness);
float sheen_density(const Lobe&, const Vec3& outgoing, const Vec3& incoming);
Vec3 sheen_sample(const Lobe&, const Vec3& outgoing, const Vec2& u);

}  // namespace afterglow
