// SPDX-License-Identifier: GPL-3.0-or-later
// One view of a committed scene through one method: the only way in is a list of pixel requests.
#pragma once

#include <memory>
#include <span>

#include "film/film.h"
#include "methods/method.h"
#include "render/wavefront.h"
#include "transport/committed_scene.h"

namespace afterglow {

class Renderer {
 public:
  /// What AUTO means: the instant cache where somebody waits for every edit, the path tracer in final renders. Other
  /// names stay as they are.
  static std::string chosen(const std::string& method, bool viewport);
  /// AUTO: as in final renders. Throws InvalidInput for an unknown method.
  explicit Renderer(const std::string& method);
  /// The one that a render of the scene by this method left behind, with its caches, or a new one.
  static std::unique_ptr<Renderer> take(const CommittedScene&, const std::string& method);
  /// Keeps it for the next render, if its method remembers anything.
  static void leave(const CommittedScene&, std::unique_ptr<Renderer>);
  const std::string& method() const { return id_; }
  /// Whether what samples spread by is the picture's error, or noise alone.
  bool exact() const { return method_->traits().exact; }
  float extra() const { return method_->traits().extra; }
  /// Whether light that the method answers for is without noise, and stands in a pass of its own.
  bool carries() const { return method_->traits().steady; }
  /// Samples that a final picture takes at least; known after update().
  uint32_t first() const { return method_->traits().first; }
  /// Whether edges of what shines may get rays of their own.
  bool looks() const { return method_->traits().terms != kAllTerms; }
  bool running() const { return method_->traits().running; }
  void configure(const Settings&);

  /// Brings the method up to date with the scene. Not while render() runs.
  void update(const CommittedScene&, Work&);
  /// After a first picture: see IndirectMethod.
  bool refine(const CommittedScene& scene, Work& work) { return method_->refine(scene, work); }
  void render(const CommittedScene&, std::span<const PixelRequest>, Film&, Work&);
  /// Rays that only look, for the film's edges of what shines: see sight.h. `samples`: that every pixel has;
  /// `least`: rays at an edge.
  void look(const CommittedScene&, Film&, uint32_t samples, uint32_t least, Work&);
  MethodStatistics statistics() const;
  /// What the method remembers, into and out of a file. Throw FileError, and InvalidInput where there is nothing to
  /// save or the file belongs to another scene.
  void save(const CommittedScene&, const std::string& path) const;
  void load(const CommittedScene&, const std::string& path);

 private:
  std::string id_;
  std::unique_ptr<IndirectMethod> method_;
  uint64_t version_ = 0;
  WalkSettings settings_;
  WavefrontTimes times_;
  Wavefront wave_;  // memory of its last render
};

}  // namespace afterglow
