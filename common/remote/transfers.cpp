#include "common/remote/transfers.h"

#include <exception>
#include <map>
#include <new>
#include <stdexcept>
#include <utility>

#include "common/remote/libcurl.h"
#include "common/util/printable.h"

namespace intervale {
namespace {

constexpr std::size_t kMostHeaderValue = 4096;
constexpr std::size_t kMostDropped = 64 << 10;  // of the body of an answer that is not taken
constexpr long kLeastBytesPerSecond = 1000;
// S3 wants this header, and libcurl adds it from version 8 on only: of a request without a body.
constexpr const char* kHashOfNothing = "x-amz-content-sha256: e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855";

struct ListFree {
  void operator()(curl_slist* list) const { libcurl().curl_slist_free_all(list); }
};
using HeaderList = std::unique_ptr<curl_slist, ListFree>;

void append_header(HeaderList& list, const std::string& line) {
  curl_slist* const longer = libcurl().curl_slist_append(list.get(), line.c_str());
  if (longer == nullptr) throw std::bad_alloc();
  (void)list.release();
  list.reset(longer);
}

std::string header_of(CURL* easy, const char* name) {
  curl_header* header = nullptr;
  if (libcurl().curl_easy_header(easy, name, 0, CURLH_HEADER, -1, &header) != CURLHE_OK || header->amount != 1) return {};
  const std::string value(header->value);
  return value.size() > kMostHeaderValue ? std::string() : value;
}

RemoteAnswer answer_of(CURL* easy) {
  RemoteAnswer answer;
  libcurl().curl_easy_getinfo(easy, CURLINFO_RESPONSE_CODE, &answer.status);
  if (answer.status == 0) return answer;
  answer.content_range = header_of(easy, "Content-Range");
  answer.content_encoding = header_of(easy, "Content-Encoding");
  answer.etag = header_of(easy, "ETag");
  answer.last_modified = header_of(easy, "Last-Modified");
  answer.location = header_of(easy, "Location");
  curl_off_t number = -1;
  if (libcurl().curl_easy_getinfo(easy, CURLINFO_CONTENT_LENGTH_DOWNLOAD_T, &number) == CURLE_OK && number >= 0) answer.content_length = number;
  number = 0;
  if (libcurl().curl_easy_getinfo(easy, CURLINFO_RETRY_AFTER, &number) == CURLE_OK && number > 0) answer.retry_after = std::chrono::seconds(number);
  return answer;
}

// What another attempt may not meet.
bool is_temporary_failure(CURLcode code) {
  switch (code) {
    case CURLE_COULDNT_RESOLVE_HOST:
    case CURLE_COULDNT_CONNECT:
    case CURLE_OPERATION_TIMEDOUT:
    case CURLE_GOT_NOTHING:
    case CURLE_SEND_ERROR:
    case CURLE_RECV_ERROR:
    case CURLE_PARTIAL_FILE:
    case CURLE_SSL_CONNECT_ERROR:
      return true;
    default:
      return false;
  }
}

bool is_taken(long status) { return status >= 200 && status < 300; }

}  // namespace

struct Transfers::Running {
  std::size_t id = 0;
  CURL* easy = nullptr;
  CURLM* multi = nullptr;
  HeaderList headers;
  Take take;
  std::optional<RemoteAnswer> answer;  // once its body begins
  std::size_t dropped = 0;
  std::optional<Error> refusal;
  std::exception_ptr thrown;
  char failure[CURL_ERROR_SIZE] = {};

  Running() = default;
  Running(const Running&) = delete;
  Running& operator=(const Running&) = delete;
  ~Running() {
    if (multi != nullptr) libcurl().curl_multi_remove_handle(multi, easy);
    libcurl().curl_easy_cleanup(easy);
  }

  // For libcurl: anything but `size` ends the transfer.
  static std::size_t on_body(char* data, std::size_t /*one*/, std::size_t size, void* user) noexcept {
    auto& running = *static_cast<Running*>(user);
    try {
      return running.accept({reinterpret_cast<const std::byte*>(data), size}) ? size : size + 1;
    } catch (...) {
      running.thrown = std::current_exception();
      return size + 1;
    }
  }
  bool accept(std::span<const std::byte> bytes) {
    if (!answer) answer = answer_of(easy);
    if (!is_taken(answer->status)) return (dropped += bytes.size()) <= kMostDropped;
    auto taken = take(*answer, bytes);
    if (!taken) refusal = std::move(taken.error());
    return taken.has_value();
  }
};

struct Transfers::Shared {
  CURLM* multi = nullptr;
  Times times;
  std::optional<std::filesystem::path> authorities;
  std::map<CURL*, std::unique_ptr<Running>> running;

  Shared(const Times& of, std::optional<std::filesystem::path> trusted)
      : multi(libcurl().curl_multi_init()), times(of), authorities(std::move(trusted)) {
    if (multi == nullptr) throw std::bad_alloc();
  }
  Shared(const Shared&) = delete;
  Shared& operator=(const Shared&) = delete;
  ~Shared() {
    running.clear();
    libcurl().curl_multi_cleanup(multi);
  }

