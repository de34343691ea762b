// SPDX-License-Identifier: GPL-3.0-or-later
// Decoding of pictures by OpenImageIO: files, encoded bytes and raw pixels become Textures with associated alpha.
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <string_view>

#include "materials/images.h"

namespace afterglow {
namespace {

std::string lower(std::string text) {
  for (char& c : text) c = char(c >= 'A' && c <= 'Z' ? c + 32 : c);
  return text;
}

enum class Space { kSrgb, kLinear, kUnknown };

Space space_of(const std::string& name) {
  const std::string n = lower(name);
  if (n == "srgb" || n == "srgb texture" || n == "srgb encoded rec.709 (srgb)") return Space::kSrgb;
  for (const char* linear : {"linear", "non-color", "non-colour data", "generic data", "raw", "data", "linear rec.709",
                             "scene_linear", "linear bt.709", "lin_rec709", "lin_srgb", ""}) {
    if (n == linear) return Space::kLinear;
  }
  return Space::kUnknown;
}

bool is_data(const std::string& colorspace) {
  const std::string n = lower(colorspace);
  return n.find("non-col") != std::string::npos || n == "raw" || n == "data" || n == "generic data";
}

/// A name whose ending tells OpenImageIO the format of encoded bytes.
std::string name_of_bytes(const std::vector<uint8_t>& bytes) {
  const std::string_view head(reinterpret_cast<const char*>(bytes.data()), std::min<size_t>(bytes.size(), 16));
  const auto begins = [&](std::string_view magic) { return head.substr(0, magic.size()) == magic; };
  if (begins("\x89PNG")) return "packed.png";
  if (begins("\xff\xd8\xff")) return "packed.jpg";
  if (begins("\x76\x2f\x31\x01")) return "packed.exr";
  if (begins("II*") || begins(std::string_view("MM\0*", 4))) return "packed.tif";
  if (begins("#?")) return "packed.hdr";
  if (begins("BM")) return "packed.bmp";
  if (begins("RIFF") && head.size() >= 12 && head.substr(8, 4) == "WEBP") return "packed.webp";
  if (begins("SDPX") || begins("XPDS")) return "packed.dpx";
  if (begins("DDS ")) return "packed.dds";
  if (begins("8BPS")) return "packed.psd";
  if (head.size() >= 8 && head.substr(4, 4) == "jP  ") return "packed.jp2";
  return "packed.tga";
}

/// Formats that cannot be read from memory go through a file that is gone afterwards.
struct TemporaryFile {
  std::string path;
  TemporaryFile(const std::vector<uint8_t>& bytes, const std::string& name) {
    const std::string ending = name.substr(name.find('.'));
    std::string pattern = "/tmp/afterglow-XXXXXX" + ending;
    const int file = mkstemps(pattern.data(), int(ending.size()));
    if (file < 0) return;
    path = pattern;
    for (size_t done = 0; done < bytes.size();) {
      const ssize_t n = write(file, bytes.data() + done, bytes.size() - done);
      if (n <= 0) break;
      done += size_t(n);
    }
    close(file);
  }
  ~TemporaryFile() {
    if (!path.empty()) std::remove(path.c_str());
  }
};

template <class T>
T scaled(T value, T alpha) {
  if constexpr (sizeof(T) == 1)
    return T((unsigned(value) * unsigned(alpha)) / 255u);
  else
    return value * alpha;
}

template <class T>
T opaque() {
  if constexpr (sizeof(T) == 1)
    return T(255);
  else
    return T(1);
}

template <class T>
T cleaned(T v) {
  if constexpr (sizeof(T) == 4)
    return std::isfinite(v) ? v : T(0);
  else
    return v;
}

/// Pixels with 1 to 4 channels, rows in either order, to 1 or 4 channels with associated alpha.
template <class T>
void arrange(Texture& t, const T* pixels, int channels, bool flip, const std::string& alpha, bool multiply) {
  t.channels = channels == 1 ? 1 : 4;
  t.data.resize(size_t(t.width) * size_t(t.height) * t.channels * sizeof(T));
  T* out = reinterpret_cast<T*>(t.data.data());
  for (int y = 0; y < t.height; ++y) {
    const T* in = pixels + size_t(flip ? t.height - 1 - y : y) * size_t(t.width) * size_t(channels);
    for (int x = 0; x < t.width; ++x, in += channels) {
      if (channels == 1) {
        *out++ = cleaned(in[0]);
        continue;
      }
      const bool gray = channels == 2;
      const T a = alpha == "none" || channels == 3 ? opaque<T>() : cleaned(in[channels - 1]);
      for (int c = 0; c < 3; ++c) {
        const T v = cleaned(in[gray ? 0 : c]);
        *out++ = multiply && a != opaque<T>() ? scaled(v, a) : v;
      }
      *out++ = a;
    }
  }
}

void read_pixels(OIIO::ImageInput& input, const Image& image, Texture& t, std::string& error) {
  OIIO::ImageSpec spec = input.spec();
  if (spec.width <= 0 || spec.height <= 0 || spec.nchannels <= 0 || spec.depth > 1 ||
      uint64_t(spec.width) * uint64_t(spec.height) > (1ull << 31)) {
    error = "its size cannot be used; shown magenta";
    return;
  }
  const int channels = std::min(spec.nchannels, 4);
  t.width = spec.width, t.height = spec.height;
  t.kind = spec.format == OIIO::TypeDesc::UINT8  ? Texture::Kind::kByte
           : spec.format == OIIO::TypeDesc::HALF ? Texture::Kind::kHalf
                                                 : Texture::Kind::kFloat;
  const bool multiply = image.alpha == "straight" && (channels == 2 || channels == 4) &&
                        spec.get_int_attribute("oiio:UnassociatedAlpha", 0) != 0 && !is_data(image.colorspace);
  const size_t count = size_t(t.width) * size_t(t.height) * size_t(channels);
  bool read;
  if (t.kind == Texture::Kind::kByte) {
    std::vector<uint8_t> pixels(count);
    read = input.read_image(0, 0, 0, channels, OIIO::TypeDesc::UINT8, pixels.data());
    if (read) arrange(t, pixels.data(), channels, true, image.alpha, multiply);
  } else if (t.kind == Texture::Kind::kHalf && !multiply && channels != 2) {
    std::vector<uint16_t> pixels(count);
    read = input.read_image(0, 0, 0, channels, OIIO::TypeDesc::HALF, pixels.data());
    t.channels = channels == 1 ? 1 : 4;
    t.data.resize(size_t(t.width) * size_t(t.height) * t.channels * 2);
    uint16_t* out = reinterpret_cast<uint16_t*>(t.data.data());
    const auto finite = [](uint16_t h) {
      return (h & 0x7c00u) == 0x7c00u ? uint16_t(h & 0x3ffu ? 0 : (h & 0x8000u) | 0x7bffu) : h;
    };
    for (int y = 0; read && y < t.height; ++y) {
      const uint16_t* in = pixels.data() + size_t(t.height - 1 - y) * size_t(t.width) * size_t(channels);
      for (int x = 0; x < t.width; ++x, in += channels) {
        for (int c = 0; c < t.channels; ++c) {
          const bool one = c == 3 && (channels == 3 || image.alpha == "none");
          *out++ = one ? uint16_t(0x3c00) : finite(in[c]);
        }
      }
    }
  } else {
    t.kind = Texture::Kind::kFloat;
    std::vector<float> pixels(count);
    read = input.read_image(0, 0, 0, channels, OIIO::TypeDesc::FLOAT, pixels.data());
    if (read) arrange(t, pixels.data(), channels, true, image.alpha, multiply);
  }
  if (read) return;
  error = "it is damaged (" + input.geterror() + "); shown magenta";
  t = Texture{};
}

}  // namespace

Texture read_texture(const Image& image, const ImageSource& source, std::string& error) {
  Texture t;
  const Space space = space_of(image.colorspace);
  t.srgb = space == Space::kSrgb;
  if (!source.pixels.empty() || !source.byte_pixels.empty()) {
    const size_t count = size_t(source.width) * source.height * source.channels;
    const bool bytes = source.pixels.empty();
    if (count == 0 || source.channels > 4 || (bytes ? source.byte_pixels.size() : source.pixels.size()) < count) {
      error = "its pixels do not fit its size; shown magenta";
      return t;
    }
    t.width = int(source.width), t.height = int(source.height);
    const bool multiply =
        image.alpha == "straight" && !is_data(image.colorspace) && (source.channels == 2 || source.channels == 4);
    t.kind = bytes ? Texture::Kind::kByte : Texture::Kind::kFloat;
    if (bytes)
      arrange(t, source.byte_pixels.data(), int(source.channels), false, image.alpha, multiply);
    else
      arrange(t, source.pixels.data(), int(source.channels), false, image.alpha, multiply);
  } else {
    OIIO::ImageSpec config;
    config.attribute("oiio:UnassociatedAlpha", 1);
    config.attribute("oiio:ColorSpace", "Linear");
    std::unique_ptr<OIIO::ImageInput> input;
    std::unique_ptr<TemporaryFile> file;
    std::vector<uint8_t> copy;
    std::unique_ptr<OIIO::Filesystem::IOMemReader> memory;
    if (!source.encoded.empty()) {
      const std::string name = name_of_bytes(source.encoded);
      memory = std::make_unique<OIIO::Filesystem::IOMemReader>(const_cast<uint8_t*>(source.encoded.data()),
                                                               source.encoded.size());
      input = OIIO::ImageInput::open(name, &config, memory.get());
      if (!input) {
        file = std::make_unique<TemporaryFile>(source.encoded, name);
        if (!file->path.empty()) input = OIIO::ImageInput::open(file->path, &config);
      }
    } else {
      input = OIIO::ImageInput::open(source.path, &config);
    }
    if (!input) {
      std::string why = OIIO::geterror();
      std::replace(why.begin(), why.end(), '\n', ' ');
      error = (source.encoded.empty() ? "cannot read \"" + source.path + "\"" : "its packed data cannot be read") +
              " (" + why + "); shown magenta";
      return t;
    }
    read_pixels(*input, image, t, error);
    input->close();
  }
  if (t.srgb && t.kind == Texture::Kind::kFloat && space == Space::kSrgb) {  // only bytes stay encoded
    t.srgb = false;
    float* values = reinterpret_cast<float*>(t.data.data());
    const size_t count = t.data.size() / sizeof(float);
    for (size_t k = 0; k < count; ++k) {
      if (t.channels == 1 || k % 4 != 3) values[k] = srgb_to_linear(values[k]);
    }
  }
  if (space == Space::kUnknown && t.valid()) {
    t.srgb = t.kind == Texture::Kind::kByte;
    if (error.empty())
      error = "colour space \"" + image.colorspace + "\" is unknown; taken as " + (t.srgb ? "sRGB" : "linear");
  }
  return t;
}

}  // namespace afterglow
