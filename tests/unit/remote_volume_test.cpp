// Data sets on web servers, read from coarse to fine: each byte once, and with the errors of files that are read whole.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <set>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "client/local/fetch_local.h"
#include "common/ivm/ivm_file.h"
#include "common/ivm/load_volume.h"
#include "common/ivm/value_file.h"
#include "common/mesh/mesh_digest.h"
#include "common/parallel/all_cores.h"
#include "common/remote/load_remote.h"
#include "server/builder/value_builder.h"
#include "tests/support/analytic_fields.h"
#include "tests/support/file_server.h"
#include "tests/support/interval_volumes.h"
#include "tests/support/seeds.h"
#include "tests/support/value_fields.h"

namespace intervale::remote_volumes {
namespace {

using ::testing::AllOf;
using testing::FileAnswer, testing::FileRequest, testing::FileServer;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;
using SharedVolume = std::shared_ptr<const IntervalVolume>;

constexpr std::size_t kFirst = 64 << 10;

std::string text_of_bytes(const std::vector<std::byte>& bytes) { return {reinterpret_cast<const char*>(bytes.data()), bytes.size()}; }

std::string file_of(const std::array<std::int32_t, 3>& dims, unsigned seed) {
  Volume volume = testing::random_value_field(dims, seed).volume;
  return text_of_bytes(encode_values(build_value_volume(volume, testing::random_value_field(dims, seed).format), on_all_cores));
}
// One scale can be had before all of it.
const std::string& contents() {
  static const std::string bytes = file_of({134, 70, 66}, 1);
  return bytes;
}
SharedVolume whole(const std::string& file) {
  return std::make_shared<const IntervalVolume>(decode_volume(std::as_bytes(std::span(file)), "scan", on_all_cores).value());
}

RemoteLimits hasty() {
  RemoteLimits limits;
  limits.connections = 3;
  limits.range_bytes = 256 << 10;
  limits.attempts = 3;
  limits.first_pause = std::chrono::milliseconds(1);
  limits.idle_time = std::chrono::seconds(1);
  return limits;
}

// What is read one after the other, to the end.
Result<std::vector<SharedVolume>> read_all(const std::string& address, const RemoteLimits& limits = hasty()) {
  const RemoteUrl url = parse_remote_url(address).value();
  const RemoteAccess access;
  RemoteVolume file(url, access, limits);
  std::vector<SharedVolume> all;
  do {
    auto next = file.next(on_all_cores);
    if (!next) return tl::unexpected(next.error());
    all.push_back(*std::move(next));
  } while (!all.back()->is_whole());
  return all;
}

// The ranges that were asked for, from the first to the end of each; all, without that, from servers that know none.
std::vector<std::pair<std::size_t, std::size_t>> ranges_of(const FileServer& server, std::size_t file_bytes) {
  std::vector<std::pair<std::size_t, std::size_t>> ranges;
  for (const FileRequest& request : server.requests()) {
    const std::string range = request.header("range");
    ranges.emplace_back(std::stoul(range.substr(6)), std::min(std::stoul(range.substr(range.find('-') + 1)) + 1, file_bytes));
  }
  return ranges;
}

void expect_same(const IntervalVolume& one, const IntervalVolume& other) {
  EXPECT_EQ(one.description(), other.description());
  ASSERT_EQ(one.size(), other.size());
  for (UpdateIndex i{0}; i < one.size(); ++i) ASSERT_TRUE(one.key(i) == other.key(i) && one.error(i) == other.error(i));
}

TEST(RemoteVolume, GrowsFromCoarseToFineAndReadsEachByteOnce) {
  const std::string file = file_of({134, 130, 129}, 1);  // two scales can be had before all of it
  const FileServer server(file);
  const auto read = read_all(server.url());
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_EQ(read->size(), 3U);
  for (std::size_t i = 0; i + 1 < read->size(); ++i) {
    EXPECT_FALSE((*read)[i]->is_whole());
    EXPECT_LT((*read)[i]->size(), (*read)[i + 1]->size());
    EXPECT_EQ((*read)[i]->description(), read->back()->description());
  }
  expect_same(*read->back(), *whole(file));
  auto ranges = ranges_of(server, file.size());
  EXPECT_LE(ranges.size(), file.size() / kFirst);
  for (std::size_t i = 1; i < ranges.size(); ++i) EXPECT_EQ(server.requests()[i].header("if-match"), "\"one\"");
  std::sort(ranges.begin(), ranges.end());
  std::size_t next = 0;
  for (const auto& [first, end] : ranges) {
    EXPECT_EQ(first, next);
    next = end;
  }
  EXPECT_EQ(next, file.size());
  EXPECT_LE(server.most_connections(), hasty().connections);
}

TEST(RemoteVolume, TellsHowMuchItHasRead) {
  const FileServer server(contents());
  const RemoteUrl url = parse_remote_url(server.url()).value();
  const RemoteAccess access;
  const RemoteLimits limits = hasty();
  RemoteVolume file(url, access, limits);
  EXPECT_EQ(file.file_bytes(), 0U);
  ASSERT_TRUE(file.next());
  EXPECT_EQ(file.file_bytes(), contents().size());
  std::size_t asked = 0;
  for (const auto& [first, end] : ranges_of(server, contents().size())) asked += end - first;
  EXPECT_EQ(file.read_bytes(), asked);
  EXPECT_LT(asked, contents().size() / 4);
  EXPECT_EQ(file.requests(), server.requests().size());
  const auto all = file.whole(on_all_cores);
  ASSERT_TRUE(all && (*all)->is_whole());
  EXPECT_EQ(file.read_bytes(), contents().size());
  EXPECT_EQ(file.requests(), server.requests().size());
}

// A ramp along x: pages lie side by side, and a narrow range needs one or two.
TEST(RemoteVolume, ReadsOnlyThePagesThatRangesNeed) {
  constexpr std::array<std::int32_t, 3> kDims{260, 66, 66};
  std::vector<float> samples;
  samples.reserve(std::size_t(kDims[0]) * kDims[1] * kDims[2]);
  for (int i = 0; i < kDims[0] * kDims[1] * kDims[2]; ++i) samples.push_back(float(i % kDims[0]) + float(i % 7) / 8);
  Volume volume = testing::volume_of_type(SampleType::f32, kDims, samples);
  const std::string file = text_of_bytes(encode_values(build_value_volume(volume, testing::value_field(volume, 0.125).format), on_all_cores));
  const SharedVolume all = whole(file);
  const RemoteAccess access;
  const RemoteLimits limits = hasty();
  FetchOptions options;
  options.shown = {{{20, 30}}, {}};
  for (const bool has_camera : {false, true}) {
    if (has_camera) {
      options.lod.camera = Camera{};
      options.lod.camera->eye = {-100, 30, 30};
      options.lod.camera->look_at = {20, 30, 30};
      options.lod.camera->pixel_error = 2;
    }
    const FileServer server(file);
    const RemoteUrl url = parse_remote_url(server.url()).value();
    RemoteVolume remote(url, access, limits, asked_for(options.shown, Refine::boundary));
    const NextVolume next = [&](ReadOn how, const ParallelFor& parallel) {
      return how == ReadOn::all ? remote.whole(parallel) : remote.next(parallel);
    };
    const auto fetched = fetch_growing(next, options, {}, on_all_cores);
    ASSERT_TRUE(fetched) << fetched.error().message;
    const auto local = fetch_local(all, options, {});
    ASSERT_TRUE(local);
    EXPECT_EQ(mesh_digest(fetched->client.meshes()[0]), mesh_digest(local->client.meshes()[0]));
    EXPECT_LT(remote.read_bytes(), file.size() * 3 / 4);
    EXPECT_EQ(remote.requests(), server.requests().size());
  }
  const FileServer server(file);
  const RemoteUrl url = parse_remote_url(server.url()).value();
  const auto extracted = load_remote_volume(url, access, asked_for(options.shown, Refine::boundary), on_all_cores);
  ASSERT_TRUE(extracted) << extracted.error().message;
  std::size_t asked = 0;
  for (const auto& [first, end] : ranges_of(server, file.size())) asked += end - first;
  EXPECT_LT(asked, file.size() * 3 / 4);
}

TEST(RemoteSummary, NeedsNoPages) {
  const FileServer server(contents());
  const RemoteUrl url = parse_remote_url(server.url()).value();
  const auto summary = load_remote_summary(url, {}, on_all_cores);
  ASSERT_TRUE(summary && *summary) << summary.error().message;
  EXPECT_EQ(**summary, summary_of(decode_values(std::as_bytes(std::span(contents())), url.name, on_all_cores).value(), contents().size()));
  EXPECT_EQ(server.requests().size(), 2U);
  std::size_t asked = 0;
  for (const auto& [first, end] : ranges_of(server, contents().size())) asked += end - first;
  EXPECT_LT(asked, 2 * kFirst);
  const std::string one = text_of_bytes(encode_ivm(testing::build(testing::digits({9, 7, 5}, 1), {{2, 5}, Refine::boundary})));
  const FileServer of_one(one);
  const auto none = load_remote_summary(parse_remote_url(of_one.url()).value(), {}, on_all_cores);
  EXPECT_TRUE(none && !*none);
  const FileServer text("no data set");
  const auto refused = load_remote_summary(parse_remote_url(text.url()).value(), {}, on_all_cores);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, AllOf(StartsWith(text.url()), HasSubstr("not an interval volume file")));
}

TEST(RemoteVolume, OthersAreReadWhole) {
  const auto expect_at_once = [](const FileServer& server) {
    const auto read = read_all(server.url());
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(read->size(), 1U);
  };
  expect_at_once(FileServer(file_of({20, 21, 22}, 1)));
  FileServer server(contents());
  server.misbehave([](const FileRequest&, std::size_t, FileAnswer& answer) { answer = {.body = contents()}; });
  expect_at_once(server);
  EXPECT_EQ(server.requests().size(), 1U);
  RemoteLimits narrow = hasty();  // what follows the pages takes more than one request
  narrow.range_bytes = 200;
  narrow.connections = 1;
  const std::string small = file_of({70, 50, 36}, 0);
  const FileServer other(small);
  const auto read = read_all(other.url(), narrow);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->size(), 1U);
  const auto ranges = ranges_of(other, small.size());
  EXPECT_TRUE(std::is_sorted(ranges.begin(), ranges.end()));
}

