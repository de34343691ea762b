// SPDX-License-Identifier: GPL-3.0-or-later
// The list of denoisers, and the one over OpenImageDenoise: a device and filters that live as long as the Denoiser,
// images handed over without a copy unless they hold values that are not finite.
#include "film/denoiser.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <map>
#include <mutex>

#include "base/errors.h"
#include "base/parallel.h"
#include "film/layered_denoiser.h"
#include "film/oidn.h"

namespace afterglow {

namespace {

constexpr const char* kOidnId = "OPENIMAGEDENOISE";
constexpr const char* kOidnLabel = "OpenImageDenoise";

uint64_t count_broken(const float* image, uint32_t width, uint32_t height) {
  std::atomic<uint64_t> count{0};
  parallel_blocks(size_t(width) * height * 3, 1 << 14, [&](size_t begin, size_t end) {
    uint64_t broken = 0;
    for (size_t i = begin; i < end; ++i) broken += !std::isfinite(image[i]);
    if (broken) count += broken;
  });
  return count;
}

/// The mean of a value's finite neighbours, 0 without any.
float mean_around(const float* image, uint32_t width, uint32_t height, uint32_t x, uint32_t y, uint32_t channel) {
  float sum = 0.0f;
  int count = 0;
  for (uint32_t ny = y ? y - 1 : 0; ny <= std::min(y + 1, height - 1); ++ny)
    for (uint32_t nx = x ? x - 1 : 0; nx <= std::min(x + 1, width - 1); ++nx) {
      const float v = image[(size_t(ny) * width + nx) * 3 + channel];
      if (std::isfinite(v)) sum += v, ++count;
    }
  return count ? sum / float(count) : 0.0f;
}

/// A copy in which each value that is not finite is the mean of its finite neighbours.
std::vector<float> mended(const float* image, uint32_t width, uint32_t height) {
  std::vector<float> out(image, image + size_t(width) * height * 3);
  parallel_blocks(out.size(), 1 << 14, [&](size_t begin, size_t end) {
    for (size_t at = begin; at < end; ++at) {
      if (std::isfinite(image[at])) continue;
      const size_t pixel = at / 3;
      out[at] = mean_around(image, width, height, uint32_t(pixel % width), uint32_t(pixel / width), uint32_t(at % 3));
    }
  });
  return out;
}

/// One filter of the library with the images that it was given last. The library cannot take an image back everywhere,
/// so a filter that would have to is made anew.
class OidnFilter {
 public:
  OidnFilter(const OidnLibrary& library, OidnLibrary::Handle device) : library_(library), device_(device) {}
  ~OidnFilter() { release(); }
  OidnFilter(const OidnFilter&) = delete;

  using Images = std::vector<std::pair<const char*, const float*>>;  // null: left out
  void run(const Images& images, float* output, const DenoiseInput& in, bool clean, bool fast) {
    std::string names;
    for (const auto& [name, image] : images)
      if (image) names += name;
    if (!filter_ || names != names_) make(names);
    for (const auto& [name, image] : images)
      if (image) set_image(name, const_cast<float*>(image), in);
    set_image("output", output, in);
    const bool picture = images[0].first == std::string("color");
    library_.set_filter_bool(filter_, "hdr", picture && in.hdr);
    if (picture) library_.set_filter_bool(filter_, "cleanAux", clean);
    if (library_.version >= 20000) {
      const int quick = library_.version >= 20300 ? OidnLibrary::kQualityFast : OidnLibrary::kQualityBalanced;
      library_.set_filter_int(filter_, "quality", fast ? quick : OidnLibrary::kQualityHigh);
    }
    StopToken stop = in.stop;
    library_.set_monitor(
        filter_, [](void* user, double) { return !static_cast<StopToken*>(user)->stop(); }, &stop);
    library_.commit_filter(filter_);
    if (!in.stop.stop()) library_.execute_filter(filter_);
    library_.set_monitor(filter_, nullptr, nullptr);
    const char* text = nullptr;
    const int error = library_.device_error(device_, &text);
    if (in.stop.stop()) throw Cancelled("denoising was cancelled");
    if (error != 0) throw Error(std::string("OpenImageDenoise: ") + (text ? text : "unknown error"));
  }

 private:
  void make(const std::string& names) {
    release();
    filter_ = library_.new_filter(device_, "RT");
    const char* text = nullptr;
    if (library_.device_error(device_, &text) != 0 || !filter_)
      throw Unsupported(std::string("OpenImageDenoise: ") + (text ? text : "no filter"));
    names_ = names;
  }

  void set_image(const char* name, float* image, const DenoiseInput& in) {
    library_.set_image(filter_, name, image, OidnLibrary::kFormatFloat3, in.width, in.height, 0, 0, 0);
  }

  void release() {
    if (filter_) library_.release_filter(filter_);
    filter_ = nullptr;
  }

  const OidnLibrary& library_;
  const OidnLibrary::Handle device_;
  OidnLibrary::Handle filter_ = nullptr;
  std::string names_;
};

class OidnDenoiser final : public Denoiser {
 public:
  explicit OidnDenoiser(std::shared_ptr<const OidnLibrary> library) : library_(std::move(library)) {
    device_ = library_->new_device(OidnLibrary::kCpuDevice);
    if (!device_) throw Unsupported("OpenImageDenoise: " + message(nullptr));
    library_->set_device_bool(device_, "setAffinity", false);  // the threads are shared with the renderer
    library_->commit_device(device_);
    if (library_->device_error(device_, nullptr) != 0) {
      library_->release_device(device_);
      throw Unsupported("OpenImageDenoise: no CPU device");
    }
    for (auto& filter : filters_) filter = std::make_unique<OidnFilter>(*library_, device_);
  }
  ~OidnDenoiser() override {
    for (auto& filter : filters_) filter.reset();
    library_->release_device(device_);
  }
  OidnDenoiser(const OidnDenoiser&) = delete;

