// What the programs say: figures as JSON, or one line of complaint.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/support/programs.h"

namespace intervale {

inline const std::string& client() {
  static const std::string path = program("intervale-client");
  return path;
}

inline nlohmann::json json_of(const Finished& finished) {
  EXPECT_EQ(finished.status, 0) << finished.err;
  return nlohmann::json::parse(finished.out, nullptr, false);
}

inline nlohmann::json fetch_json(std::vector<std::string> more, const std::string& url) {
  std::vector<std::string> arguments{client(), "fetch", url, "--json"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return json_of(run(arguments));
}

// Status 1 or 2, one line on stderr, nothing on stdout.
inline void expect_complaint(const Finished& finished, int status, const std::string& about, const std::string& who = "intervale-client: ") {
  EXPECT_EQ(finished.status, status) << finished.err;
  EXPECT_THAT(finished.err, ::testing::StartsWith(who));
  EXPECT_THAT(finished.err, ::testing::HasSubstr(about));
  EXPECT_EQ(std::count(finished.err.begin(), finished.err.end(), '\n'), 1) << finished.err;
  EXPECT_EQ(finished.out, "");
}

}  // namespace intervale
