// The server's log: lines of text or JSON on stderr. Any thread, through spdlog's default logger.
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
  std::string level = "info";  // see is_log_level()
  // The level that the configuration file has now, for SIGHUP; nullopt if it has none.
  std::function<std::optional<std::string>()> configured_level = [] { return std::nullopt; };
};

// trace, debug, info, warn, error, off.
[[nodiscard]] bool is_log_level(const std::string& name);
void set_log_level(const std::string& name);

// Text: "2026-01-31T12:00:00.000+00:00 info session 7 closed: …". JSON: one object on each line, with time, level,
// session (in lines about a session) and message. A message is one line. Text: printable(). JSON: ASCII, all else is
// escaped.
void start_log(const LogOptions& options);
void configure_log(const LogOptions& options);  // sets format and level of the existing default logger

namespace log_detail {
inline thread_local std::optional<std::uint64_t> session;  // that the current line is about
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
