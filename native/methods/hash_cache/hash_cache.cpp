// SPDX-License-Identifier: GPL-3.0-or-later
// HashCache as a method: its settings and statistics. See hash_cache.h.
#include "methods/hash_cache/hash_cache.h"

#include "base/errors.h"
#include "methods/hash_cache/cache.h"

namespace afterglow::hash_cache {

namespace {

constexpr const char* kViews[] = {"LIGHT", "LEVEL", "COUNT", "AGE", "SIDE"};

View view_of(const SettingValue& value) {
  const auto* text = std::get_if<std::string>(&value);
  for (int i = 0; i < 5; ++i)
    if (text && *text == kViews[i]) return View(i);
  throw InvalidInput("setting 'hash_view' wants LIGHT, LEVEL, COUNT, AGE or SIDE, not '" + (text ? *text : "a number") +
                     "'");
}

class HashCache final : public IndirectMethod {
 public:
  MethodTraits traits() const override {
    return {.layers = filter_,
            .running = running_,
            .lights = direct_ ? 0u : lights_,
            .extra = extra_,
            .first = cold_ ? first_ : 0u};
  }

  void configure(const Settings& settings) override {
    CacheSettings s;
    s.caching.walk.configure(settings);
    bool denoised = false;
    for (const auto& [name, value] : settings) {
      if (name == "denoise") denoised = integer_of(value) != 0;
      if (name == "hash_store") s.caching.store = uint32_t(integer_of(value));
      if (name == "hash_length") s.caching.length = uint32_t(integer_of(value));
      if (name == "hash_cell") s.caching.cell_pixels = float(number_of(value));
      if (name == "hash_resolution") s.resolution = float(number_of(value) * number_of(value));
      if (name == "hash_jitter") s.jitter = float(number_of(value));
      if (name == "hash_trusted") s.trusted = float(number_of(value));
      if (name == "hash_validate") s.validate = uint32_t(integer_of(value));
      if (name == "hash_keep") s.keep = uint32_t(integer_of(value));
      if (name == "hash_memory") s.limit = size_t(number_of(value) * 1048576.0);
      if (name == "hash_filter") filter_ = integer_of(value) != 0;
      if (name == "hash_enough") s.enough = float(number_of(value));
      if (name == "hash_running") running_ = integer_of(value) != 0;
      if (name == "hash_lights") lights_ = uint32_t(integer_of(value));
      if (name == "hash_direct") s.caching.direct = direct_ = integer_of(value) != 0;
      if (name == "hash_extra") extra_ = float(number_of(value));
      if (name == "hash_first") first_ = uint32_t(integer_of(value));
      if (name == "hash_long_paths") s.caching.long_paths = float(number_of(value));
      if (name == "hash_view") view_ = view_of(value);
    }
    filter_ &= view_ == View::kLight &&
               !denoised;  // what filters the whole picture does better with grain than with what this one leaves
    cache_.configure(s);
  }

  void update(const CommittedScene& scene, const SceneChanges& changes, Work& work) override {
    cache_.update(scene, changes, work);
    cold_ = cache_.table().size() == 0;
    cache_.let_all_ask(cold_ && first_);
  }
  bool refine(const CommittedScene&, Work&) override { return false; }
  void prepare(const CommittedScene& scene, std::span<const CachePoint> points, Work& work) override {
    cache_.fill(scene, points, work);
  }
  void gather(const CommittedScene&, std::span<const CachePoint> points, std::span<Answer> answers) const override {
    if (view_ == View::kLight) return cache_.answer(points, answers);
    for (size_t i = 0; i < points.size(); ++i) answers[i] = cache_.show(view_, points[i]);
  }
  std::vector<char> save(const CommittedScene& scene) const override { return cache_.save(scene); }
  void load(const CommittedScene& scene, std::span<const char> bytes) override { cache_.load(scene, bytes); }
  void render(const CommittedScene&, std::span<const PixelRequest>, Film&, Work&) override {}

  MethodStatistics statistics() const override {
    const CacheCounts& c = cache_.counts();
    const TableCounts& t = cache_.table().counts();
    const std::string warning = cache_.warning();
    return {{{"cells", double(cache_.table().size())},
             {"cells_new", double(t.added)},
             {"cells_evicted", double(t.evicted)},
             {"cells_refused", double(t.refused)},
             {"cells_updated", double(c.cells)},
             {"cache_samples", double(c.samples)},
             {"cache_paths", double(c.paths)},
             {"cache_holes", double(c.holes)},
             {"cache_rays", double(c.rays)},
             {"cache_shadow_rays", double(c.shadow_rays)},
             {"cache_dropped", double(c.dropped)},
             {"cache_resets", double(c.resets)},
             {"cache_edits", double(c.edits)},
             {"cache_paths_again", double(c.walked_again)},
             {"cache_validated", double(c.validated)},
             {"cache_unannounced", double(c.unannounced)},
             {"cache_ratio", double(luminance(cache_.healing().whole().ratio))},
             {"cache_unexplained", double(cache_.healing().whole().unexplained)},
             {"cache_bytes", double(cache_.table().bytes())},
             {"cache_edit_bytes", double(cache_.healing().bytes())},
             {"seconds_edits", c.seconds_edits},
             {"seconds_validate", c.seconds_validate},
             {"seconds_paths", c.seconds_paths},
             {"seconds_table", c.seconds_table}},
            warning.empty() ? std::vector<std::string>{} : std::vector<std::string>{warning}};
  }

