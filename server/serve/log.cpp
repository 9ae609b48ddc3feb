#include "server/serve/log.h"

#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/stdout_color_sinks.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>
#include <string_view>

#include "common/util/printable.h"

namespace intervale {
namespace {

constexpr std::array<std::string_view, 6> kLevels{"trace", "debug", "info", "warn", "error", "off"};

// The session and the message.
class Message : public spdlog::custom_flag_formatter {
 public:
  explicit Message(LogFormat format) : format_(format) {}
  void format(const spdlog::details::log_msg& message, const std::tm& /*time*/, spdlog::memory_buf_t& line) override {
    const std::string payload(message.payload.data(), message.payload.size());
    const auto end = std::back_inserter(line);
    if (format_ == LogFormat::text) {
      if (log_detail::session) fmt::format_to(end, "session {} ", *log_detail::session);
      fmt::format_to(end, "{}", printable(payload));
    } else {
      if (log_detail::session) fmt::format_to(end, "\"session\":{},", *log_detail::session);
      // JSON must be UTF-8; a file name in a message may not be. Escapes of all that is not ASCII make it safe to look at.
      constexpr bool kAscii = true;
      fmt::format_to(end, "\"message\":{}", nlohmann::json(payload).dump(-1, ' ', kAscii, nlohmann::json::error_handler_t::replace));
    }
  }
  [[nodiscard]] std::unique_ptr<custom_flag_formatter> clone() const override { return std::make_unique<Message>(format_); }

 private:
  LogFormat format_;
};

}  // namespace

bool is_log_level(const std::string& name) { return std::find(kLevels.begin(), kLevels.end(), name) != kLevels.end(); }

void set_log_level(const std::string& name) { spdlog::set_level(spdlog::level::from_str(name)); }

void start_log(const LogOptions& options) {
  // Stdout is for results.
  if (!spdlog::get("intervale")) spdlog::set_default_logger(spdlog::stderr_color_mt("intervale"));
  configure_log(options);
}

void configure_log(const LogOptions& options) {
  auto formatter = std::make_unique<spdlog::pattern_formatter>();
  const bool is_text = options.format == LogFormat::text;
  formatter->add_flag<Message>('*', options.format)
      .set_pattern(is_text ? "%Y-%m-%dT%H:%M:%S.%e%z %^%l%$ %*" : R"({"time":"%Y-%m-%dT%H:%M:%S.%e%z","level":"%l",%*})");
  spdlog::set_formatter(std::move(formatter));
  set_log_level(options.level);
}

}  // namespace intervale
