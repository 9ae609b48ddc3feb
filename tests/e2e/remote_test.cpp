// Data sets that are files on web servers: the programs do with them what they do with files.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "tests/support/complaints.h"
#include "tests/support/file_server.h"
#include "tests/support/programs.h"
#include "tests/support/seeds.h"
#include "tests/support/serving.h"
#include "tests/support/temp_dir.h"

namespace intervale::remote_files {
namespace {

using ::testing::AllOf;
using testing::FileAnswer, testing::FileRequest, testing::FileServer;
using ::testing::HasSubstr;
using ::testing::Not;

const std::vector<std::vector<std::string>>& views() {
  static const std::vector<std::vector<std::string>> all{
      {}, {"--error-percent", "5"}, {"--eye", "0", "0.5", "3", "--look-at", "0", "0", "0", "--pixel-error", "2"}};
  return all;
}

std::string digest_of(const Arguments& command, const Arguments& view) {
  return json_of(run(command + view + Arguments{"--digest", "--json"})).value("digest", "");
}

TEST(Remote, AFileOnAWebServerIsServedAndFetchedAsALocalOne) {
  const FileServer web(contents_of(buckyball()));
  const ServerProgram local, remote(web.url("/scans/buckyball.ivm"));
  for (const auto& view : views()) {
    const std::string wanted = digest_of({program("intervale-client"), "fetch", local.url("buckyball")}, view);
    EXPECT_NE(wanted, "");
    EXPECT_EQ(digest_of({program("intervale-client"), "fetch", remote.url("buckyball")}, view), wanted);
    EXPECT_EQ(digest_of({program("intervale-client"), "fetch", web.url("/buckyball.ivm")}, view), wanted);
  }
  EXPECT_EQ(digest_of({program("intervale"), "extract", web.url()}, {}), digest_of({program("intervale"), "extract", buckyball()}, {}));
}

TEST(Remote, InfoAndVerifyTellWhatTheyTellOfALocalFile) {
  const TempDir folder;
  const std::string volume = folder / "small.nrrd", every = folder / "scan.ivm";
  ASSERT_EQ(run({program("intervale"), "sample", "buckyball", "--size", "33", "-o", volume}).status, 0);
  ASSERT_EQ(run({program("intervale"), "build", volume, "-o", every}).status, 0);
  for (const std::string& file : {buckyball().string(), every}) {
    const FileServer web(contents_of(file));
    const std::string name = std::filesystem::path(file).filename(), url = web.url("/scans/" + name + "?signature=secret");
    for (const Arguments& more : {Arguments{}, {"--json"}, {"--range", "128", "188"}}) {
      const Finished local = run(Arguments{program("intervale"), "info", file} + more),
                     remote = run(Arguments{program("intervale"), "info", url} + more);
      EXPECT_EQ(remote.status, 0) << remote.err;
      EXPECT_EQ(remote.out, local.out);
    }
    const auto verified = json_of(run({program("intervale"), "verify", url, "--json"}));
    EXPECT_EQ(verified.at("file"), web.url("/scans/" + name));
    EXPECT_EQ(verified.at("updates"), json_of(run({program("intervale"), "verify", file, "--json"})).at("updates"));
    EXPECT_THAT(run({program("intervale"), "verify", url}).out, AllOf(HasSubstr("all checksums"), Not(HasSubstr("secret"))));
  }
}

TEST(Remote, InfoAndVerifySendHeadersAndRefuseInOneLine) {
  FileServer web(contents_of(buckyball()));
  web.misbehave([](const FileRequest& request, std::size_t, FileAnswer& answer) {
    if (request.header("authorization") != "Bearer of-the-file") answer = {.status = 401};
  });
  const TempDir folder;
  const std::string headers = folder.file("headers", "Authorization: Bearer of-the-file\n").string();
  std::string damaged = contents_of(buckyball());
  damaged[damaged.size() / 2] ^= 1;
  const FileServer broken(damaged), page("<!doctype html>" + std::string(1 << 20, ' '));
  for (const std::string command : {"info", "verify"}) {
    const Arguments begin{program("intervale"), command};
    expect_complaint(run(begin + Arguments{web.url()}), 1, "401", "intervale: ");
    json_of(run(begin + Arguments{web.url(), "--json", "--header-file", headers}));
    expect_complaint(run(begin + Arguments{broken.url("/x.ivm?secret")}), 1, broken.url("/x.ivm: "), "intervale: ");
    expect_complaint(run(begin + Arguments{page.url("/volume.nrrd")}), 1, page.url("/volume.nrrd: not an interval volume"), "intervale: ");
    expect_complaint(run(begin + Arguments{"http://localhost/"}), 2, "invalid URL", "intervale: ");
    expect_complaint(run({"/usr/bin/env", "-u", "AWS_ACCESS_KEY_ID", program("intervale"), command, web.url(), "--aws-sign"}), 2, "AWS_ACCESS_KEY_ID",
                     "intervale: ");
  }
  for (const FileRequest& request : page.requests()) EXPECT_EQ(request.header("range"), "bytes=0-65535");
  EXPECT_EQ(page.requests().size(), 2U);
  expect_complaint(run({program("intervale"), "info", web.url(), "--part", "one"}), 2, "--part", "intervale: ");
}

// The first mesh is there after two round trips; each byte is read once, and none that the error does not need.
TEST(Remote, FetchReadsCoarseScalesFirstAndNoFinerOnesThanItNeeds) {
  const TempDir folder;
  const std::string volume = folder / "gyroid.nrrd", file = folder / "gyroid.ivm";
  ASSERT_EQ(run({program("intervale"), "sample", "gyroid", "--size", "129", "-o", volume}).status, 0);
  ASSERT_EQ(run({program("intervale"), "build", volume, "-o", file}).status, 0);
  const ServerProgram local(file);
  const std::array<Arguments, 5> all{{{"--error-percent", "10"}, {}, {"--error", "0.3"}, {"--max-tets", "20000"}, views()[2]}};
  for (const Arguments& view : std::span(all).first(testing::cases(all.size()))) {
    const FileServer web(contents_of(file));
    const Arguments more = Arguments{"--range", "-0.3", "0.4", "--digest", "--json"} + view;
    const auto served = json_of(run(Arguments{program("intervale-client"), "fetch", local.url("gyroid")} + more));
    const auto read = json_of(run(Arguments{program("intervale-client"), "fetch", web.url("/gyroid.ivm")} + more));
    EXPECT_EQ(read.at("digest"), served.at("digest"));
    EXPECT_EQ(read.at("updates"), served.at("updates"));
    const auto& of_file = read.at("file");
    EXPECT_EQ(of_file.at("bytes"), contents_of(file).size());
    EXPECT_EQ(of_file.at("requests"), web.requests().size());
    EXPECT_LE(web.requests().size(), of_file.at("bytes_read").get<std::size_t>() / (64 << 10) + 1);
    const bool is_coarse = view.size() == 2 && (view[1] == "10" || view[1] == "0.3");
    if (is_coarse) {
      EXPECT_LT(of_file.at("bytes_read").get<std::size_t>(), contents_of(file).size() / 4);
    } else {
      EXPECT_EQ(of_file.at("bytes_read"), of_file.at("bytes"));
    }
  }
}

TEST(Remote, FetchOnDemandReadsTheScalesThatACameraWants) {
  const TempDir folder;
  const std::string volume = folder / "gyroid.nrrd", file = folder / "gyroid.ivm";
  ASSERT_EQ(run({program("intervale"), "sample", "gyroid", "--size", "129", "-o", volume}).status, 0);
  ASSERT_EQ(run({program("intervale"), "build", volume, "-o", file}).status, 0);
  const ServerProgram on_demand(file, {"--on-demand"});
  const FileServer web(contents_of(file));
  for (const bool is_coarse : {true, false}) {
    const Arguments more{"--range",
                         "-0.3",
                         "0.4",
                         "--eye",
                         "3",
                         "4",
                         "5",
                         "--look-at",
                         "0",
                         "0",
                         "0",
                         "--viewport",
                         "640",
                         "480",
                         "--pixel-error",
                         is_coarse ? "12" : "0.5",
                         "--json"};
    const auto served = json_of(run(Arguments{program("intervale-client"), "fetch", on_demand.url("gyroid")} + more));
    const auto read = json_of(run(Arguments{program("intervale-client"), "fetch", web.url("/gyroid.ivm"), "--on-demand"} + more));
    EXPECT_GT(read.at("tets"), 1000);
    const auto bytes_read = read.at("file").at("bytes_read").get<std::size_t>();
    if (is_coarse) {
      // And what coarser scales let it want before.
      EXPECT_GE(read.at("updates"), served.at("updates"));
      EXPECT_LT(read.at("updates"), 2 * served.at("updates").get<int>());
      EXPECT_LT(bytes_read, contents_of(file).size() / 4);
    } else {
      EXPECT_EQ(bytes_read, contents_of(file).size());
    }
  }
  const auto refused = run({program("intervale-client"), "fetch", on_demand.url("gyroid"), "--range", "0", "1", "--on-demand"});
  EXPECT_EQ(refused.status, 2);
  EXPECT_EQ(std::count(refused.err.begin(), refused.err.end(), '\n'), 1) << refused.err;
}

TEST(Remote, FetchSaysThatThereIsNoServer) {
  const FileServer web(contents_of(buckyball()));
  const TempDir folder;
  const Finished fetched =
      run({program("intervale-client"), "fetch", web.url("/scan.ivm?signature=secret"), "--error-percent", "20", "-o", folder / "mesh.ply"});
  EXPECT_EQ(fetched.status, 0) << fetched.err;
  EXPECT_THAT(fetched.err, AllOf(HasSubstr("no server: "), Not(HasSubstr("secret"))));
  EXPECT_THAT(fetched.out, AllOf(HasSubstr("scan: "), Not(HasSubstr("secret"))));
  EXPECT_TRUE(std::filesystem::exists(folder / "mesh.ply"));
}

TEST(Remote, WebServersGetHeadersOfTheFileAndNoTokens) {
  FileServer web(contents_of(buckyball()));
  web.misbehave([](const FileRequest& request, std::size_t, FileAnswer& answer) {
    if (request.header("authorization") != "Bearer of-the-file") answer = {.status = 401};
  });
  const TempDir folder;
  const std::string headers = folder.file("headers", "Authorization: Bearer of-the-file\n").string();
  const Arguments fetch{"/usr/bin/env", "INTERVALE_TOKEN=the-token", program("intervale-client"), "fetch", web.url(), "--error-percent", "20",
                        "--json"};
  EXPECT_THAT(run(fetch).err, AllOf(HasSubstr("401"), Not(HasSubstr("the-token"))));
  json_of(run(fetch + Arguments{"--header-file", headers}));
  const ServerProgram server(web.url(), {"--header-file", headers}, {"INTERVALE_TOKEN=the-token"});
  json_of(run({program("intervale-client"), "fetch", server.url("scan"), "--json"}));
  for (const FileRequest& request : web.requests()) {
    for (const auto& [name, value] : request.headers) EXPECT_THAT(value, Not(HasSubstr("the-token"))) << name;
  }
  // Keys are asked for only where they are to be used.
  expect_complaint(run({"/usr/bin/env", "-u", "AWS_ACCESS_KEY_ID", program("intervale"), "serve", web.url(), "--aws-sign"}), 2, "AWS_ACCESS_KEY_ID",
                   "intervale: ");
}

TEST(Remote, WhatCannotBeReadIsOneLine) {
  FileServer web("<!doctype html>" + std::string(1000, ' '));
  expect_complaint(run({program("intervale"), "serve", web.url(), "--listen", "127.0.0.1:0", "--log-level", "off"}), 1, "not an interval volume",
                   "intervale: ");
  const TempDir folder;
  const std::string headers = folder.file("headers", "X-Key: secret\n").string();
  expect_complaint(run({program("intervale"), "serve", web.url(), "http://localhost:1/y.ivm", "--header-file", headers}), 2, "one host",
                   "intervale: ");
  expect_complaint(run({program("intervale"), "serve", "https://user:secret@localhost/x.ivm"}), 2, "header-file", "intervale: ");
  expect_complaint(run({program("intervale"), "serve", buckyball(), "--connect-origin", "https://cdn.example/x"}), 2, "without a path",
                   "intervale: ");
  expect_complaint(run({program("intervale"), "extract", web.url()}), 1, "not an interval volume", "intervale: ");
  const Finished fetched = run({program("intervale-client"), "fetch", web.url("/api")});
  EXPECT_EQ(fetched.status, 1);
  EXPECT_THAT(fetched.err, AllOf(HasSubstr("not an interval volume"), HasSubstr("ws://")));
}

TEST(Remote, AServerFollowsAFileThatChanges) {
  FileServer web(contents_of(buckyball()));
  const TempDir folder;
  const std::string volume = folder / "small.nrrd", other = folder / "small.ivm";
  ASSERT_EQ(run({program("intervale"), "sample", "buckyball", "--size", "33", "-o", volume}).status, 0);
  ASSERT_EQ(run({program("intervale"), "build", volume, "-o", other, "--range", "128", "188"}).status, 0);
  ServerProgram server(web.url(), {"--remote-poll-time", "0.1"});
  web.set(contents_of(other), "\"two\"");
  EXPECT_TRUE(server.process().wait_for("was reloaded"));
  const std::string wanted = digest_of({program("intervale"), "extract", other}, {});
  EXPECT_TRUE(eventually([&] { return digest_of({program("intervale-client"), "fetch", server.url("scan")}, {}) == wanted; }));
  web.misbehave([](const FileRequest&, std::size_t, FileAnswer& answer) { answer = {.status = 404}; });
  EXPECT_TRUE(server.process().wait_for("stays in use"));
  EXPECT_NE(digest_of({program("intervale-client"), "fetch", server.url("scan")}, {}), "");
}

}  // namespace
}  // namespace intervale::remote_files
