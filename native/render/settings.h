// SPDX-License-Identifier: GPL-3.0-or-later
// Everything a render is asked for, from named values to plain structs; a wrong name or value is told in full.
#pragma once

#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "film/film.h"
#include "methods/method.h"

namespace afterglow {

using NamedValue = std::variant<bool, int64_t, double, std::string, std::vector<double>, std::vector<std::string>>;
using NamedValues = std::vector<std::pair<std::string, NamedValue>>;

struct RenderSettings {
  FilmSettings film;
  std::string method = "AUTO";
  Settings method_settings;  // bounces, clamping and whatever else the method describes
  uint32_t samples = 128;
  float accuracy = 0.0f;    // believed relative error to stop at; 0: exactly `samples`
  float time_limit = 0.0f;  // seconds; 0: none
  int64_t seed = 0;
  double frame = 0.0;
  uint32_t threads = 0;
  bool viewport = false, denoise = false;
  bool sight = true;        // edges of what shines get rays of their own, where a cache answers for the rest
  bool carry_over = false;  // samples outlive edits of the scene and, in final renders, frames
  std::string denoiser = "AUTO";
  std::vector<std::string> denoiser_search;  // folders where a copy may lie
  bool local_view_set = false;
  std::vector<uint32_t> local_view;  // instance handles

  /// Takes named values over; throws InvalidInput and then leaves everything as it was.
  void apply(const NamedValues&);
  /// Whether every sample of the same scene is the same.
  bool same_samples(const RenderSettings&) const;
};

}  // namespace afterglow
