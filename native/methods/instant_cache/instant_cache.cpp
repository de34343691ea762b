// SPDX-License-Identifier: GPL-3.0-or-later
// The instant cache as a method: its settings and statistics. See instant_cache.h.
#include "methods/instant_cache/instant_cache.h"

#include "base/errors.h"
#include "methods/instant_cache/cache.h"

namespace afterglow::instant_cache {

namespace {

constexpr float kAccuracy = 0.05f;  // where neither the render nor the cache is told one

constexpr const char* kViews[] = {"LIGHT", "RECORDS", "CHANGES", "RAYS", "LIGHTS"};

View view_of(const SettingValue& value) {
  const auto* text = std::get_if<std::string>(&value);
  for (int i = 0; i < 5; ++i)
    if (text && *text == kViews[i]) return View(i);
  throw InvalidInput("setting 'cache_view' wants LIGHT, RECORDS, CHANGES, RAYS or LIGHTS, not '" +
                     (text ? *text : "a number") + "'");
}

class InstantCache final : public IndirectMethod {
 public:
  MethodTraits traits() const override { return {.steady = true, .fills_holes = true, .first = cold_ ? first_ : 0u}; }

  void configure(const Settings& settings) override {
    CacheSettings s;
    s.walk.configure(settings);
    s.lights.configure(settings);
    verify_ = false;
    view_ = View::kLight;
    first_ = 0;
    float from_render = 0.0f;
    s.accuracy = 0.0f;
    for (const auto& [name, value] : settings) {
      if (name == "accuracy") from_render = float(number_of(value));
      if (name == "cache_accuracy") s.accuracy = float(number_of(value));
      if (name == "cache_first") first_ = uint32_t(integer_of(value));
      if (name == "cache_keep") s.keep_updates = uint32_t(integer_of(value));
      if (name == "cache_memory") s.most_bytes = size_t(number_of(value) * 1048576.0);
      if (name == "cache_on_demand") s.on_demand = integer_of(value) != 0;
      if (name == "cache_verify") verify_ = integer_of(value) != 0;
      if (name == "cache_view") view_ = view_of(value);
    }
    if (!(s.accuracy > 0.0f)) s.accuracy = from_render > 0.0f ? from_render : kAccuracy;
    cache_.configure(s);
  }

  void update(const CommittedScene& scene, const SceneChanges& changes, Work& work) override {
    cold_ = cache_.size() == 0;
    cache_.update(scene, changes, work);
    if (verify_) verification_ = cache_.verify(scene, work);
  }

  bool refine(const CommittedScene& scene, Work& work) override { return cache_.refine(scene, work); }

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
    MethodStatistics s;
    const auto add = [&](const char* name, double value) { s.values.emplace_back(name, value); };
    add("records", double(cache_.size()));
    add("records_new", double(c.created));
    add("records_updated", double(c.updated));
    add("records_reused", double(c.reused));
    add("records_moved", double(c.moved));
    add("records_dropped", double(c.dropped));
    add("resets", double(c.resets));
    add("records_refused", double(c.refused));
    add("virtual_lights", double(c.lights));
    add("lights_moved", double(c.lights_moved));
    add("lights_recoloured", double(c.lights_recoloured));
    add("objects_moved", double(c.objects_moved));
    add("path_rays", double(c.path_rays));
    add("fill_rays", double(c.fill_rays));
    add("update_rays", double(c.update_rays));
    add("visibility_rays_now", double(c.rays_now));
    add("cache_bytes", double(cache_.bytes()));
    add("record_bytes", double(cache_.record_bytes()));
    add("seconds_lights", c.seconds_lights);
    add("seconds_update", c.seconds_update);
    add("seconds_fill", c.seconds_fill);
    add("seconds_refine", c.seconds_refine);
    if (verify_) {
      add("verified_records", double(verification_.records));
      add("verified_differing", double(verification_.differing));
      add("verified_worst", verification_.worst);
    }
    if (c.refused)
      s.warnings.push_back("the instant cache is full: " + std::to_string(c.refused) +
                           " places of this picture get no bounced light. More memory (cache_memory) or a larger "
                           "Interpolation (cache_accuracy) "
                           "brings it back");
    if (!cache_.discarded().empty())
      s.warnings.push_back("the loaded instant cache was made with other settings (" + cache_.discarded() +
                           "): it was filled anew");
    return s;
  }

 private:
  Cache cache_;
  bool verify_ = false, cold_ = true;
  uint32_t first_ = 0;
  View view_ = View::kLight;
  Verification verification_;
};

}  // namespace

MethodDescription describe() {
  MethodDescription d;
  d.id = "INSTANT_CACHE";
  d.label = "Instant Cache";
  d.description =
      "Bounced light from virtual point lights, remembered at sparse places and repaired after every edit. No caustics "
      "on diffuse surfaces that are seen directly; corners are too dark without short rays; some light passes beneath "
      "thin partitions; emitters that are left out of light sampling light nothing; at most 64 diffuse bounces";
  VirtualLightSettings::describe(d.settings);
  d.settings.push_back(
      {"cache_accuracy", "Interpolation",
       "Relative error of interpolated light that is accepted: smaller, more records; 0: the render's own accuracy", "",
       0.0, 0.0, 1.0});
  d.settings.push_back({"cache_first", "First Samples",
                        "Samples that the first picture of an empty cache takes at least: where nothing changes they "
                        "stay for all frames that follow, if samples are kept",
                        "", int64_t(0), 0.0, 65536.0});
  d.settings.push_back({"cache_keep", "Keep Unused",
                        "Updates after which a record that no pixel used is forgotten; 0: never", "", int64_t(64), 0.0,
                        1e6});
  d.settings.push_back({"cache_memory", "Memory",
                        "Records that answered longest ago make room for new ones when memory is nearly full", "MiB",
                        1024.0, 1.0, 1048576.0});
  d.settings.push_back({"cache_on_demand", "Repair on Demand",
                        "Repairs only the records that the image asks for, when it asks for them", "", false, 0.0,
                        1.0});
  d.settings.push_back({"cache_verify", "Verify",
                        "Compares every record with a fresh one after each update (slow; for tests)", "", false, 0.0,
                        1.0});
  d.settings.push_back(
      {"cache_view", "View",
       "LIGHT, or what the cache holds: RECORDS, CHANGES (reused blue, updated yellow, new green), RAYS "
       "traced since the last edit, virtual LIGHTS",
       "", std::string("LIGHT"), 0.0, 0.0});
  d.debug_views = {"RECORDS", "CHANGES", "RAYS", "LIGHTS"};
  d.statistics = {"records",         "records_new",    "records_updated", "records_reused", "records_moved",
                  "records_dropped", "virtual_lights", "lights_moved",    "path_rays",      "fill_rays",
                  "update_rays",     "cache_bytes",    "seconds_lights",  "seconds_update", "seconds_fill"};
  return d;
}

std::unique_ptr<IndirectMethod> make() { return std::make_unique<InstantCache>(); }

}  // namespace afterglow::instant_cache
