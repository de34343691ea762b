// SPDX-License-Identifier: GPL-3.0-or-later
// The picture of a view that stands still goes on from one render to the next (Roth et al. 2020, figure 5): frames of
// an animation in which nothing changes, each with a seed of its own, are averaged. For methods that remember; the film
// of the last render rests with the scene.
#pragma once

#include <memory>

#include "film/film.h"
#include "render/settings.h"
#include "transport/committed_scene.h"

namespace afterglow {

/// Whether two cameras see the same.
bool same_view(const Camera&, const Camera&);

class RunningEstimate {
 public:
  /// The film that the last render left, where scene, view and settings are the same but for the seed; else nothing.
  static std::shared_ptr<Film> take(const CommittedScene&, const RenderSettings&, const FilmSettings&,
                                    uint32_t& samples);
  /// A carried film of the same view, whatever was edited since; `seed` becomes that of its samples.
  static std::shared_ptr<Film> take_carried(const CommittedScene&, const RenderSettings&, const FilmSettings&,
                                            int64_t& seed);
  static void leave(const CommittedScene&, const RenderSettings&, std::shared_ptr<Film>, uint32_t samples);

 private:
  std::shared_ptr<Film> film_;
  RenderSettings settings_;
  Camera camera_;
  uint64_t version_ = 0;
  uint32_t samples_ = 0;
};

}  // namespace afterglow