  EndedTransfer end_of(const CURLMsg& message) {
    const auto found = running.find(message.easy_handle);
    const auto ended = std::move(found->second);
    running.erase(found);
    if (ended->thrown) std::rethrow_exception(ended->thrown);
    EndedTransfer end;
    end.id = ended->id;
    end.answer = ended->answer ? std::move(*ended->answer) : answer_of(ended->easy);
    end.refusal = std::move(ended->refusal);
    const CURLcode code = message.data.result;
    // An answer that is not taken counts, however its body ends.
    const bool is_answered = end.answer.status != 0 && !is_taken(end.answer.status);
    if (code == CURLE_OK || end.refusal || is_answered) return end;
    end.failure = printable(ended->failure[0] != '\0' ? ended->failure : libcurl().curl_easy_strerror(code));
    end.is_temporary = is_temporary_failure(code);
    return end;
  }
};

Transfers::Transfers(std::size_t connections, const Times& times, std::optional<std::filesystem::path> authorities) {
  shared_ = std::make_unique<Shared>(times, std::move(authorities));
  libcurl().curl_multi_setopt(shared_->multi, CURLMOPT_MAX_TOTAL_CONNECTIONS, long(connections));
}

Transfers::~Transfers() = default;

std::size_t Transfers::running() const { return shared_->running.size(); }

void Transfers::start(std::size_t id, const RemoteRequest& request, Take take) {
  auto running = std::make_unique<Running>();
  running->id = id;
  running->take = std::move(take);
  CURL* const easy = running->easy = libcurl().curl_easy_init();
  if (easy == nullptr) throw std::bad_alloc();
  append_header(running->headers, "Accept-Encoding: identity");
  for (const std::string& line : request.headers) append_header(running->headers, line);
  if (const RemoteAccess* const access = request.access) {
    for (const std::string& line : access->headers) append_header(running->headers, line);
    if (access->aws) {
      append_header(running->headers, kHashOfNothing);
      if (!access->aws->session_token.empty()) append_header(running->headers, "x-amz-security-token: " + access->aws->session_token);
      libcurl().curl_easy_setopt(easy, CURLOPT_AWS_SIGV4, ("aws:amz:" + access->aws->region + ":s3").c_str());
      libcurl().curl_easy_setopt(easy, CURLOPT_USERNAME, access->aws->key_id.c_str());
      libcurl().curl_easy_setopt(easy, CURLOPT_PASSWORD, access->aws->secret.c_str());
    }
  }
  libcurl().curl_easy_setopt(easy, CURLOPT_URL, request.url.text.c_str());
  libcurl().curl_easy_setopt(easy, CURLOPT_RANGE, (std::to_string(request.first) + "-" + std::to_string(request.last)).c_str());
  libcurl().curl_easy_setopt(easy, CURLOPT_HTTPHEADER, running->headers.get());
  libcurl().curl_easy_setopt(easy, CURLOPT_USERAGENT, "intervale/" INTERVALE_VERSION);
  libcurl().curl_easy_setopt(easy, CURLOPT_PROTOCOLS_STR, request.url.secure ? "https" : "http");
  libcurl().curl_easy_setopt(easy, CURLOPT_HTTP_VERSION, long(CURL_HTTP_VERSION_1_1));  // a connection for each range: they run beside each other
  libcurl().curl_easy_setopt(easy, CURLOPT_FOLLOWLOCATION, 0L);                         // libcurl would send our headers to other hosts
  libcurl().curl_easy_setopt(easy, CURLOPT_NOSIGNAL, 1L);
  libcurl().curl_easy_setopt(easy, CURLOPT_CONNECTTIMEOUT_MS, long(shared_->times.connect.count()));
  libcurl().curl_easy_setopt(easy, CURLOPT_LOW_SPEED_LIMIT, kLeastBytesPerSecond);
  libcurl().curl_easy_setopt(easy, CURLOPT_LOW_SPEED_TIME, long(shared_->times.idle.count()));
  if (shared_->authorities) libcurl().curl_easy_setopt(easy, CURLOPT_CAINFO, shared_->authorities->c_str());
  libcurl().curl_easy_setopt(easy, CURLOPT_ERRORBUFFER, running->failure);
  libcurl().curl_easy_setopt(easy, CURLOPT_WRITEFUNCTION, &Running::on_body);
  libcurl().curl_easy_setopt(easy, CURLOPT_WRITEDATA, running.get());
  if (libcurl().curl_multi_add_handle(shared_->multi, easy) != CURLM_OK) throw std::bad_alloc();
  running->multi = shared_->multi;
  shared_->running.emplace(easy, std::move(running));
}

std::vector<EndedTransfer> Transfers::wait(std::chrono::milliseconds time) {
  std::vector<EndedTransfer> ended;
  for (int turn = 0; turn < 2; ++turn) {
    int left = 0;
    libcurl().curl_multi_perform(shared_->multi, &left);
    while (const CURLMsg* const message = libcurl().curl_multi_info_read(shared_->multi, &left)) {
      if (message->msg == CURLMSG_DONE) ended.push_back(shared_->end_of(*message));
    }
    if (!ended.empty() || turn == 1) break;
    libcurl().curl_multi_poll(shared_->multi, nullptr, 0, int(time.count()), nullptr);
  }
  return ended;
}

}  // namespace intervale
