// What the server says while it runs: lines on stderr, as text or as JSON. Any thread, through spdlog's default logger.
#pragma once

#include <spdlog/spdlog.h>

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>

namespace intervale {

enum class LogFormat { text, json };

struct LogOptions {
  LogFormat format = LogFormat::text;
  std::string level = "info";  // one that is_log_level
  // What the configuration file says of the level now, for SIGHUP; nothing if it says nothing.
  std::function<std::optional<std::string>()> configured_level = [] { return std::nullopt; };
};

// trace, debug, info, warn, error, off.
[[nodiscard]] bool is_log_level(const std::string& name);
void set_log_level(const std::string& name);

// Text: "2026-01-31T12:00:00.000+00:00 info session 7 closed: …". JSON: one object a line, with time, level, session (where there is one) and
// message. What is said stays on its line: control characters are escaped, or in text shown as '?'.
void start_log(const LogOptions& options);
void shape_log(const LogOptions& options);  // the part of it that makes no new logger but changes the one there is

namespace log_detail {
inline thread_local std::optional<std::uint64_t> session;  // which the line that is being said is about
}

// A line about a session.
template <class... Args>
void log_session(std::uint64_t session, spdlog::level::level_enum level, spdlog::format_string_t<Args...> format, Args&&... args) {
  if (!spdlog::default_logger_raw()->should_log(level)) return;
  log_detail::session = session;
  spdlog::log(level, format, std::forward<Args>(args)...);
  log_detail::session.reset();
}

}  // namespace intervale
