// SPDX-License-Identifier: GPL-3.0-or-later
// Names and channels of the passes, in the order of the enumeration.
#include "film/passes.h"

#include "base/errors.h"

namespace afterglow {

static const PassInfo kInfos[kPassCount] = {
    {"combined", 4},
    {"depth", 1},
    {"mist", 1},
    {"position", 3},
    {"normal", 3},
    {"uv", 3},
    {"object_index", 1},
    {"material_index", 1},
    {"diffuse_direct", 3},
    {"diffuse_indirect", 3},
    {"diffuse_color", 3},
    {"glossy_direct", 3},
    {"glossy_indirect", 3},
    {"glossy_color", 3},
    {"transmission_direct", 3},
    {"transmission_indirect", 3},
    {"transmission_color", 3},
    {"emission", 3},
    {"environment", 3},
    {"albedo", 3},
    {"denoise_normal", 3},
    {"denoise_surface", kSurfaceFloats},
    {"sample_count", 1},
    {"error", 1},
    {"batches", kBatchCount},
};

const PassInfo& pass_info(Pass pass) { return kInfos[size_t(pass)]; }

Pass pass_by_name(const std::string& name) {
  std::string known;
  for (int i = 0; i < kPassCount; ++i) {
    if (name == kInfos[i].name) return Pass(i);
    known += (i ? ", " : "") + std::string(kInfos[i].name);
  }
  throw InvalidInput("no pass is called '" + name + "'; known passes: " + known);
}

std::vector<std::string> pass_names(PassSet set) {
  std::vector<std::string> names;
  for (int i = 0; i < kPassCount; ++i)
    if (set & (1u << i)) names.emplace_back(kInfos[i].name);
  return names;
}

}  // namespace afterglow
