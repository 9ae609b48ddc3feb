#include "server/serve/log.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/sinks/ostream_sink.h>

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

namespace intervale {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::MatchesRegex;

// What is said while it lives.
class Said {
 public:
  explicit Said(LogFormat format, const std::string& level = "info") : before_(spdlog::default_logger()), level_(before_->level()) {
    spdlog::set_default_logger(std::make_shared<spdlog::logger>("said", std::make_shared<spdlog::sinks::ostream_sink_mt>(lines_)));
    configure_log({.format = format, .level = level});
  }
  ~Said() {
    spdlog::set_default_logger(before_);
    spdlog::set_level(level_);
  }
  [[nodiscard]] std::string lines() const { return lines_.str(); }

 private:
  std::ostringstream lines_;
  std::shared_ptr<spdlog::logger> before_;
  spdlog::level::level_enum level_;
};

TEST(Log, TextLinesHaveTheSessionsNumber) {
  const Said said(LogFormat::text);
  log_session(7, spdlog::level::info, "closed: {}", "a\nb\x1b[31m");
  spdlog::info("stopped");
  EXPECT_THAT(said.lines(), MatchesRegex("[-0-9]*T[0-9:.]*[+-][0-9:]* info session 7 closed: a.b.\\[31m\n[^\n]* info stopped\n"));
}

TEST(Log, JsonLinesAreOneObjectEach) {
  const Said said(LogFormat::json);
  log_session(7, spdlog::level::warn, "closed: {}", "\"a\"\nb\xff");
  spdlog::info("stopped");
  std::istringstream lines(said.lines());
  std::string line;
  std::getline(lines, line);
  const auto first = nlohmann::json::parse(line);
  EXPECT_EQ(first.at("session"), 7);
  EXPECT_EQ(first.at("level"), "warning");
  EXPECT_THAT(first.at("message").get<std::string>(), HasSubstr("closed: \"a\"\nb"));
  EXPECT_THAT(first.at("time").get<std::string>(), MatchesRegex("[-0-9]*T[0-9:.]*[+-][0-9:]*"));
  std::getline(lines, line);
  const auto second = nlohmann::json::parse(line);
  EXPECT_FALSE(second.contains("session"));
  EXPECT_EQ(second.at("message"), "stopped");
  EXPECT_FALSE(std::getline(lines, line));
}

// U+202E shows what follows it from right to left; U+009B begins an escape sequence.
TEST(Log, NoNameChangesHowItsLinesAreRead) {
  const std::string name = "cli\u202e\u009b31m\u200bent";
  const Said text(LogFormat::text);
  spdlog::info(name);
  EXPECT_THAT(text.lines(), EndsWith(" info cli??31m?ent\n"));
  const Said json(LogFormat::json);
  spdlog::info(name);
  EXPECT_TRUE(std::ranges::all_of(json.lines(), [](char c) { return c == '\n' || (c >= ' ' && c < '\x7f'); })) << json.lines();
  EXPECT_EQ(nlohmann::json::parse(json.lines()).at("message"), name);
}

TEST(Log, OmitsLinesBelowItsLevel) {
  const Said said(LogFormat::text, "warn");
  log_session(7, spdlog::level::info, "opened");
  EXPECT_EQ(said.lines(), "");
  set_log_level("debug");
  log_session(7, spdlog::level::debug, "opened");
  EXPECT_THAT(said.lines(), HasSubstr("debug session 7 opened"));
}

}  // namespace
}  // namespace intervale
