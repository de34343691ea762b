// SPDX-License-Identifier: GPL-3.0-or-later
// A cache as bytes: a header of plain numbers in the machine's order, the virtual lights, the records, what each of
// them sees. The scene's fingerprint holds what visibility depends on: places and forms of objects, and materials that
// let light through, with their pictures and coordinates. Colours and lamps may differ: the first update after a load
// compares the lights as after any edit.
#include <cstring>
#include <type_traits>

#include "base/errors.h"
#include "methods/instant_cache/cache.h"

namespace afterglow::instant_cache {

namespace {

constexpr char kMagic[16] = "afterglow icach";
constexpr uint32_t kFormat = 4;

/// FNV-1a over the bytes of plain values.
class Fingerprint {
 public:
  template <class T>
  void add(const T& value) {
    static_assert(std::is_arithmetic_v<T> || std::is_same_v<T, Vec3>);
    add(&value, sizeof(T));
  }
  void add(const void* data, size_t size) {
    for (size_t i = 0; i < size; ++i) value_ = (value_ ^ static_cast<const unsigned char*>(data)[i]) * 0x100000001b3ull;
  }
  void add(const std::string& text) { add(text.data(), text.size()), add(uint32_t(text.size())); }
  template <class T>
  void add(const std::vector<T>& values) {
    add(values.data(), values.size() * sizeof(T)), add(uint64_t(values.size()));
  }
  uint64_t value() const { return value_; }

