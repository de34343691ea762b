// SPDX-License-Identifier: GPL-3.0-or-later
// Which effects a scene can show at all. Kernels are chosen by these bits, so that what a scene does not use costs
// nothing.
#pragma once

#include <cstdint>

namespace afterglow {

enum Effect : uint32_t {
  kTextures = 1u << 0,      // a program that reads the hit point: images, procedural nodes, attributes
  kGlossy = 1u << 1,        // any lobe but diffuse reflection
  kTransmission = 1u << 2,  // lobes that go through the surface: glass, refraction, translucency
  kTransparency = 1u << 3,  // surfaces that let shadow and camera rays pass straight
  kEmissiveMesh = 1u << 4,
  kPunctualLights = 1u << 5,  // point, spot, sun, area lights
  kWorldConstant = 1u << 6,
  kWorldVarying = 1u << 7,  // an image or a gradient: sampled by importance
  kManyLights = 1u << 8,    // more than a handful: chosen through the tree
  kDepthOfField = 1u << 9,
  kRayVisibility = 1u << 10,  // something hides from some kinds of rays, holdouts, shadow catchers
};

struct Effects {
  uint32_t bits = 0;
  bool has(Effect e) const { return bits & e; }
  void add(Effect e) { bits |= e; }
};

}  // namespace afterglow
