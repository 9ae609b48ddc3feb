#include "tests/support/file_server.h"

#include <sys/socket.h>

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/http/read.hpp>
#include <cctype>
#include <charconv>
#include <list>
#include <mutex>
#include <set>
#include <thread>
#include <utility>

namespace intervale::testing {
namespace {

namespace asio = boost::asio;
namespace http = boost::beast::http;
using Tcp = asio::ip::tcp;

// Of "bytes=0-99".
std::optional<std::pair<std::size_t, std::size_t>> range_in(const std::string& text, std::size_t size) {
  std::size_t first = 0, last = 0;
  if (!text.starts_with("bytes=")) return {};
  const char* const end = text.data() + text.size();
  const auto begun = std::from_chars(text.data() + 6, end, first);
  if (begun.ec != std::errc() || begun.ptr == end || *begun.ptr != '-') return {};
  if (std::from_chars(begun.ptr + 1, end, last).ec != std::errc()) return {};
  return std::pair(first, std::min(last, size - 1));
}

FileAnswer honest(const FileRequest& request, const std::string& contents, const std::string& etag) {
  FileAnswer answer;
  if (!etag.empty()) answer.headers.emplace_back("ETag", etag);
  if (!etag.empty() && request.header("if-none-match") == etag) {
    answer.status = 304;
    answer.has_content_length = false;
    return answer;
  }
  const std::string wanted = request.header("if-match");
  if (!wanted.empty() && (wanted != etag || etag.starts_with("W/"))) {
    answer.status = 412;
    return answer;
  }
  const auto range = range_in(request.header("range"), contents.size());
  if (!range) {
    answer.body = contents;
    return answer;
  }
  if (range->first >= contents.size()) {
    answer.status = 416;
    answer.headers.emplace_back("Content-Range", "bytes */" + std::to_string(contents.size()));
    return answer;
  }
  answer.status = 206;
  answer.body = contents.substr(range->first, range->second - range->first + 1);
  answer.headers.emplace_back("Content-Range",
                              "bytes " + std::to_string(range->first) + "-" + std::to_string(range->second) + "/" + std::to_string(contents.size()));
  return answer;
}

std::string head_of(const FileAnswer& answer) {
  std::string head = "HTTP/1.1 " + std::to_string(answer.status) + " Whatever\r\n";
  for (const auto& [name, value] : answer.headers) head += name + ": " + value + "\r\n";
  if (answer.has_content_length) head += "Content-Length: " + std::to_string(answer.content_length.value_or(answer.body.size())) + "\r\n";
  return head + "\r\n";
}

}  // namespace

struct FileServer::State {
  asio::io_context io;
  Tcp::acceptor acceptor{io, {asio::ip::address_v4::loopback(), 0}};
  mutable std::mutex mutex;
  std::string contents, etag;
  Misbehave how;
  std::vector<FileRequest> requests;
  std::set<int> open;  // descriptors of connections
  std::size_t most_open = 0;
  bool is_ending = false;
  std::list<std::thread> threads;  // one a connection, and the first accepts

  FileAnswer answer(FileRequest request) {
    const std::lock_guard lock(mutex);
    FileAnswer answer = honest(request, contents, etag);
    if (how) how(request, requests.size(), answer);
    requests.push_back(std::move(request));
    return answer;
  }

  void serve(Tcp::socket& socket) {
    boost::beast::flat_buffer buffer;
    boost::system::error_code error;
    while (true) {
      http::request<http::empty_body> read;
      http::read(socket, buffer, read, error);
      if (error) return;
      FileRequest request{std::string(read.target()), {}};
      for (const auto& field : read) {
        std::string name(field.name_string());
        std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return char(std::tolower(c)); });
        request.headers[name] = std::string(field.value());
      }
      const FileAnswer answer = this->answer(std::move(request));
      asio::write(socket, asio::buffer(head_of(answer)), error);
      if (answer.hangs) {
        char byte = 0;
        socket.read_some(asio::buffer(&byte, 1), error);  // until either side ends
        return;
      }
      asio::write(socket, asio::buffer(answer.body.data(), std::min(answer.cut_after.value_or(answer.body.size()), answer.body.size())), error);
      const bool is_304 = answer.status == 304;
      if (error || answer.cut_after || (!answer.has_content_length && !is_304)) return;
    }
  }

  void run(const std::shared_ptr<State>& self) {
    boost::system::error_code error;
    while (true) {
      auto socket = std::make_shared<Tcp::socket>(io);
      acceptor.accept(*socket, error);
      const std::lock_guard lock(mutex);
      if (error || is_ending) return;
      const int descriptor = socket->native_handle();
      open.insert(descriptor);
      most_open = std::max(most_open, open.size());
      threads.emplace_back([self, socket, descriptor] {
        self->serve(*socket);
        const std::lock_guard ended(self->mutex);
        self->open.erase(descriptor);
        boost::system::error_code ignored;
        socket->close(ignored);
      });
    }
  }
};

FileServer::FileServer(std::string contents, std::string etag) : state_(std::make_shared<State>()) {
  state_->contents = std::move(contents);
  state_->etag = std::move(etag);
  const std::lock_guard lock(state_->mutex);
  state_->threads.emplace_back([state = state_] { state->run(state); });
}

FileServer::~FileServer() {
  std::list<std::thread> threads;
  {
    const std::lock_guard lock(state_->mutex);
    state_->is_ending = true;
    ::shutdown(state_->acceptor.native_handle(), SHUT_RDWR);  // ends accept()
    for (const int descriptor : state_->open) ::shutdown(descriptor, SHUT_RDWR);
    threads.swap(state_->threads);
  }
  for (std::thread& thread : threads) thread.join();
}

void FileServer::set(std::string contents, std::string etag) {
  const std::lock_guard lock(state_->mutex);
  state_->contents = std::move(contents);
  state_->etag = std::move(etag);
}

void FileServer::misbehave(Misbehave how) {
  const std::lock_guard lock(state_->mutex);
  state_->how = std::move(how);
}

std::uint16_t FileServer::port() const { return state_->acceptor.local_endpoint().port(); }

std::vector<FileRequest> FileServer::requests() const {
  const std::lock_guard lock(state_->mutex);
  return state_->requests;
}

std::size_t FileServer::most_connections() const {
  const std::lock_guard lock(state_->mutex);
  return state_->most_open;
}

}  // namespace intervale::testing
