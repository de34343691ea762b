// SPDX-License-Identifier: GPL-3.0-or-later
// The list of all methods: a new one is its folder and one line here.
#include "base/errors.h"
#include "methods/hash_cache/hash_cache.h"
#include "methods/instant_cache/instant_cache.h"
#include "methods/instant_radiosity/instant_radiosity.h"
#include "methods/path_tracing/path_tracing.h"

namespace afterglow {

namespace {

struct Entry {
  MethodDescription (*describe)();
  std::unique_ptr<IndirectMethod> (*make)();
};

constexpr Entry kEntries[] = {
    {path_tracing::describe, path_tracing::make},
    {instant_cache::describe, instant_cache::make},
    {instant_radiosity::describe, instant_radiosity::make},
    {hash_cache::describe, hash_cache::make},
};

}  // namespace

const std::vector<MethodDescription>& method_descriptions() {
  static const std::vector<MethodDescription> descriptions = [] {
    std::vector<MethodDescription> all;
    for (const Entry& entry : kEntries) all.push_back(entry.describe());
    return all;
  }();
  return descriptions;
}

Settings with_defaults(const Settings& given) {
  Settings all;
  for (const MethodDescription& method : method_descriptions())
    for (const SettingDescription& s : method.settings) all.emplace_back(s.name, s.default_value);
  all.insert(all.end(), given.begin(), given.end());  // the last of a name counts
  return all;
}

std::unique_ptr<IndirectMethod> make_method(const std::string& id) {
  std::string known;
  for (size_t i = 0; i < method_descriptions().size(); ++i) {
    const std::string& name = method_descriptions()[i].id;
    if (name == id) return kEntries[i].make();
    known += (i ? ", " : "") + name;
  }
  throw InvalidInput("no method is called '" + id + "'; known methods: AUTO, " + known);
}

}  // namespace afterglow