  uint64_t filter(const DenoiseInput& in, float* output) override {
    if (!in.color || !output || in.width == 0 || in.height == 0) throw InvalidInput("denoise: an image without pixels");
    uint64_t broken = 0;
    const float* color = finite(in.color, in, copies_[0], broken);
    const float* albedo = finite(in.albedo, in, copies_[1], broken);
    // The library takes normals beside albedo only.
    const float* normal = finite(albedo ? in.normal : nullptr, in, copies_[2], broken);
    bool clean = in.clean_auxiliary;
    if (in.prefilter && albedo && library_->version >= kFirstWithPrefilter) {
      albedo = prefiltered(1, "albedo", albedo, in);
      if (normal) normal = prefiltered(2, "normal", normal, in);
      clean = true;
    }
    filters_[0]->run({{"color", color}, {"albedo", albedo}, {"normal", normal}}, output, in, clean && albedo, in.fast);
    pixels_ = size_t(in.width) * in.height;
    return broken;
  }

  void rest() override {
    if (pixels_ <= kMostPixelsKept) return;
    for (auto& filter : filters_) filter = std::make_unique<OidnFilter>(*library_, device_);
    copies_ = {};
    guides_ = {};
  }

 private:
  static constexpr size_t kMostPixelsKept = size_t(1) << 21;
  static constexpr int kFirstWithPrefilter = 10400;

  static const float* finite(const float* image, const DenoiseInput& in, std::vector<float>& copy, uint64_t& broken) {
    if (!image) return nullptr;
    const uint64_t count = count_broken(image, in.width, in.height);
    broken += count;
    if (!count) return image;
    copy = mended(image, in.width, in.height);
    return copy.data();
  }

  /// The fast network does for guides: on Country Kitchen the picture's error is 1.5 % higher than with the slow one.
  const float* prefiltered(size_t which, const char* name, const float* image, const DenoiseInput& in) {
    std::vector<float>& out = guides_[which - 1];
    out.resize(size_t(in.width) * in.height * 3);
    filters_[which]->run({{name, image}}, out.data(), in, false, true);
    return out.data();
  }

  std::string message(void* device) {
    const char* text = nullptr;
    library_->device_error(device, &text);
    return text && *text ? text : "no CPU device";
  }

  std::shared_ptr<const OidnLibrary> library_;
  OidnLibrary::Handle device_ = nullptr;
  std::array<std::unique_ptr<OidnFilter>, 3> filters_;  // picture, albedo, normal
  std::array<std::vector<float>, 3> copies_;
  std::array<std::vector<float>, 2> guides_;
  size_t pixels_ = 0;
};

/// Denoisers that nobody uses, by id: one of each is kept. Never destroyed: the library may be gone at the process's
/// end.
struct Idle {
  std::mutex mutex;
  std::map<std::string, std::unique_ptr<Denoiser>> kept;
};
Idle& idle() {
  static Idle* all = new Idle;
  return *all;
}

std::string version_text(int version) {
  return std::to_string(version / 10000) + "." + std::to_string(version / 100 % 100) + "." +
         std::to_string(version % 100);
}

}  // namespace

std::vector<DenoiserInfo> list_denoisers(const std::vector<std::string>& search) {
  DenoiserInfo oidn;
  oidn.id = kOidnId, oidn.label = kOidnLabel;
  if (const auto library = load_oidn(search, oidn.reason)) {
    oidn.available = true;
    oidn.path = library->path;
    oidn.version = version_text(library->version);
    oidn.reason.clear();
  }
  DenoiserInfo layered;
  layered.id = kLayeredId, layered.label = "Layered Filter", layered.available = true;
  return {oidn, layered};
}

std::string chosen_denoiser(const std::string& id, const std::vector<std::string>& search) {
  if (id != "AUTO") return id;
  for (const DenoiserInfo& known : list_denoisers(search))
    if (known.available) return known.id;
  return id;
}

PassSet denoise_passes(const std::string& chosen) {
  if (chosen != kLayeredId) return kDenoisePasses;
  return bit(Pass::kDenoiseNormal) | bit(Pass::kDenoiseSurface) | bit(Pass::kEmission) | bit(Pass::kEnvironment);
}

std::unique_ptr<Denoiser> make_denoiser(const std::string& id, const std::vector<std::string>& search) {
  const std::string chosen = chosen_denoiser(id, search);
  if (chosen == kLayeredId) return make_layered_denoiser();
  if (chosen != kOidnId)
    throw InvalidInput("denoiser \"" + id + "\" is unknown: AUTO, " + kOidnId + " or " + kLayeredId);
  std::string reason;
  const auto library = load_oidn(search, reason);
  if (!library) throw Unsupported(reason);
  return std::make_unique<OidnDenoiser>(library);
}

std::shared_ptr<Denoiser> borrow_denoiser(const std::string& id, const std::vector<std::string>& search) {
  std::string key = id;
  for (const std::string& place : search) key += '\n' + place;
  std::unique_ptr<Denoiser> denoiser;
  {
    const std::lock_guard<std::mutex> lock(idle().mutex);
    denoiser = std::move(idle().kept[key]);
  }
  if (!denoiser) denoiser = make_denoiser(id, search);
  return {denoiser.release(), [key](Denoiser* back) {
            std::unique_ptr<Denoiser> given(back);
            given->rest();
            const std::lock_guard<std::mutex> lock(idle().mutex);
            std::unique_ptr<Denoiser>& place = idle().kept[key];
            if (!place) place = std::move(given);
          }};
}

}  // namespace afterglow
