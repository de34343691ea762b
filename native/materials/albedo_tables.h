// SPDX-License-Identifier: GPL-3.0-or-later
// Directional albedos of the GGX distribution, integrated once when the program starts, for the layering of lobes and
// for the compensation of what single scattering loses (Kulla and Conty 2017; Turquin 2019).
#pragma once

namespace afterglow {

/// Share of light that a white GGX reflection returns: height-correlated Smith, no Fresnel. roughness = sqrt(alpha).
float ggx_albedo(float cosine, float roughness);
/// The same averaged over cosine-weighted directions.
float ggx_mean_albedo(float roughness);
/// Where between f0 and f90 the mean Fresnel reflection of a rough dielectric lies (0 … 1), over its visible normals:
/// what Blender shows as Glossy Color. Weighted with the shadowing of the way out it would be 4 % less to 2 % more.
float schlick_share(float cosine, float roughness, float ior);
/// Share of light that rough glass of this index returns, both sides together.
float glass_albedo(float cosine, float roughness, float ior);
/// The same averaged over cosine-weighted directions.
float glass_mean_albedo(float roughness, float ior);

}  // namespace afterglow