TEST(RemoteVolume, TriesAgainAfterWhatMayPassAndEndsInOneLineOtherwise) {
  FileServer server(contents());
  server.misbehave([tried = std::set<std::string>()](const FileRequest& request, std::size_t, FileAnswer& answer) mutable {
    if (tried.insert(request.header("range")).second) answer.cut_after = answer.body.size() / 2;
  });
  const auto read = read_all(server.url());
  ASSERT_TRUE(read) << read.error().message;
  expect_same(*read->back(), *whole(contents()));
  for (std::size_t lie = 0; lie < 6; ++lie) {
    for (std::size_t from = 0; from < 6; ++from) {
      FileServer other(contents());
      other.misbehave([lie, from](const FileRequest&, std::size_t number, FileAnswer& answer) {
        if (number < from) return;
        if (lie == 0) answer = {.status = 404};
        if (lie == 1) answer.body[answer.body.size() / 2] ^= 1;
        if (lie == 2) answer.body.pop_back();
        if (lie == 3) answer.body += 'x';
        if (lie == 4) answer.headers.emplace_back("Content-Encoding", "gzip");
        if (lie == 5) answer.headers.pop_back();
      });
      const auto refused = read_all(other.url());
      ASSERT_FALSE(refused) << lie << " " << from;
      EXPECT_THAT(refused.error().message, AllOf(StartsWith("http://127.0.0.1:"), Not(HasSubstr("\n"))));
    }
  }
  RemoteLimits small = hasty();
  small.most_bytes = contents().size() - 1;
  const FileServer large(contents());
  EXPECT_THAT(read_all(large.url(), small).error().message, HasSubstr("there is room for"));
  EXPECT_EQ(large.requests().size(), 1U);
}

