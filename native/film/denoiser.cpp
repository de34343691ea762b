// SPDX-License-Identifier: GPL-3.0-or-later
// The list of denoisers and the one over OpenImageDenoise: a device and a filter that live as long as the Denoiser,
// images handed over without a copy unless they hold values that are not finite.
#include "film/denoiser.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>

#include "base/errors.h"
#include "film/oidn.h"

namespace afterglow {

namespace {

constexpr const char* kOidnId = "OPENIMAGEDENOISE";
constexpr const char* kOidnLabel = "OpenImageDenoise";

uint64_t count_broken(const float* image, uint32_t width, uint32_t height) {
  std::atomic<uint64_t> count{0};
  tbb::parallel_for(uint32_t(0), height, [&](uint32_t y) {
    const float* row = image + size_t(y) * width * 3;
    uint64_t broken = 0;
    for (size_t i = 0; i < size_t(width) * 3; ++i) broken += !std::isfinite(row[i]);
    if (broken) count += broken;
  });
  return count;
}

/// A copy in which each value that is not finite is the mean of its finite neighbours (0 without any).
std::vector<float> mended(const float* image, uint32_t width, uint32_t height) {
  std::vector<float> out(image, image + size_t(width) * height * 3);
  tbb::parallel_for(uint32_t(0), height, [&](uint32_t y) {
    for (uint32_t x = 0; x < width; ++x)
      for (uint32_t c = 0; c < 3; ++c) {
        const size_t at = (size_t(y) * width + x) * 3 + c;
        if (std::isfinite(image[at])) continue;
        float sum = 0.0f;
        int count = 0;
        for (uint32_t ny = y ? y - 1 : 0; ny <= std::min(y + 1, height - 1); ++ny)
          for (uint32_t nx = x ? x - 1 : 0; nx <= std::min(x + 1, width - 1); ++nx) {
            const float v = image[(size_t(ny) * width + nx) * 3 + c];
            if (std::isfinite(v)) sum += v, ++count;
          }
        out[at] = count ? sum / float(count) : 0.0f;
      }
  });
  return out;
}

class OidnDenoiser final : public Denoiser {
 public:
  explicit OidnDenoiser(std::shared_ptr<const OidnLibrary> library) : library_(std::move(library)) {
    device_ = library_->new_device(OidnLibrary::kCpuDevice);
    if (!device_) throw Unsupported("OpenImageDenoise: " + message(nullptr));
    library_->set_device_bool(device_, "setAffinity", false);  // the threads are shared with the renderer
    library_->commit_device(device_);
    try {
      new_filter();
    } catch (...) {
      release();
      throw;
    }
  }
  ~OidnDenoiser() override { release(); }
  OidnDenoiser(const OidnDenoiser&) = delete;

  uint64_t filter(const DenoiseInput& in, float* output) override {
    if (!in.color || !output || in.width == 0 || in.height == 0) throw InvalidInput("denoise: an image without pixels");
    const bool albedo = in.albedo, normal = in.albedo && in.normal;  // the library takes normals beside albedo only
    if ((had_albedo_ && !albedo) || (had_normal_ && !normal)) new_filter();  // images cannot be taken back everywhere
    had_albedo_ = albedo, had_normal_ = normal;
    uint64_t broken = 0;
    set_input("color", in.color, in, color_, broken);
    set_input("albedo", in.albedo, in, albedo_, broken);
    set_input("normal", normal ? in.normal : nullptr, in, normal_, broken);
    set_image("output", output, in);
    library_->set_filter_bool(filter_, "hdr", in.hdr);
    library_->set_filter_bool(filter_, "cleanAux", in.clean_auxiliary && in.albedo);
    if (library_->version >= 20000) {
      const int fast = library_->version >= 20300 ? OidnLibrary::kQualityFast : OidnLibrary::kQualityBalanced;
      library_->set_filter_int(filter_, "quality", in.fast ? fast : OidnLibrary::kQualityHigh);
    }
    StopToken stop = in.stop;
    library_->set_monitor(
        filter_, [](void* user, double) { return !static_cast<StopToken*>(user)->stop(); }, &stop);
    library_->commit_filter(filter_);
    library_->execute_filter(filter_);
    library_->set_monitor(filter_, nullptr, nullptr);
    const char* text = nullptr;
    const int error = library_->device_error(device_, &text);
    if (in.stop.stop()) throw Cancelled("denoising was cancelled");
    if (error != 0) throw Error(std::string("OpenImageDenoise: ") + (text ? text : "unknown error"));
    return broken;
  }

 private:
  void set_input(const char* name, const float* image, const DenoiseInput& in, std::vector<float>& copy,
                 uint64_t& broken) {
    if (!image) return;
    const uint64_t count = count_broken(image, in.width, in.height);
    broken += count;
    if (count) {
      copy = mended(image, in.width, in.height);
      image = copy.data();
    }
    set_image(name, const_cast<float*>(image), in);
  }

  void set_image(const char* name, float* image, const DenoiseInput& in) {
    library_->set_image(filter_, name, image, OidnLibrary::kFormatFloat3, in.width, in.height, 0, 0, 0);
  }

  void new_filter() {
    if (filter_) library_->release_filter(filter_);
    filter_ = library_->new_filter(device_, "RT");
    const char* text = nullptr;
    if (library_->device_error(device_, &text) != 0 || !filter_)
      throw Unsupported(std::string("OpenImageDenoise: ") + (text ? text : "no filter"));
  }

  std::string message(void* device) {
    const char* text = nullptr;
    library_->device_error(device, &text);
    return text && *text ? text : "no CPU device";
  }

  void release() {
    if (filter_) library_->release_filter(filter_);
    if (device_) library_->release_device(device_);
    filter_ = device_ = nullptr;
  }

  std::shared_ptr<const OidnLibrary> library_;
  OidnLibrary::Handle device_ = nullptr, filter_ = nullptr;
  bool had_albedo_ = false, had_normal_ = false;
  std::vector<float> color_, albedo_, normal_;
};

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
  return {oidn};
}

std::unique_ptr<Denoiser> make_denoiser(const std::string& id, const std::vector<std::string>& search) {
  if (id != "AUTO" && id != kOidnId)
    throw InvalidInput("denoiser \"" + id + "\" is unknown: AUTO or " + std::string(kOidnId));
  std::string reason;
  const auto library = load_oidn(search, reason);
  if (!library) throw Unsupported(reason);
  return std::make_unique<OidnDenoiser>(library);
}

}  // namespace afterglow