 private:
  Cache cache_;
  bool filter_ = true, running_ = true, direct_ = false, cold_ = true;
  uint32_t lights_ = 1, first_ = 0;
  float extra_ = 0.0f;
  View view_ = View::kLight;
};

}  // namespace

MethodDescription describe() {
  MethodDescription d;
  d.id = "HASH_CACHE";
  d.label = "HashCache";
  d.description =
      "Bounced light kept in a hierarchy of small cells: what one frame found, all that follow see. Bounced light is "
      "even within a cell: creases are softer, and some light passes beneath walls thinner than a cell";
  const auto add = [&](const char* name, const char* label, const char* text, const char* unit, SettingValue value,
                       double min, double max) {
    d.settings.push_back({name, label, text, unit, value, min, max});
  };
  add("hash_cell", "Cell Size", "Width of the finest cells: smaller, sharper and noisier", "pixels", 4.0, 0.25, 256.0);
  add("hash_store", "Stored Surfaces", "Diffuse surfaces of a path that keep a sample", "", int64_t(3), 1.0, 16.0);
  add("hash_length", "Path Length", "Further surfaces whose light each of them gets; 0: as the bounce limits say", "",
      int64_t(0), 0.0, 1024.0);
  add("hash_long_paths", "Long Paths",
      "Share of the paths that go their whole way; the others end at their second surface where a cell knows the rest",
      "", 0.125, 0.01, 1.0);
  add("hash_lights", "Light Samples", "Times that light sources are asked at the surface that a pixel shows", "",
      int64_t(2), 1.0, 64.0);
  add("hash_direct", "All from the Cache",
      "The light of light sources on diffuse surfaces comes from the cells, too: fewer rays, blurred shadows", "",
      false, 0.0, 1.0);
  add("hash_extra", "Extra Camera Samples",
      "Samples beyond every pixel's own that go where the picture is noisy (edges, gloss), for each of those one on "
      "average: at most so many, fewer where little is noisy",
      "", 2.0, 0.0, 16.0);
  add("hash_first", "First Samples",
      "Samples that the first picture of an empty cache takes at least, at full caching resolution: what it leaves, "
      "all "
      "that follow begin with",
      "", int64_t(0), 0.0, 65536.0);
  add("hash_resolution", "Caching Resolution",
      "Paths that fill the cache, as a share of the image's width and height; what no cell answers is filled anyway",
      "", 1.0, 0.0, 1.0);
  add("hash_jitter", "Jitter", "How far look-ups are scattered along the surface, so that cells do not show", "cells",
      0.5, 0.0, 4.0);
  add("hash_trusted", "Trusted Samples", "Samples from which on a cell answers alone; below, larger ones help", "",
      32.0, 1.0, 1e6);
  add("hash_enough", "Settled Samples",
      "Samples from which on a cell gets paths more rarely, down to one where eight would be sent", "", 512.0, 1.0,
      1e9);
  add("hash_filter", "Layered Filter", "Smooths light between neighbouring pixels while cells hold few samples", "",
      true, 0.0, 1.0);
  add("hash_running", "Running Estimate",
      "Renders of a scene and view that did not change since the last, but for the seed, go on with its picture", "",
      true, 0.0, 1.0);
  add("hash_keep", "Keep at Edits",
      "Samples that a cell's light of before an edit counts for at most; paths that are walked again say for how many "
      "it "
      "may, and by how much light changed. 0: an edit starts anew",
      "", int64_t(1000000), 0.0, 1e6);
  add("hash_validate", "Validated Paths",
      "Kept paths that are walked again in every frame without an edit; where one brings other light, cells heal as "
      "after "
      "an edit, and a cache that was loaded into a changed scene does so at once. 0: none",
      "", int64_t(96), 0.0, 4096.0);
  add("hash_memory", "Memory", "Most memory for cells; beyond, those without new samples for longest make room", "MiB",
      1024.0, 1.0, 1e6);
  add("hash_view", "View", "LIGHT, or what the cells hold: LEVEL, COUNT, AGE, SIDE", "", std::string("LIGHT"), 0.0,
      0.0);
  d.debug_views = {"LEVEL", "COUNT", "AGE", "SIDE"};
  d.statistics = {
      "cells",       "cells_new",         "cells_evicted",   "cells_refused",     "cells_updated", "cache_samples",
      "cache_paths", "cache_holes",       "cache_rays",      "cache_shadow_rays", "cache_dropped", "cache_resets",
      "cache_edits", "cache_paths_again", "cache_validated", "cache_unannounced", "cache_ratio",   "cache_unexplained",
      "cache_bytes", "cache_edit_bytes",  "seconds_edits",   "seconds_validate",  "seconds_paths", "seconds_table"};
  return d;
}

std::unique_ptr<IndirectMethod> make() { return std::make_unique<HashCache>(); }

}  // namespace afterglow::hash_cache
