// SPDX-License-Identifier: GPL-3.0-or-later
// One material by itself: see standalone.h.
#include "materials/standalone.h"

#include <algorithm>

#include "materials/compiler.h"

namespace afterglow {

struct Standalone::State {
  PointSetup setup;
  Program program;
  std::vector<std::string> warnings;
};

Standalone::Standalone(const Graph& graph, const PointSetup& setup) : state_(std::make_unique<State>()) {
  state_->setup = setup;
  CompileHost host;
  host.fold = setup.fold;
  host.warn = [this](const std::string& text) {
    auto& all = state_->warnings;
    if (std::find(all.begin(), all.end(), text) == all.end()) all.push_back(text);
  };
  state_->program = compile(graph, ProgramKind::kSurface, host);
}

Standalone::~Standalone() = default;

void Standalone::shade(const SurfacePoint& point, Surface& out) const {
  const Program& program = state_->program;
  if (program.folded) {
    out = program.ready;
    for (int k = 0; k < out.count; ++k) out.lobes[k].normal = point.normal;
    return;
  }
  out.clear();
  PathContext path;
  path.kind = state_->setup.kind;
  path.drop_glossy = state_->setup.drop_glossy, path.drop_refractive = state_->setup.drop_refractive;
  HitContext hit;
  hit.points[0] = &point;
  hit.path = &path;
  run(program, hit, out);
}

namespace {

SurfacePoint point_at(const Vec3& outgoing, bool backfacing) {
  SurfacePoint point{{0, 0, 0}, {0, 0, 1}, {0, 0, 1}, outgoing};
  point.backfacing = backfacing;
  return point;
}

}  // namespace

BsdfValue Standalone::evaluate(const Vec3& outgoing, const Vec3& incoming) const {
  const SurfacePoint point = point_at(outgoing, state_->setup.backfacing);
  Surface surface;
  shade(point, surface);
  if (state_->setup.diffuse_only) return afterglow::evaluate<true>(surface, point.face_normal, outgoing, incoming);
  return afterglow::evaluate<false>(surface, point.face_normal, outgoing, incoming);
}

BsdfSample Standalone::sample(const Vec3& outgoing, float u_lobe, const Vec2& u) const {
  const SurfacePoint point = point_at(outgoing, state_->setup.backfacing);
  Surface surface;
  shade(point, surface);
  if (state_->setup.diffuse_only) return afterglow::sample<true>(surface, point.face_normal, outgoing, u_lobe, u);
  return afterglow::sample<false>(surface, point.face_normal, outgoing, u_lobe, u);
}

const std::vector<std::string>& Standalone::warnings() const { return state_->warnings; }
bool Standalone::folded() const { return state_->program.folded; }
size_t Standalone::instructions() const { return state_->program.code.size(); }

}  // namespace afterglow
