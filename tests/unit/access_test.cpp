#include "server/serve/access.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "server/serve/http_routes.h"
#include "tests/support/temp_dir.h"

namespace intervale {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(Tokens, GrantWhatTheirLineSays) {
  const auto tokens = Tokens::parse("# who may come in\n\nall-0123456789\n some.one~/+=\tengine  scans-* h?ad # mine\r\n").value();
  const auto everything = tokens.find("all-0123456789");
  ASSERT_NE(everything, nullptr);
  EXPECT_TRUE(everything->is_everything());
  EXPECT_TRUE(everything->allows("whatever"));
  const auto some = tokens.find("some.one~/+=");
  ASSERT_NE(some, nullptr);
  EXPECT_FALSE(some->is_everything());
  for (const char* name : {"engine", "scans-", "scans-2024", "head", "hxad"}) EXPECT_TRUE(some->allows(name)) << name;
  for (const char* name : {"", "engines", "my engine", "scans", "had", "heead", "Engine"}) EXPECT_FALSE(some->allows(name)) << name;
}

TEST(Tokens, MatchAsAWholeOnly) {
  const auto tokens = Tokens::parse("secret-token\n").value();
  for (const char* wrong : {"", "secret-toke", "secret-token1", "secret-tokem", "Secret-token", "#", "secret-tokensecret-token"}) {
    EXPECT_EQ(tokens.find(wrong), nullptr) << wrong;
  }
}

TEST(Tokens, PatternsMatchTheWholeName) {
  const Scope scope({"a*b*c", "*-public", "**"});
  EXPECT_TRUE(scope.allows("anything"));
  const Scope some({"a*b*c", "*-public"});
  for (const char* name : {"abc", "axbxc", "abcbc", "aabbcc", "x-public", "-public", "-public-public"}) EXPECT_TRUE(some.allows(name)) << name;
  for (const char* name : {"ab", "abcd", "xabc", "public", "x-publi", "x-public-"}) EXPECT_FALSE(some.allows(name)) << name;
  EXPECT_TRUE(Scope({"engine", "*"}).is_everything());
  EXPECT_FALSE(Scope({std::string(100, '*') + "b"}).allows(std::string(255, 'a')));
}

TEST(Tokens, MalformedFilesAreErrorsThatRevealNoToken) {
  for (const auto& [text, about] : std::vector<std::pair<std::string, std::string>>{{"", "no tokens"},
                                                                                    {"# none\n", "no tokens"},
                                                                                    {"good\nhush-hush!\n", "line 2"},
                                                                                    {"hush-hush\n\nhush-hush x\n", "line 3"},
                                                                                    {std::string(513, 'h'), "line 1"}}) {
    const auto tokens = Tokens::parse(text);
    ASSERT_FALSE(tokens) << text;
    EXPECT_THAT(tokens.error().message, HasSubstr(about));
    EXPECT_THAT(tokens.error().message, Not(HasSubstr("hush")));
  }
  const TempDir folder;
  EXPECT_FALSE(Tokens::load(folder / "nothing"));
  EXPECT_FALSE(Tokens::load(folder.path()));
  EXPECT_FALSE(Tokens::load(folder.file("large", std::string((1 << 20) + 1, '\n'))));
  EXPECT_TRUE(Tokens::load(folder.file("good", "token\n")));
}

TEST(Tokens, AFullFileIsParsedInLinearTime) {
  std::string text;
  for (int i = 0; text.size() < (1 << 20) - 20; ++i) text += std::to_string(i) + " data-" + std::to_string(i) + "\n";
  const auto tokens = Tokens::parse(text);  // in a moment: not each against each
  ASSERT_TRUE(tokens);
  EXPECT_TRUE(tokens->find("40000")->allows("data-40000"));
  EXPECT_FALSE(tokens->find("40000")->allows("data-40001"));
  EXPECT_FALSE(Tokens::parse(text + "40000\n"));
}

TEST(Tokens, AreReadFromAHeaderOrASubprotocol) {
  EXPECT_EQ(token_of("Bearer abc.def", ""), "abc.def");
  EXPECT_EQ(token_of("bearer  abc ", "intervale.v1"), "abc");
  EXPECT_EQ(token_of("", "intervale.v1, intervale.token.YWI"), "ab");
  EXPECT_EQ(token_of("", "intervale.token.YWJjLn5-Lw"), "abc.~~/");
  EXPECT_EQ(token_of("Basic YWJj", "intervale.token.YWJj,intervale.v1"), "abc");
  EXPECT_EQ(token_of("Bearer x", "intervale.token.YWJj"), "x");
  for (const char* header : {"", "Bearer", "Bearer ", "Bearer a b", "Bearer \"a\"", "Basic YWJj", "abc"})
    EXPECT_EQ(token_of(header, ""), std::nullopt) << header;
  for (const char* offered : {"intervale.v1", "intervale.token.", "intervale.token.YWJj=", "intervale.token.YWJ+", "intervale.token.YWJjY",
                              "intervale.token.AA", "Intervale.token.YWJj"}) {
    EXPECT_EQ(token_of("", offered), std::nullopt) << offered;
  }
}

TEST(Origins, AreThoseOfTheHostUnlessToldOtherwise) {
  EXPECT_TRUE(is_allowed_origin("", "a:8080", {})) << "programs send none";
  EXPECT_TRUE(is_allowed_origin("http://a:8080", "a:8080", {}));
  EXPECT_TRUE(is_allowed_origin("https://Example.org", "example.ORG", {}));
  for (const char* origin : {"http://b:8080", "http://a", "http://a:80801", "null", "http://", "ftp://a:8080", "http://a:8080/", "a:8080"}) {
    EXPECT_FALSE(is_allowed_origin(origin, "a:8080", {})) << origin;
  }
  EXPECT_FALSE(is_allowed_origin("http://", "", {}));
  const std::vector<std::string> listed{"https://example.org", "http://b:1"};
  EXPECT_TRUE(is_allowed_origin("https://example.org", "a:8080", listed));
  EXPECT_FALSE(is_allowed_origin("http://example.org", "example.org", listed)) << "what is listed is all";
  EXPECT_TRUE(is_allowed_origin("null", "a", std::vector<std::string>{"*"}));
}

TEST(Routes, ShowWhatOnesTokenOpens) {
  const Catalogue catalogue;
  const Metrics metrics;
  const Memory memory;
  const StaticFiles viewer;
  const HttpState state{.catalogue = catalogue, .metrics = metrics, .memory = memory, .viewer = viewer};
  const Scope some({"engine"});
  const auto status = [&](const char* target, const Scope* scope) {
    return respond({.method = "GET", .target = target, .scope = scope}, state).status;
  };
  for (const Scope* scope : {static_cast<const Scope*>(nullptr), &some, Scope::everything().get()}) {
    for (const char* target : {"/", "/healthz", "/readyz"}) EXPECT_EQ(status(target, scope), 200u) << target;
  }
  for (const char* target : {"/api/datasets", "/metrics"}) EXPECT_EQ(status(target, nullptr), 401u) << target;
  EXPECT_EQ(status("/api/datasets", &some), 200u);
  EXPECT_EQ(status("/metrics", &some), 403u);
  EXPECT_EQ(status("/metrics", Scope::everything().get()), 200u);
}

}  // namespace
}  // namespace intervale
