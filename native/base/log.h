// SPDX-License-Identifier: GPL-3.0-or-later
// Where messages for people go: to the sink that the host has set, or nowhere. Levels: "info", "warning", "error".
#pragma once

#include <functional>
#include <string>

namespace afterglow {

using LogSink = std::function<void(const std::string& level, const std::string& text)>;

void set_log_sink(LogSink);
void log_message(const std::string& level, const std::string& text);

}  // namespace afterglow
