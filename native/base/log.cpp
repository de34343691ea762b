// SPDX-License-Identifier: GPL-3.0-or-later
// The log's sink: see log.h.
#include "base/log.h"

#include <memory>
#include <mutex>

namespace afterglow {

namespace {

std::mutex sink_lock;
std::shared_ptr<const LogSink> sink;

}  // namespace

void set_log_sink(LogSink new_sink) {
  auto next = new_sink ? std::make_shared<const LogSink>(std::move(new_sink)) : nullptr;
  const std::lock_guard lock(sink_lock);
  sink.swap(next);
}

void log_message(const std::string& level, const std::string& text) {
  std::shared_ptr<const LogSink> current;
  {
    const std::lock_guard lock(sink_lock);
    current = sink;
  }
  if (current) (*current)(level, text);  // outside the lock: a sink may log or set another sink
}

}  // namespace afterglow
