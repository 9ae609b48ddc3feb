// Files on web servers, honest ones and others. What any server answers ends in the bytes of one state of the file, or in
// one line.
#include "common/remote/read_remote.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <functional>
#include <random>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "common/ivm/ivm_container.h"
#include "tests/support/file_server.h"

namespace intervale::read_remotes {
namespace {

using ::testing::AllOf;
using testing::FileAnswer, testing::FileRequest, testing::FileServer;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

constexpr std::size_t kFirst = 64 << 10;

// A file whose header is in order; nobody looks at the rest.
std::string container(std::size_t pages, unsigned seed) {
  Streams streams;
  std::minstd_rand random(seed);
  streams[StreamType::pages].resize(pages);
  for (std::byte& byte : streams[StreamType::pages]) byte = std::byte(random());
  const auto bytes = make_container(FileScope::every_range, streams);
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}
const std::string& contents() {
  static const std::string bytes = container(300'000, 1);
  return bytes;
}

RemoteLimits hasty() {
  RemoteLimits limits;
  limits.connections = 3;
  limits.range_bytes = 32 << 10;
  limits.attempts = 4;
  limits.first_pause = std::chrono::milliseconds(1);
  limits.most_pause = std::chrono::seconds(2);
  limits.connect_time = std::chrono::seconds(5);
  limits.idle_time = std::chrono::seconds(1);
  return limits;
}

Result<std::string> read(const std::string& url, const RemoteAccess& access = {}, const RemoteLimits& limits = hasty()) {
  const auto contents = read_remote(parse_remote_url(url).value(), access, limits);
  if (!contents) return tl::unexpected(contents.error());
  return std::string(reinterpret_cast<const char*>(contents->bytes.data()), contents->bytes.size());
}

void expect_whole(const std::string& url, const std::string& whole = contents()) {
  const auto got = read(url);
  ASSERT_TRUE(got) << got.error().message;
  EXPECT_TRUE(*got == whole);
}

// The error, which begins with the URL.
std::string complaint(const FileServer& server, const RemoteLimits& limits = hasty()) {
  const auto got = read(server.url(), {}, limits);
  if (got) return "no error";
  EXPECT_THAT(got.error().message, AllOf(StartsWith("http://127.0.0.1:"), Not(HasSubstr("\n"))));
  return got.error().message;
}

TEST(ReadRemote, ReadsRangesOverAFewConnections) {
  const FileServer server(contents());
  expect_whole(server.url());
  const auto requests = server.requests();
  EXPECT_EQ(requests.size(), 1 + (contents().size() - kFirst + hasty().range_bytes - 1) / hasty().range_bytes);
  EXPECT_EQ(requests[0].header("range"), "bytes=0-65535");
  EXPECT_EQ(requests[0].header("if-match"), "");
  for (std::size_t i = 1; i < requests.size(); ++i) EXPECT_EQ(requests[i].header("if-match"), "\"one\"");
  EXPECT_LE(server.most_connections(), hasty().connections);
}

TEST(ReadRemote, FilesOfAnySizeArrive) {
  for (const std::size_t pages : {std::size_t(0), std::size_t(1), kFirst - 1000, kFirst, kFirst + 1, kFirst + (32 << 10)}) {
    const std::string whole = container(pages, 2);
    const FileServer server(whole);
    expect_whole(server.url(), whole);
  }
}

TEST(ReadRemote, AServerWithoutRangesSendsAllOfIt) {
  FileServer server(contents());
  for (const bool has_length : {true, false}) {
    server.misbehave(
        [has_length](const FileRequest&, std::size_t, FileAnswer& answer) { answer = {.body = contents(), .has_content_length = has_length}; });
    const std::size_t before = server.requests().size();
    expect_whole(server.url());
    EXPECT_EQ(server.requests().size(), before + 1);
  }
}

TEST(ReadRemote, TriesAgainAfterWhatMayPass) {
  FileServer server(contents());
  const std::vector<std::function<void(FileAnswer&)>> troubles{
      [](FileAnswer& answer) { answer = {.status = 503}; },
      [](FileAnswer& answer) {
        answer = {.status = 429, .headers = {{"Retry-After", "1"}}};
      },
      [](FileAnswer& answer) { answer.cut_after = answer.body.size() / 2; },
      [](FileAnswer& answer) { answer.cut_after = 0; },
  };
  for (std::size_t i = 0; i < troubles.size(); ++i) {
    SCOPED_TRACE(i);
    const bool once = i == 1;  // it pauses for a second
    server.misbehave([&, tried = std::set<std::string>()](const FileRequest& request, std::size_t, FileAnswer& answer) mutable {
      if ((once && !tried.empty()) || !tried.insert(request.header("range")).second) return;
      troubles[i](answer);
    });
    expect_whole(server.url());
  }
}

TEST(ReadRemote, GivesUpAfterItsAttempts) {
  FileServer server(contents());
  server.misbehave([](const FileRequest&, std::size_t, FileAnswer& answer) { answer = {.status = 500}; });
  EXPECT_THAT(complaint(server), AllOf(HasSubstr("500"), HasSubstr("after 4 attempts")));
  EXPECT_EQ(server.requests().size(), 4u);
  server.misbehave([](const FileRequest&, std::size_t, FileAnswer& answer) { answer = {.status = 503, .headers = {{"Retry-After", "1000"}}}; });
  EXPECT_THAT(complaint(server), AllOf(HasSubstr("503"), HasSubstr("1000 s")));
  EXPECT_EQ(server.requests().size(), 5u);
  std::string gone;
  {
    const FileServer other(contents());
    gone = other.url();
  }
  EXPECT_THAT(read(gone).error().message, HasSubstr("after 4 attempts"));
}

TEST(ReadRemote, ASilentServerIsLeft) {
  FileServer server(contents());
  server.misbehave([](const FileRequest&, std::size_t number, FileAnswer& answer) { answer.hangs = number == 0 || number == 3; });
  expect_whole(server.url());
  server.misbehave([](const FileRequest&, std::size_t, FileAnswer& answer) { answer.hangs = true; });
  RemoteLimits once = hasty();
  once.attempts = 1;
  EXPECT_THAT(complaint(server, once), Not(HasSubstr("no error")));
}

TEST(ReadRemote, DoesNotTryAgainWhatWillNotPass) {
  FileServer server(contents());
  for (const unsigned status : {400u, 401u, 403u, 404u, 410u, 416u, 204u, 304u}) {
    const std::size_t before = server.requests().size();
    server.misbehave([status](const FileRequest&, std::size_t, FileAnswer& answer) {
      answer = {.status = status, .has_content_length = status != 204 && status != 304};
    });
    EXPECT_NE(complaint(server), "no error") << status;
    EXPECT_EQ(server.requests().size(), before + 1) << status;
  }
}

TEST(ReadRemote, AFileThatChangesIsReadAgain) {
  const std::string other = container(300'000, 7);
  const std::string longer = container(310'000, 7);
  for (const std::string& changed : {other, longer}) {
    FileServer server(contents());
    server.misbehave([&](const FileRequest&, std::size_t number, FileAnswer& answer) {
      // What an honest server says of the third request, once the file is another.
      if (number == 2) answer = {.status = 412};
    });
    expect_whole(server.url());
    // A server that does not know If-Match tells the state with each answer.
    server.misbehave([&, first = server.requests().size()](const FileRequest& request, std::size_t number, FileAnswer& answer) {
      if (number < first + 2) return;
      answer.status = 206;
      const std::size_t begin = std::stoul(request.header("range").substr(6));
      answer.body = changed.substr(begin, std::min<std::size_t>(begin == 0 ? kFirst : hasty().range_bytes, changed.size() - begin));
      answer.headers = {{"ETag", "\"two\""},
                        {"Content-Range", "bytes " + std::to_string(begin) + "-" + std::to_string(begin + answer.body.size() - 1) + "/" +
                                              std::to_string(changed.size())}};
    });
    expect_whole(server.url(), changed);
  }
  FileServer restless(contents());
  restless.misbehave([](const FileRequest&, std::size_t number, FileAnswer& answer) {
    for (auto& [name, value] : answer.headers) {
      if (name == "ETag") value = "\"" + std::to_string(number) + "\"";
    }
    if (answer.status == 412) answer.headers = {};
  });
  EXPECT_THAT(complaint(restless), HasSubstr("changes while it is read"));
}

struct Lie {
  const char* name;
  std::function<void(const FileRequest&, std::size_t number, FileAnswer& answer)> tell;
};

void set_range(FileAnswer& answer, const std::string& value) {
  for (auto& [name, old] : answer.headers) {
    if (name == "Content-Range") old = value;
  }
}

TEST(ReadRemote, RefusesAnswersThatLie) {
  const std::string size = std::to_string(contents().size());
  const std::vector<Lie> lies{
      {"the first range is another", [&](auto&, std::size_t, FileAnswer& a) { set_range(a, "bytes 1-65536/" + size); }},
      {"the first range is shorter", [&](auto&, std::size_t, FileAnswer& a) { set_range(a, "bytes 0-99/" + size); }},
      {"no length of the file", [](auto&, std::size_t, FileAnswer& a) { set_range(a, "bytes 0-65535/*"); }},
      {"no Content-Range", [](auto&, std::size_t, FileAnswer& a) { a.headers.clear(); }},
      {"two of them", [](auto&, std::size_t, FileAnswer& a) { a.headers.push_back(a.headers.back()); }},
      {"a later range is another",
       [&](auto&, std::size_t n, FileAnswer& a) {
         if (n == 2) set_range(a, "bytes 0-32767/" + size);
       }},
      {"the first body is short", [](auto&, std::size_t, FileAnswer& a) { a.body.resize(5000); }},
      {"a later body is short",
       [](auto&, std::size_t n, FileAnswer& a) {
         if (n == 2) a.body.resize(100);
       }},
      {"the first body is long", [](auto&, std::size_t, FileAnswer& a) { a.body += "more"; }},
      {"a later body is long",
       [](auto&, std::size_t n, FileAnswer& a) {
         if (n == 2) a.body += "more";
       }},
      {"compressed", [](auto&, std::size_t, FileAnswer& a) { a.headers.emplace_back("Content-Encoding", "gzip"); }},
      {"a file of another length",
       [&](auto&, std::size_t, FileAnswer& a) { set_range(a, "bytes 0-65535/" + std::to_string(contents().size() + 1)); }},
      {"an enormous file", [&](auto&, std::size_t, FileAnswer& a) { set_range(a, "bytes 0-65535/18446744073709551615"); }},
      {"an enormous file, whole", [](auto&, std::size_t, FileAnswer& a) { a = {.body = contents(), .content_length = std::size_t(1) << 62}; }},
      {"less than all", [](auto&, std::size_t, FileAnswer& a) { a = {.body = contents().substr(0, 100'000), .has_content_length = false}; }},
      {"more than all", [](auto&, std::size_t, FileAnswer& a) { a = {.body = contents() + "x", .has_content_length = false}; }},
      {"nothing", [](auto&, std::size_t, FileAnswer& a) { a = {}; }},
      {"another file", [](auto&, std::size_t, FileAnswer& a) { a = {.body = "<!doctype html>" + std::string(100'000, ' ')}; }},
      {"another file, in ranges", [](auto&, std::size_t, FileAnswer& a) { a.body[0] = 'x'; }},
      {"a damaged header", [](auto&, std::size_t, FileAnswer& a) { a.body[9] ^= 1; }},
      {"the beginning of one", [](auto&, std::size_t, FileAnswer& a) { a = {.body = contents().substr(0, 30), .has_content_length = false}; }},
  };
  for (const Lie& lie : lies) {
    SCOPED_TRACE(lie.name);
    FileServer server(contents());
    server.misbehave(lie.tell);
    EXPECT_NE(complaint(server), "no error");
    // Requests that were on their way when the lie was told are answered; none is made a second time.
    std::set<std::string> asked;
    for (const FileRequest& request : server.requests()) {
      EXPECT_TRUE(asked.insert(request.header("range")).second) << request.header("range") << " is asked for again";
    }
  }
}

TEST(ReadRemote, FetchesNothingMoreOfAFileThatIsTooLarge) {
  const FileServer server(contents());
  RemoteLimits small = hasty();
  small.most_bytes = 100'000;
  EXPECT_THAT(complaint(server, small), HasSubstr("room for 100000"));
  EXPECT_EQ(server.requests().size(), 1u);
}

TEST(ReadRemote, CredentialsGoToTheNamedOriginOnly) {
  ::setenv("INTERVALE_TOKEN", "the-token", 1);
  const FileServer target(contents());
  FileServer named(contents());
  named.misbehave([&](const FileRequest& request, std::size_t, FileAnswer& answer) {
    if (request.target == "/near.ivm") answer = {.status = 302, .headers = {{"Location", "/scan.ivm"}}};
    if (request.target == "/far.ivm") answer = {.status = 307, .headers = {{"Location", target.url("/elsewhere?x=1")}}};
  });
  const RemoteAccess access{{"Authorization: Bearer secret", "X-Key: secret"}, AwsSigning{"eu-west-1", "AKID", "hidden", "session"}, {}};
  for (const char* path : {"/near.ivm", "/far.ivm"}) ASSERT_TRUE(read(named.url(path), access)) << path;
  for (const FileRequest& request : named.requests()) {
    EXPECT_EQ(request.header("x-key"), "secret");
    EXPECT_EQ(request.header("x-amz-security-token"), "session");
  }
  ASSERT_GT(target.requests().size(), 1u);
  for (const FileRequest& request : target.requests()) {
    EXPECT_THAT(request.target, "/elsewhere?x=1");
    for (const auto& [name, value] : request.headers) {
      EXPECT_THAT(value, AllOf(Not(HasSubstr("secret")), Not(HasSubstr("AKID")), Not(HasSubstr("session")), Not(HasSubstr("the-token")))) << name;
    }
  }
  for (const FileRequest& request : named.requests()) {
    for (const auto& [name, value] : request.headers) EXPECT_THAT(value, AllOf(Not(HasSubstr("hidden")), Not(HasSubstr("the-token")))) << name;
  }
  ::unsetenv("INTERVALE_TOKEN");
}

TEST(ReadRemote, SignsRequestsForS3) {
  const FileServer server(contents());
  ASSERT_TRUE(read(server.url(), {{}, AwsSigning{"eu-west-1", "AKID", "hidden", ""}, {}}));
  for (const FileRequest& request : server.requests()) {
    EXPECT_THAT(request.header("authorization"), AllOf(StartsWith("AWS4-HMAC-SHA256 Credential=AKID/"), HasSubstr("/eu-west-1/s3/aws4_request"),
                                                       HasSubstr("x-amz-date"), HasSubstr("Signature=")));
    EXPECT_THAT(request.header("x-amz-content-sha256"), StartsWith("e3b0c442")) << "of no body";
    EXPECT_EQ(request.header("x-amz-security-token"), "");
  }
}

TEST(ReadRemote, FollowsFiveRedirects) {
  FileServer server(contents());
  server.misbehave([](const FileRequest& request, std::size_t, FileAnswer& answer) {
    const std::size_t left = std::stoul(request.target.substr(1));
    if (left > 0) answer = {.status = 301, .headers = {{"Location", "/" + std::to_string(left - 1)}}};
  });
  expect_whole(server.url("/5"));
  EXPECT_THAT(read(server.url("/6")).error().message, HasSubstr("redirects more than 5 times"));
  server.misbehave([](const FileRequest&, std::size_t, FileAnswer& answer) { answer = {.status = 302}; });
  EXPECT_THAT(complaint(server), HasSubstr("nowhere"));
  server.misbehave([](const FileRequest&, std::size_t, FileAnswer& answer) {
    answer = {.status = 302, .headers = {{"Location", "file:///etc/passwd"}}};
  });
  EXPECT_THAT(complaint(server), HasSubstr("invalid URL"));
}

TEST(ReadRemote, IsReadAgainOnlyOnceItHasChanged) {
  for (const bool knows_conditions : {true, false}) {
    FileServer server(contents());
    if (!knows_conditions) {
      server.misbehave([&](const FileRequest&, std::size_t, FileAnswer& answer) {
        if (answer.status == 304) answer = {.headers = {{"ETag", "\"one\""}}, .body = contents()};
      });
    }
    const auto url = parse_remote_url(server.url()).value();
    const auto first = read_remote(url, {}, hasty());
    ASSERT_TRUE(first);
    ASSERT_TRUE(first->stamp.is_known());
    const std::size_t before = server.requests().size();
    const auto same = read_remote_if_changed(url, {}, hasty(), first->stamp);
    ASSERT_TRUE(same) << same.error().message;
    EXPECT_FALSE(*same);
    EXPECT_EQ(server.requests().size(), before + 1);
    const std::string other = container(310'000, 3);
    server.set(other, "\"two\"");
    const auto changed = read_remote_if_changed(url, {}, hasty(), first->stamp);
    ASSERT_TRUE(changed) << changed.error().message;
    ASSERT_TRUE(*changed);
    EXPECT_EQ((*changed)->bytes.size(), other.size());
  }
}

TEST(ReadRemote, WeakTagsAreComparedHere) {
  const FileServer server(contents(), "W/\"one\"");
  expect_whole(server.url());
  for (const FileRequest& request : server.requests()) EXPECT_EQ(request.header("if-match"), "");
  const FileServer without(contents(), "");
  expect_whole(without.url());
}

TEST(ReadRemote, MayBeStopped) {
  FileServer server(contents());
  server.misbehave([](const FileRequest&, std::size_t number, FileAnswer& answer) { answer.hangs = number > 0; });
  int calls = 0;
  const ParallelFor stops = [&calls](std::size_t, const auto&) {
    if (++calls == 5) throw std::runtime_error("stopped");
  };
  EXPECT_THROW((void)read_remote(parse_remote_url(server.url()).value(), {}, hasty(), stops), std::runtime_error);
}

}  // namespace
}  // namespace intervale::read_remotes
