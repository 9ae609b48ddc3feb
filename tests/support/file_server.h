// A web server with one file, in this process. It answers ranges as RFC 9110 wants it, unless a test has it misbehave.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace intervale::testing {

struct FileRequest {
  std::string target;
  std::map<std::string, std::string> headers;  // names in lower case
  [[nodiscard]] std::string header(const std::string& name) const {
    const auto found = headers.find(name);
    return found == headers.end() ? "" : found->second;
  }
};

struct FileAnswer {
  unsigned status = 200;
  std::vector<std::pair<std::string, std::string>> headers = {};  // besides Content-Length
  std::string body = {};
  std::optional<std::size_t> content_length = {};  // that it says; off: the body's
  bool has_content_length = true;
  std::optional<std::size_t> cut_after = {};  // bytes of the body, after which the connection ends
  bool hangs = false;                         // sends the head only, and then nothing, until the server ends
};

class FileServer {
 public:
  // number: of the request, from 0 on.
  using Misbehave = std::function<void(const FileRequest& request, std::size_t number, FileAnswer& answer)>;

  // Serves the contents at every path, on a free port of 127.0.0.1, until it is destroyed.
  explicit FileServer(std::string contents, std::string etag = "\"one\"");
  FileServer(const FileServer&) = delete;
  FileServer& operator=(const FileServer&) = delete;
  ~FileServer();

  // Changes what is answered next. Any thread; misbehave is called by the server's threads, one at a time.
  void set(std::string contents, std::string etag);
  void misbehave(Misbehave how);

  [[nodiscard]] std::uint16_t port() const;
  [[nodiscard]] std::string url(const std::string& path = "/scan.ivm") const { return "http://127.0.0.1:" + std::to_string(port()) + path; }
  [[nodiscard]] std::vector<FileRequest> requests() const;  // all that came
  [[nodiscard]] std::size_t most_connections() const;       // that were open at a time

 private:
  struct State;
  std::shared_ptr<State> state_;
};

}  // namespace intervale::testing
