// SPDX-License-Identifier: GPL-3.0-or-later
// The one interface of all methods that answer "how much indirect light arrives here?". A method is one folder under
// methods/ and one line in methods/list.cpp; it never reads Blender's data and never draws.
#pragma once

#include <atomic>
#include <memory>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "base/cancel.h"
#include "materials/surface.h"
#include "scene/changes.h"

namespace afterglow {

struct CommittedScene;
struct PixelRequest;
class Film;

using SettingValue = std::variant<bool, int64_t, double, std::string>;
using Settings = std::vector<std::pair<std::string, SettingValue>>;
struct SettingDescription {
  std::string name, label, description, unit;
  SettingValue default_value;
  double min = 0.0, max = 0.0;
};
struct MethodDescription {
  std::string id, label, description;
  std::vector<SettingDescription> settings;
  std::vector<std::string> debug_views, statistics;
};

/// Which light terms a method serves by itself; the Renderer computes the others.
enum LightTerm : uint32_t { kIndirectDiffuse = 1, kDirect = 2, kSpecular = 4, kEmitted = 8, kAllTerms = 15 };
struct MethodTraits {
  uint32_t terms = kIndirectDiffuse;
  bool layers = false;  // wants the layered filter
  bool needs_next_frame = false;
  bool running = false;      // the picture of a view that stands still goes on from render to render
  bool steady = false;       // answers have no noise: the same question is answered alike until the scene is edited
  uint32_t lights = 1;       // samples of the light sources that the renderer takes at a first surface
  uint32_t interleave = 1;   // n: neighbouring pixels ask n × n different parts of the lights; answers want the
                             // discontinuity buffer
  bool fills_holes = false;  // prepare() wants only the points that gather() could not answer
  float extra = 0.0f;        // camera samples beyond every pixel's own, where noise is: as many a pixel on average
  uint32_t first = 0;        // samples that a final picture takes at least, because nothing is remembered yet
  bool exact = false;        // samples are independent and without bias: what they spread by is the picture's error
};

struct CachePoint {  // a diffuse lobe that asks for light
  Vec3 position, normal;
  Vec3 bent{0.0f};         // the lobe's normal, which bumps turn away from the surface's
  float footprint = 0.0f;  // of a pixel on the surface
  uint32_t instance = kNone, triangle = kNone;
  Vec3 face_normal, outgoing;
  float segment = 0.0f;      // length of the ray that came here
  float u = 0.0f, v = 0.0f;  // barycentric weights of the triangle's second and third corner
  float error = 0.0f;        // as SurfacePoint's
  uint16_t x = 0, y = 0;     // pixel of the full image, divided by the step of its pass
  uint32_t sample = 0;
  uint8_t layer = 0;         // surfaces seen before on this path
  bool translucent = false;  // the lobe gathers from behind
};
struct Answer {
  Rgb light{0.0f};
  float weight = 0.0f;
  float relative_error = 0.0f;
};                                      // weight 0: a hole. gather() may keep what stands there already
inline constexpr float kAsItIs = 2.0f;  // weight of a debug view's colour: no light, shown as it is

struct Work {
  StopToken stop;
  uint64_t seed = 0;
  uint32_t pass = 0;
  uint32_t threads = 0;                           // 0: all
  const std::vector<uint64_t>* shown = nullptr;   // local view: one bit an instance (InstanceMask); null: everything
  const std::atomic<bool>* pause = nullptr;       // while true, no new request is begun
  std::atomic<uint64_t>* samples_done = nullptr;  // grows as requests are finished
  bool lazy = false;                              // update() may leave to refine() what a first picture can do without
  bool left = false;                              // it did
  float caching = 1.0f;  // share of the paths that fill a cache beyond what answers need: see caching_share()
  bool extra = false;    // requests ask for more samples where the picture is noisy: methods answer from what they have
};

struct MethodStatistics {
  std::vector<std::pair<std::string, double>> values;  // records, rays, bytes, seconds a stage, reused, dropped, …
  std::vector<std::string> warnings{};                 // what the user of this render should know
};

class IndirectMethod {
 public:
  virtual ~IndirectMethod() = default;
  virtual MethodTraits traits() const = 0;
  virtual void configure(const Settings&) = 0;  // names that are not its own are left alone
  virtual void update(const CommittedScene&, const SceneChanges&, Work&) = 0;  // invalidate and repair
  virtual bool refine(const CommittedScene&, Work&) = 0;  // what update() left; true: answers are others than before
  virtual void prepare(const CommittedScene&, std::span<const CachePoint>, Work&) = 0;  // a wavefront; may insert
  virtual void gather(const CommittedScene&, std::span<const CachePoint>,
                      std::span<Answer>) const = 0;  // pure; any thread
  /// Methods that claim kAllTerms render whole requests; the others never see this call.
  virtual void render(const CommittedScene&, std::span<const PixelRequest>, Film&, Work&) = 0;
  virtual MethodStatistics statistics() const = 0;
  /// What it remembers of this scene, as bytes for load(); empty: nothing.
  virtual std::vector<char> save(const CommittedScene&) const { return {}; }
  /// Takes the place of what it remembers; throws InvalidInput for bytes of another scene or of another kind.
  virtual void load(const CommittedScene&, std::span<const char>) {}
};

const std::vector<MethodDescription>& method_descriptions();
/// Every described setting: as given, else as its description says. configure() sees these alone.
Settings with_defaults(const Settings& given);
std::unique_ptr<IndirectMethod> make_method(const std::string& id);  // throws InvalidInput with the list of ids

}  // namespace afterglow