// The file changes after any of the requests; a stream that has begun starts again.
TEST(RemoteVolume, AFileThatChangesIsReadAgain) {
  const std::string other = file_of({130, 72, 66}, 1);
  FetchOptions options;
  options.shown.ranges = {{1.3, 1.5}};
  const auto wanted = fetch_local(whole(other), options, {});
  ASSERT_TRUE(wanted);
  constexpr std::array<std::size_t, 2> kFrom{4, 1};
  for (const std::size_t from : std::span(kFrom).first(testing::cases(kFrom.size()))) {
    FileServer server(contents());
    server.misbehave([from, has = false](const FileRequest& request, std::size_t number, FileAnswer& answer) mutable {
      if (number >= from && !request.header("if-match").empty() && !std::exchange(has, true)) answer = {.status = 412};
    });
    const RemoteUrl url = parse_remote_url(server.url()).value();
    const RemoteAccess access;
    const RemoteLimits limits = hasty();
    RemoteVolume file(url, access, limits);
    std::size_t notices = 0;
    bool is_other = false;
    const auto next = [&](ReadOn, const ParallelFor& parallel) {
      auto read = file.next(parallel);
      if (!std::exchange(is_other, true)) server.set(other, "\"two\"");
      return read;
    };
    const auto fetched = fetch_growing(next, options, {.on_batch = {}, .on_notice = [&](const std::string&) { ++notices; }}, on_all_cores);
    ASSERT_TRUE(fetched) << fetched.error().message;
    EXPECT_EQ(mesh_digest(fetched->client.mesh()), mesh_digest(wanted->client.mesh()));
    EXPECT_EQ(notices, 1U);
  }
  FileServer restless(contents());
  restless.misbehave([](const FileRequest& request, std::size_t number, FileAnswer& answer) {
    if (number % 4 == 3 && !request.header("if-match").empty()) answer = {.status = 412};
  });
  EXPECT_THAT(read_all(restless.url()).error().message, HasSubstr("changes while it is read"));
}