 private:
  uint64_t value_ = 0xcbf29ce484222325ull;
};

void add_image(Fingerprint& f, const Image& image) {
  f.add(image.colorspace), f.add(image.alpha);
  for (const auto& [tile, source] : image.tiles) {
    f.add(tile), f.add(source->path), f.add(source->width), f.add(source->height), f.add(source->channels);
    f.add(source->encoded), f.add(source->pixels), f.add(source->byte_pixels);
  }
}

void add_graph(Fingerprint& f, const Scene& scene, const Graph& graph) {
  const auto add_link = [&](const Link& link) { f.add(link.node), f.add(link.output); };
  for (const Node& node : graph.nodes) {
    f.add(node.type);
    for (const auto& [name, input] : node.inputs) {
      f.add(name);
      if (const auto* link = std::get_if<Link>(&input)) add_link(*link);
      if (const auto* number = std::get_if<float>(&input)) f.add(*number);
      if (const auto* three = std::get_if<Vec3>(&input)) f.add(*three);
    }
    for (const auto& [name, param] : node.params) {
      f.add(name);
      const int64_t* image = name == "image" ? std::get_if<int64_t>(&param) : nullptr;
      if (image && *image > 0) {  // its handle says nothing
        add_image(f, scene.image(Handle(*image)));
        continue;
      }
      std::visit(
          [&](const auto& value) {
            if constexpr (!std::is_same_v<std::decay_t<decltype(value)>, std::monostate>) f.add(value);
          },
          param);
    }
  }
  add_link(graph.surface);
}

uint64_t fingerprint(const CommittedScene& committed) {
  const Scene& scene = committed.scene;
  Fingerprint f;
  const DVec3 origin = scene.origin();
  f.add(origin.x), f.add(origin.y), f.add(origin.z);
  for (const InstanceRecord& record : scene.instances()) {
    if (!record.mesh) continue;
    for (const Vec3* column : {&record.to_world.x, &record.to_world.y, &record.to_world.z, &record.to_world.p})
      f.add(*column);
    f.add(record.visibility & kVisibleDiffuse);
    const Mesh& mesh = *record.mesh;
    f.add(mesh.positions), f.add(mesh.triangles), f.add(mesh.smooth), f.add(mesh.slots);
    f.add(mesh.corners), f.add(mesh.corner_normals), f.add(mesh.vertex_normals);
    bool clear = false;
    for (uint32_t s = 0; s < record.slot_count; ++s) {
      const uint32_t material = scene.material_slots()[record.first_material + s];
      const bool opaque = committed.materials.opaque(material);
      f.add(opaque);
      const Handle handle = scene.material_handles()[material];
      if (!opaque && handle) add_graph(f, scene, scene.material(handle).graph), clear = true;
    }
    if (!clear) continue;  // else where it lets how much through may depend on all of this
    for (const UvMap& map : mesh.uvs) f.add(map.name), f.add(map.values);
    for (const Attribute& attribute : mesh.attributes) f.add(attribute.name), f.add(attribute.values);
    f.add(mesh.active_uv), f.add(mesh.active_color);
    f.add(record.object_index), f.add(record.random);
    for (int i = 0; i < 4; ++i) f.add(record.color[i]);
  }
  return f.value();
}

struct Header {
  char magic[16];
  uint32_t format, slots, words, coloured;
  uint64_t records, scene;
  float center[3], radius, bound, accuracy, light_bound;
  uint32_t count, pattern, max_bounces, diffuse, glossy, transmission, transparent, caustics, update, short_rays;
};
static_assert(sizeof(Header) == 16 + 16 + 16 + 28 + 40 + 4);

struct SavedLight {
  float numbers[16];
  uint32_t alive;
};
struct SavedRecord {
  uint32_t instance, triangle, back;
  float u, v, numbers[37];
  float measured;
  uint32_t born, asked, rays, used, ready, wanted;
};

void put(float*& to, const Vec3& v) { *to++ = v.x, *to++ = v.y, *to++ = v.z; }
Vec3 take(const float*& from) {
  const Vec3 v(from[0], from[1], from[2]);
  from += 3;
  return v;
}

SavedLight saved(const VirtualLight& light) {
  SavedLight s{};
  float* at = s.numbers;
  for (const Vec3* v : {&light.position, &light.normal, &light.face_normal, &light.front, &light.back}) put(at, *v);
  *at = light.lift, s.alive = light.alive;
  return s;
}

VirtualLight restored(const SavedLight& s) {
  VirtualLight light;
  const float* at = s.numbers;
  for (Vec3* v : {&light.position, &light.normal, &light.face_normal, &light.front, &light.back}) *v = take(at);
  light.lift = *at, light.alive = s.alive;
  return light;
}

SavedRecord saved(const Record& r, uint32_t used, uint8_t wanted) {
  SavedRecord s{};
  s.instance = r.place.instance, s.triangle = r.place.triangle, s.back = r.place.back, s.u = r.place.u, s.v = r.place.v;
  float* at = s.numbers;
  for (const Vec3* v : {&r.position, &r.normal, &r.face_normal, &r.irradiance}) put(at, *v);
  for (const glm::mat3* m : {&r.by_step, &r.by_turn})
    for (int i = 0; i < 3; ++i) put(at, (*m)[i]);
  *at++ = r.error, *at++ = r.footprint, *at++ = r.reach, *at++ = r.radius;
  put(at, r.compensation);
  s.measured = r.measured, s.born = r.born, s.asked = r.asked, s.rays = r.rays;
  s.used = used, s.ready = r.ready, s.wanted = wanted;
  return s;
}

Record restored(const SavedRecord& s) {
  Record r;
  r.place = {s.instance, s.triangle, s.u, s.v, s.back != 0};
  const float* at = s.numbers;
  for (Vec3* v : {&r.position, &r.normal, &r.face_normal, &r.irradiance}) *v = take(at);
  for (glm::mat3* m : {&r.by_step, &r.by_turn})
    for (int i = 0; i < 3; ++i) (*m)[i] = take(at);
  r.error = *at++, r.footprint = *at++, r.reach = *at++, r.radius = *at++;
  r.compensation = take(at);
  r.measured = s.measured, r.born = s.born, r.asked = s.asked, r.rays = s.rays;
  r.ready = s.ready != 0;
  return r;
}

bool sound(const Scene& scene, const SavedRecord& s) {
  for (const float number : s.numbers)
    if (!std::isfinite(number)) return false;
  if (!std::isfinite(s.measured) || s.instance >= scene.instances().size()) return false;
  const Mesh* mesh = scene.instances()[s.instance].mesh;
  return mesh && s.triangle < mesh->triangle_count() && s.numbers[32] > 0.0f && s.numbers[33] > 0.0f;
}

}  // namespace

std::vector<char> Cache::save(const CommittedScene& scene) const {
  if (stale_ || !shown_.empty() || records_.empty()) return {};
  Header h;
  std::memset(static_cast<void*>(&h), 0, sizeof(h));
  std::memcpy(h.magic, kMagic, sizeof(kMagic));
  h.format = kFormat, h.slots = lights_.count, h.words = visibility_.words(), h.coloured = visibility_.coloured();
  h.records = records_.size(), h.scene = fingerprint(scene);
  h.center[0] = center_.x, h.center[1] = center_.y, h.center[2] = center_.z;
  h.radius = radius_, h.bound = bound_, h.accuracy = settings_.accuracy, h.light_bound = settings_.lights.bound;
  h.count = settings_.lights.count, h.pattern = settings_.lights.pattern;
  const WalkLimits& l = settings_.walk.limits;
  h.max_bounces = l.max_bounces, h.diffuse = l.diffuse, h.glossy = l.glossy, h.transmission = l.transmission;
  h.transparent = l.transparent, h.caustics = uint32_t(l.caustics_reflective) | uint32_t(l.caustics_refractive) << 1;
  h.update = update_, h.short_rays = settings_.lights.short_rays;
  std::vector<char> bytes(sizeof(h));
  std::memcpy(bytes.data(), &h, sizeof(h));
  const auto append = [&](const auto& value) {
    const char* at = reinterpret_cast<const char*>(&value);
    bytes.insert(bytes.end(), at, at + sizeof(value));
  };
  for (uint32_t k = 0; k < lights_.count; ++k) append(saved(lights_.lights[k]));
  for (size_t i = 0; i < records_.size(); ++i) append(saved(records_[i], used_[i], wanted_[i]));
  visibility_.write(bytes);
  return bytes;
}

void Cache::load(const CommittedScene& scene, std::span<const char> bytes) {
  Header h;
  if (bytes.size() < sizeof(h)) throw InvalidInput("this is no saved instant cache: it is too short");
  std::memcpy(static_cast<void*>(&h), bytes.data(), sizeof(h));
  if (std::memcmp(h.magic, kMagic, sizeof(kMagic))) throw InvalidInput("this is no saved instant cache");
  if (h.format != kFormat) throw InvalidInput("this instant cache was saved by another version of Afterglow");
  if (h.scene != fingerprint(scene))
    throw InvalidInput("this instant cache was saved from another scene: objects or what lets light through differ");
  const auto damaged = [] { return InvalidInput("this saved instant cache is damaged"); };
  CacheSettings settings = settings_;
  settings.lights.count = h.count, settings.lights.pattern = h.pattern, settings.lights.bound = h.light_bound;
  settings.accuracy = h.accuracy, settings.lights.short_rays = h.short_rays;
  WalkLimits& l = settings.walk.limits;
  l.max_bounces = h.max_bounces, l.diffuse = h.diffuse, l.glossy = h.glossy, l.transmission = h.transmission;
  l.transparent = h.transparent, l.caustics_reflective = h.caustics & 1u, l.caustics_refractive = h.caustics & 2u;
  const uint32_t slots = plan_slots(h.count, settings.lights.options(l, 0).bounces).slots;
  if (h.slots != slots || h.words != (slots + 63) / 64 || h.coloured > 1 || h.records > (uint64_t(1) << 32) ||
      h.short_rays > VirtualLightSettings::kMostShortRays)
    throw damaged();
  const size_t fixed = sizeof(h) + h.slots * sizeof(SavedLight), rest = bytes.size() - std::min(bytes.size(), fixed);
  const size_t row = size_t(h.words) * 24 + (h.coloured ? size_t(h.slots) * 2 : 0);
  if (bytes.size() < fixed || rest % (sizeof(SavedRecord) + row) || rest / (sizeof(SavedRecord) + row) != h.records)
    throw InvalidInput("this saved instant cache is cut off");

  std::vector<VirtualLight> lights(h.slots);
  std::vector<Record> records(h.records);
  std::vector<uint32_t> used(h.records);
  std::vector<uint8_t> wanted(h.records);
  const char* at = bytes.data() + sizeof(h);
  for (VirtualLight& light : lights) {
    SavedLight s;
    std::memcpy(&s, at, sizeof(s)), at += sizeof(s);
    for (const float number : s.numbers)
      if (!std::isfinite(number)) throw damaged();
    light = restored(s);
  }
  for (size_t i = 0; i < records.size(); ++i) {
    SavedRecord s;
    std::memcpy(&s, at, sizeof(s)), at += sizeof(s);
    if (!sound(scene.scene, s)) throw damaged();
    records[i] = restored(s), used[i] = s.used, wanted[i] = uint8_t(s.wanted != 0);
  }
  loaded_ = false;
  configure(settings);
  center_ = Vec3(h.center[0], h.center[1], h.center[2]), radius_ = h.radius, bound_ = h.bound, update_ = h.update;
  shown_.clear();
  visibility_.reset(h.slots, h.coloured != 0);
  visibility_.read(h.records, at);
  lights_.fill(std::move(lights));
  records_ = std::move(records), used_ = std::move(used), wanted_ = std::move(wanted);
  nearby_.reset(settings_.lights.short_rays), nearby_edits_.clear();
  if (settings_.lights.short_rays)
    for (size_t i = 0; i < records_.size(); ++i) nearby_.add_row();
  rebuild_octree();
  placement_.clear();
  SceneChanges everything;
  everything.everything = true;
  placement_.update(scene, everything);
  counts_ = CacheCounts{};
  stale_ = false;
  loaded_ = true, discarded_.clear();
}

}  // namespace afterglow::instant_cache
