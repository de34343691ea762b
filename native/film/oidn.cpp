// SPDX-License-Identifier: GPL-3.0-or-later
// Finds and loads OpenImageDenoise (see oidn.h).
#include "film/oidn.h"

#include <dirent.h>
#include <dlfcn.h>
#include <sys/stat.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <mutex>

namespace afterglow {

namespace {

constexpr const char* kPrefix = "libOpenImageDenoise.so";

bool is_library(const std::string& name) { return name.compare(0, std::string(kPrefix).size(), kPrefix) == 0; }

void add(std::vector<std::string>& list, const std::string& path) {
  if (std::find(list.begin(), list.end(), path) == list.end()) list.push_back(path);
}

void add_mapped(std::vector<std::string>& list) {
  std::ifstream maps("/proc/self/maps");
  for (std::string line; std::getline(maps, line);) {
    const size_t path = line.find('/');
    if (path == std::string::npos) continue;
    const size_t name = line.rfind('/') + 1;
    if (is_library(line.substr(name))) add(list, line.substr(path));
  }
}

// POSIX instead of std::filesystem, which the C++ library of Blender's oldest hosts (GCC 8) does not have.
void add_folder(std::vector<std::string>& list, const std::string& folder) {
  DIR* entries = opendir(folder.c_str());
  if (!entries) return;
  std::vector<std::string> found;
  while (const dirent* entry = readdir(entries))
    if (is_library(entry->d_name)) found.push_back(folder + "/" + entry->d_name);
  closedir(entries);
  std::sort(found.begin(), found.end());
  for (const std::string& path : found) add(list, path);
}

template <class F>
bool symbol(void* library, F& function, std::initializer_list<const char*> names) {
  for (const char* name : names)
    if (void* address = dlsym(library, name)) {
      function = reinterpret_cast<F>(address);
      return true;
    }
  return false;
}

/// Null and a reason, or the library with a device made once, so that later failures are about memory alone.
std::shared_ptr<const OidnLibrary> open_library(const std::string& path, std::string& reason) {
  void* handle = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (!handle) {
    const char* message = dlerror();
    reason = message ? message : "cannot be loaded";
    return nullptr;
  }
  auto l = std::make_shared<OidnLibrary>();
  l->path = path;
  const bool complete =
      symbol(handle, l->new_device, {"oidnNewDevice"}) && symbol(handle, l->commit_device, {"oidnCommitDevice"}) &&
      symbol(handle, l->release_device, {"oidnReleaseDevice"}) &&
      symbol(handle, l->device_error, {"oidnGetDeviceError"}) &&
      symbol(handle, l->device_int, {"oidnGetDeviceInt", "oidnGetDevice1i"}) &&
      symbol(handle, l->set_device_bool, {"oidnSetDeviceBool", "oidnSetDevice1b"}) &&
      symbol(handle, l->new_filter, {"oidnNewFilter"}) && symbol(handle, l->commit_filter, {"oidnCommitFilter"}) &&
      symbol(handle, l->execute_filter, {"oidnExecuteFilter"}) &&
      symbol(handle, l->release_filter, {"oidnReleaseFilter"}) &&
      symbol(handle, l->set_image, {"oidnSetSharedFilterImage"}) &&
      symbol(handle, l->set_filter_bool, {"oidnSetFilterBool", "oidnSetFilter1b"}) &&
      symbol(handle, l->set_filter_int, {"oidnSetFilterInt", "oidnSetFilter1i"}) &&
      symbol(handle, l->set_monitor, {"oidnSetFilterProgressMonitorFunction"});
  if (!complete) {
    reason = path + ": lacks functions of OpenImageDenoise's C interface";
    return nullptr;
  }
  OidnLibrary::Handle device = l->new_device(OidnLibrary::kCpuDevice);
  const char* message = nullptr;
  if (device) l->commit_device(device);
  if (!device || l->device_error(device, &message) != 0) {
    if (!device) l->device_error(nullptr, &message);
    reason = path + ": " + (message && *message ? message : "no CPU device");
    if (device) l->release_device(device);
    return nullptr;
  }
  l->version = l->device_int(device, "version");
  l->release_device(device);
  return l;
}

}  // namespace

std::vector<std::string> oidn_candidates(const std::vector<std::string>& search) {
  std::vector<std::string> list;
  add_mapped(list);
  for (const std::string& place : search) {
    struct stat what {};
    if (stat(place.c_str(), &what) != 0) continue;
    if (S_ISDIR(what.st_mode))
      add_folder(list, place);
    else if (S_ISREG(what.st_mode))
      add(list, place);
  }
  for (const char* suffix : {".2", ".1", ".0", ""}) add(list, std::string(kPrefix) + suffix);
  return list;
}

std::shared_ptr<const OidnLibrary> load_oidn(const std::vector<std::string>& search, std::string& reason) {
  static std::mutex mutex;
  static std::map<std::string, std::shared_ptr<const OidnLibrary>> loaded;  // failures are tried again
  const std::lock_guard<std::mutex> lock(mutex);
  std::string tried;
  for (const std::string& path : oidn_candidates(search)) {
    auto& entry = loaded[path];
    std::string why;
    if (!entry) entry = open_library(path, why);
    if (entry) return entry;
    const bool bare_name = path.find('/') == std::string::npos;
    if (!bare_name) tried += (tried.empty() ? "" : "; ") + why;
  }
  reason = tried.empty() ? "no copy of OpenImageDenoise was found: official Blender brings one, and so does the system "
                           "package libopenimagedenoise where there is one"
                         : "OpenImageDenoise cannot be used: " + tried;
  return nullptr;
}

}  // namespace afterglow
