// SPDX-License-Identifier: GPL-3.0-or-later
// What renders leave behind with a scene for the next render of it: caches outlive sessions, engine objects and frames.
// Whoever takes a thing has it alone; a second taker finds nothing and starts anew. What is kept is as old as its own
// version of the scene says.
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <string>

namespace afterglow {

class Keepsakes {
 public:
  template <class T>
  std::unique_ptr<T> take(const std::string& name) {
    const std::lock_guard lock(mutex_);
    const auto found = kept_.find(name);
    if (found == kept_.end()) return nullptr;
    std::unique_ptr<T> thing(static_cast<T*>(found->second.release()));
    kept_.erase(found);
    return thing;
  }
  /// Replaces what has the same name. The same name always means the same type.
  template <class T>
  void leave(const std::string& name, std::unique_ptr<T> thing) {
    Kept kept(thing.release(), [](void* p) { delete static_cast<T*>(p); });
    const std::lock_guard lock(mutex_);
    kept_.insert_or_assign(name, std::move(kept));
  }
  void clear() {
    const std::lock_guard lock(mutex_);
    kept_.clear();
  }

 private:
  using Kept = std::unique_ptr<void, void (*)(void*)>;
  std::mutex mutex_;
  std::map<std::string, Kept> kept_;
};

}  // namespace afterglow