TEST(RemoteVolume, AnErrorWhileAStreamRunsEndsIt) {
  std::atomic<std::size_t> batches{0};
  FileServer server(contents());
  server.misbehave([&batches](const FileRequest&, std::size_t number, FileAnswer& answer) {
    if (number < 4) return;  // what the coarse scale needs
    for (int ms = 0; ms < 10'000 && batches == 0; ++ms) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    answer = {.status = 404};
  });
  const RemoteUrl url = parse_remote_url(server.url()).value();
  const RemoteAccess access;
  const RemoteLimits limits = hasty();
  RemoteVolume file(url, access, limits);
  FetchOptions options;
  options.shown.ranges = {{0.2, 1}};
  const FetchEvents events{.on_batch = [&](const StreamClient&, const FetchStats&) { ++batches; }, .on_notice = {}};
  const auto fetched = fetch_growing([&](ReadOn, const ParallelFor& parallel) { return file.next(parallel); }, options, events, serial);
  ASSERT_FALSE(fetched);
  EXPECT_THAT(fetched.error().message, HasSubstr("404"));
  EXPECT_GT(batches, 0U) << "the first mesh is there before";
  // Nor does a stream that ends early wait for what is read.
  const FileServer hanging(contents());
  options.channels = {"none"};
  const RemoteUrl slow = parse_remote_url(hanging.url()).value();
  RemoteVolume again(slow, access, limits);
  EXPECT_THAT(fetch_growing([&](ReadOn, const ParallelFor& parallel) { return again.next(parallel); }, options, {}, serial).error().message,
              HasSubstr("none"));
}

}  // namespace
}  // namespace intervale::remote_volumes
