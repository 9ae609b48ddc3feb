#include "server/serve/log.h"

#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/stdout_color_sinks.h>

#include <algorithm>
#include <array>
#include <memory>
#include <nlohmann/json.hpp>
#include <string_view>

#include "common/util/printable.h"

namespace intervale {
namespace {

constexpr std::array<std::string_view, 6> kLevels{"trace", "debug", "info", "warn", "error", "off"};

void append(spdlog::memory_buf_t& line, std::string_view text) { line.append(text.data(), text.data() + text.size()); }

std::string_view payload_of(const spdlog::details::log_msg& message) { return {message.payload.data(), message.payload.size()}; }

class TextMessage : public spdlog::custom_flag_formatter {
 public:
  void format(const spdlog::details::log_msg& message, const std::tm& /*time*/, spdlog::memory_buf_t& line) override {
    if (log_detail::session) append(line, "session " + std::to_string(*log_detail::session) + " ");
    append(line, printable(payload_of(message)));
  }
  [[nodiscard]] std::unique_ptr<custom_flag_formatter> clone() const override { return std::make_unique<TextMessage>(); }
};

class JsonMessage : public spdlog::custom_flag_formatter {
 public:
  void format(const spdlog::details::log_msg& message, const std::tm& /*time*/, spdlog::memory_buf_t& line) override {
    if (log_detail::session) append(line, "\"session\":" + std::to_string(*log_detail::session) + ",");
    // JSON must be UTF-8; a file name in a message may not be.
    const nlohmann::json text = std::string(payload_of(message));
    append(line, "\"message\":" + text.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
  }
  [[nodiscard]] std::unique_ptr<custom_flag_formatter> clone() const override { return std::make_unique<JsonMessage>(); }
};

std::unique_ptr<spdlog::formatter> formatter_of(LogFormat format) {
  auto formatter = std::make_unique<spdlog::pattern_formatter>();
  if (format == LogFormat::json) {
    formatter->add_flag<JsonMessage>('*').set_pattern(R"({"time":"%Y-%m-%dT%H:%M:%S.%e%z","level":"%l",%*})");
  } else {
    formatter->add_flag<TextMessage>('*').set_pattern("%Y-%m-%dT%H:%M:%S.%e%z %^%l%$ %*");
  }
  return formatter;
}

}  // namespace

bool is_log_level(const std::string& name) { return std::find(kLevels.begin(), kLevels.end(), name) != kLevels.end(); }

void set_log_level(const std::string& name) { spdlog::set_level(spdlog::level::from_str(name)); }

void start_log(const LogOptions& options) {
  // Stdout is for results.
  if (!spdlog::get("intervale")) spdlog::set_default_logger(spdlog::stderr_color_mt("intervale"));
  configure_log(options);
}

void configure_log(const LogOptions& options) {
  spdlog::set_formatter(formatter_of(options.format));
  set_log_level(options.level);
}

}  // namespace intervale
