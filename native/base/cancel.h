// SPDX-License-Identifier: GPL-3.0-or-later
// A flag that asks long work to stop. Every loop of ours looks at it at least every few milliseconds.
#pragma once

#include <atomic>

namespace afterglow {

class StopToken {
 public:
  StopToken() = default;
  explicit StopToken(const std::atomic<bool>* flag) : flag_(flag) {}
  bool stop() const { return flag_ && flag_->load(std::memory_order_relaxed); }

 private:
  const std::atomic<bool>* flag_ = nullptr;
};

}  // namespace afterglow
