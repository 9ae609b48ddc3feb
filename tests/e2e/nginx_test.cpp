// Data sets on a real web server: nginx, with the configuration that deploy/ has for it.
#include <fmt/core.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <optional>
#include <string>

#include "tests/support/complaints.h"
#include "tests/support/free_ports.h"
#include "tests/support/programs.h"
#include "tests/support/serving.h"
#include "tests/support/temp_dir.h"

namespace intervale::nginx_files {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

std::optional<std::string> nginx() {
  for (const char* path : {"/usr/sbin/nginx", "/usr/local/sbin/nginx", "/usr/bin/nginx"}) {
    if (::access(path, X_OK) == 0) return path;
  }
  return {};
}

// 0: folder, 1: port, 2: deploy/. One process, so that it reads a folder of this user, whoever that is. A line of the log:
// method, status, range.
constexpr const char* kConfiguration = R"(
daemon off;
master_process off;
pid {0}/pid;
events {{ }}
http {{
  log_format short '$request_method $status $http_range';
  access_log {0}/log short;
  client_body_temp_path {0}/temporary;
  proxy_temp_path {0}/temporary;
  fastcgi_temp_path {0}/temporary;
  uwsgi_temp_path {0}/temporary;
  scgi_temp_path {0}/temporary;
  server {{
    listen 127.0.0.1:{1};
    location /scans/ {{
      root {0};
      include {2}/nginx-ivm.conf;
    }}
  }}
}}
)";

// nginx with a folder that has the buckyball as /scans/x.ivm.
class Nginx {
 public:
  explicit Nginx(const std::string& program)
      : port_(free_ports<1>()[0]),
        configuration_(folder_.file("nginx.conf", fmt::format(kConfiguration, folder_.path().string(), port_, INTERVALE_DEPLOY))) {
    std::filesystem::create_directory(folder_ / "scans");
    put(buckyball());
    process_.emplace(std::vector<std::string>{program, "-e", "stderr", "-p", folder_.path(), "-c", configuration_});
  }

  // Replaces the file as the documents say: by renaming one that is whole.
  void put(const std::filesystem::path& file) const {
    std::filesystem::copy_file(file, folder_ / "scans/new");
    std::filesystem::rename(folder_ / "scans/new", folder_ / "scans/x.ivm");
  }
  [[nodiscard]] std::string url() const { return fmt::format("http://127.0.0.1:{}/scans/x.ivm", port_); }
  // The answer to a request of /scans/x.ivm, its head included. lines: of the header, each with its end.
  [[nodiscard]] std::string ask(const std::string& method, const std::string& lines) const {
    return talk(port_, method + " /scans/x.ivm HTTP/1.1\r\nHost: x\r\nOrigin: http://page\r\nConnection: close\r\n" + lines + "\r\n");
  }
  [[nodiscard]] std::string log() const { return contents_of(folder_ / "log"); }
  [[nodiscard]] bool answers() const {
    return eventually([&] {
      try {
        return ask("HEAD", "").starts_with("HTTP/1.1 200");
      } catch (const std::exception&) {
        return false;
      }
    });
  }

 private:
  TempDir folder_;
  std::uint16_t port_;
  std::filesystem::path configuration_;
  std::optional<Process> process_;
};

class NginxFiles : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto installed = nginx();
    if (!installed) GTEST_SKIP() << "no nginx here";
    web_.emplace(*installed);
    ASSERT_TRUE(web_->answers());
  }
  std::optional<Nginx> web_;
};

std::string digest_of(const Arguments& command) { return json_of(run(command + Arguments{"--digest", "--json"})).value("digest", ""); }

TEST_F(NginxFiles, AreReadAsLocalOnes) {
  const std::string wanted = digest_of({program("intervale"), "extract", buckyball()});
  EXPECT_NE(wanted, "");
  EXPECT_EQ(digest_of({program("intervale"), "extract", web_->url()}), wanted);
  EXPECT_EQ(digest_of({program("intervale-client"), "fetch", web_->url()}), wanted);
  const ServerProgram server(web_->url());
  EXPECT_EQ(digest_of({program("intervale-client"), "fetch", server.url("x")}), wanted);
  auto local = json_of(run({program("intervale"), "info", buckyball(), "--json"}));
  local["name"] = "x";
  EXPECT_EQ(json_of(run({program("intervale"), "info", web_->url(), "--json"})), local);
  EXPECT_EQ(json_of(run({program("intervale"), "verify", web_->url(), "--json"})).at("valid"), true);
  EXPECT_THAT(web_->log(), HasSubstr("GET 206 bytes=0-65535\n"));
}

TEST_F(NginxFiles, AreServedAnewWhenTheyAreReplaced) {
  const TempDir folder;
  const std::string volume = folder / "small.nrrd", other = folder / "small.ivm";
  ASSERT_EQ(run({program("intervale"), "sample", "buckyball", "--size", "33", "-o", volume}).status, 0);
  ASSERT_EQ(run({program("intervale"), "build", volume, "-o", other, "--range", "128", "188"}).status, 0);
  ServerProgram server(web_->url(), {"--remote-poll-time", "0.1"});
  EXPECT_TRUE(eventually([&] { return web_->log().find("GET 304 ") != std::string::npos; })) << "asked by ETag";
  web_->put(other);
  EXPECT_TRUE(server.process().wait_for("was reloaded"));
  const std::string wanted = digest_of({program("intervale"), "extract", other});
  EXPECT_TRUE(eventually([&] { return digest_of({program("intervale-client"), "fetch", server.url("x")}) == wanted; }));
}

TEST_F(NginxFiles, MayBeReadByPagesOfOtherOrigins) {
  const std::string part = web_->ask("GET", "Range: bytes=0-9\r\n");
  EXPECT_THAT(part, StartsWith("HTTP/1.1 206"));
  for (const char* line : {"Access-Control-Allow-Origin: *", "Access-Control-Expose-Headers: Content-Range, Accept-Ranges, ETag",
                           "Content-Range: bytes 0-9/", "Content-Type: application/octet-stream", "ETag: \"", "Cache-Control: no-cache"})
    EXPECT_THAT(part, HasSubstr(line));
  const std::string asked = web_->ask("OPTIONS", "Access-Control-Request-Method: GET\r\nAccess-Control-Request-Headers: range\r\n");
  EXPECT_THAT(asked, StartsWith("HTTP/1.1 204"));
  for (const char* line : {"Access-Control-Allow-Origin: *", "Access-Control-Allow-Methods: GET, HEAD", "Access-Control-Allow-Headers: Range"})
    EXPECT_THAT(asked, HasSubstr(line));
  EXPECT_THAT(web_->ask("GET", "If-Match: \"another\"\r\n"),
              ::testing::AllOf(StartsWith("HTTP/1.1 412"), HasSubstr("Access-Control-Allow-Origin: *")));
}

}  // namespace
}  // namespace intervale::nginx_files
