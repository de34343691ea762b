// SPDX-License-Identifier: GPL-3.0-or-later
// Methods that serve every light term take requests as they are.
#include "render/renderer.h"

namespace afterglow {

Renderer::Renderer(const std::string& method)
    : id_(method == "AUTO" ? "PATH_TRACING" : method), method_(make_method(id_)) {}

void Renderer::update(const CommittedScene& scene, Work& work) {
  method_->update(scene, scene.scene.changes_since(version_), work);
  version_ = scene.scene.version();
}

void Renderer::render(const CommittedScene& scene, std::span<const PixelRequest> requests, Film& film, Work& work) {
  method_->render(scene, requests, film, work);
}

}  // namespace afterglow
