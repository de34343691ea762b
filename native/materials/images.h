// SPDX-License-Identifier: GPL-3.0-or-later
// Images in memory as programs read them: read and decoded by OpenImageIO once, looked up directly. (OpenImageIO's
// texture system was measured too: see docs/architecture.md, "Textures".) Values stay as encoded in the file; an sRGB
// curve is undone after filtering, as Blender does it.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

#include "base/math.h"
#include "scene/tables.h"

namespace afterglow {

class Scene;

enum class Interpolation : uint8_t { kLinear, kClosest, kCubic };
enum class Extension : uint8_t { kRepeat, kExtend, kClip, kMirror };

/// One picture: 1 or 4 channels, bytes, halves or floats, row 0 at the bottom.
struct Texture {
  enum class Kind : uint8_t { kByte, kHalf, kFloat };
  int width = 0, height = 0;
  Kind kind = Kind::kByte;
  uint8_t channels = 4;
  bool srgb = false;  // encoded: the curve is undone after filtering
  std::vector<uint8_t> data;
  bool valid() const { return width > 0; }
};

/// Reads and decodes; text of the problem in `error` when it fails.
Texture read_texture(const Image&, const ImageSource&, std::string& error);
/// Filtered, still encoded. u, v: 0 … 1 over the picture.
Vec4 look_up(const Texture&, float u, float v, Interpolation, Extension);
/// sRGB to linear, by a table with interpolation; exact to 1e-6 relative above 1e-3.
float srgb_to_linear(float);

class Images {
 public:
  /// A number for an image handle, loaded at the next load(). kNone for handle 0.
  uint32_t number(Handle);
  /// Reads what is new or changed. Problems are told once each, by the image's name.
  void load(const Scene&, std::vector<std::string>& warnings);
  /// Colour and alpha, linear. unassociate: divide by alpha.
  Vec4 sample(uint32_t number, Vec2 uv, Interpolation, Extension, bool unassociate) const;
  size_t bytes() const;

 private:
  struct Entry {
    Handle handle = 0;
    std::map<int, std::shared_ptr<ImageSource>> sources;
    std::string colorspace, alpha;
    std::map<int, Texture> tiles;  // UDIM, or 1001 alone
    const Texture* single = nullptr;
    bool missing = true;
  };
  std::vector<Entry> entries_;
};

}  // namespace afterglow
