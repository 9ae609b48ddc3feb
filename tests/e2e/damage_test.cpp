// Files with damaged pages, as the users of the programs meet them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstddef>
#include <cstring>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/support/complaints.h"
#include "tests/support/page_damage.h"
#include "tests/support/programs.h"
#include "tests/support/serving.h"
#include "tests/support/temp_dir.h"

namespace intervale {
namespace {

using ::testing::HasSubstr;

TEST(Damage, ADamagedPageIsNamedAndTheRestIsExtractedAndServed) {
  const TempDir folder;
  const std::string whole = folder / "whole.ivm", damaged = folder / "damaged.ivm";
  ASSERT_EQ(run({program("intervale"), "sample", "gyroid", "-o", folder / "gyroid.nrrd", "--size", "97"}).status, 0);
  ASSERT_EQ(run({program("intervale"), "build", folder / "gyroid.nrrd", "-o", whole}).status, 0);
  std::ifstream in(whole, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  std::vector<std::byte> bytes(text.size());
  std::memcpy(bytes.data(), text.data(), text.size());
  ASSERT_GT(testing::page_count(bytes), 2u);
  testing::damage_page(bytes, 2);
  (void)folder.file("damaged.ivm", {reinterpret_cast<const char*>(bytes.data()), bytes.size()});

  expect_complaint(run({program("intervale"), "verify", damaged}), 1, "page 2 of ", "intervale: ");
  EXPECT_EQ(json_of(run({program("intervale"), "info", damaged, "--json"})).at("file_bytes"), bytes.size()) << "pages are not read";
  const std::vector<std::string> extract{program("intervale"), "extract", damaged, "--range", "-0.3", "0.2", "--digest", "--json"};
  expect_complaint(run(extract), 1, "page 2 of ", "intervale: ");
  expect_complaint(run({program("intervale"), "serve", damaged, "--listen", "127.0.0.1:0"}), 1, "page 2 of ", "intervale: ");

  std::vector<std::string> tolerant = extract;
  tolerant.emplace_back("--tolerate-damage");
  const auto extracted = run(tolerant);
  EXPECT_EQ(extracted.status, 0);
  EXPECT_THAT(extracted.err, HasSubstr("1 page is damaged: page 2 of "));
  ServerProgram server(damaged, {"--tolerate-damage"});
  const auto fetched = json_of(run({client(), "fetch", server.url() + "/damaged", "--range", "-0.3", "0.2", "--digest", "--json"}));
  EXPECT_EQ(fetched.at("digest"), json_of(extracted).at("digest"));
  std::vector<std::string> of_whole = extract;
  of_whole[2] = whole;
  EXPECT_NE(fetched.at("digest"), json_of(run(of_whole)).at("digest"));
  EXPECT_GT(metric(server.port(), "intervale_lost_updates"), 0);
}

}  // namespace
}  // namespace intervale
