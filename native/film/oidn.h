// SPDX-License-Identifier: GPL-3.0-or-later
// OpenImageDenoise by its C interface, versions 1 and 2, loaded at run time: no header and no link dependency, so that
// the engine runs without it and shares the host's copy where there is one.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

namespace afterglow {

/// The C functions, declared from the library's public documentation. Pointers that only one major version has may be
/// null.
struct OidnLibrary {
  using Handle = void*;
  using Monitor = bool (*)(void* user, double progress);

  std::string path;
  int version = 0;  // major · 10000 + minor · 100 + patch

  Handle (*new_device)(int type) = nullptr;
  void (*commit_device)(Handle) = nullptr;
  void (*release_device)(Handle) = nullptr;
  int (*device_error)(Handle, const char** message) = nullptr;
  int (*device_int)(Handle, const char* name) = nullptr;
  void (*set_device_bool)(Handle, const char* name, bool) = nullptr;
  Handle (*new_filter)(Handle device, const char* type) = nullptr;
  void (*commit_filter)(Handle) = nullptr;
  void (*execute_filter)(Handle) = nullptr;
  void (*release_filter)(Handle) = nullptr;
  void (*set_image)(Handle, const char* name, void* data, int format, size_t width, size_t height, size_t offset,
                    size_t pixel_stride, size_t row_stride) = nullptr;
  void (*set_filter_bool)(Handle, const char* name, bool) = nullptr;
  void (*set_filter_int)(Handle, const char* name, int) = nullptr;
  void (*set_monitor)(Handle, Monitor, void* user) = nullptr;

  static constexpr int kCpuDevice = 1, kFormatFloat3 = 3, kQualityFast = 4, kQualityBalanced = 5, kQualityHigh = 6;
};

/// Where a copy may be: what the process has mapped, then `search` (folders or files), then names the loader knows.
std::vector<std::string> oidn_candidates(const std::vector<std::string>& search);

/// The first candidate that loads and makes a device, kept loaded for the life of the process; null: `reason` says
/// what was tried. Safe from any thread.
std::shared_ptr<const OidnLibrary> load_oidn(const std::vector<std::string>& search, std::string& reason);

}  // namespace afterglow
