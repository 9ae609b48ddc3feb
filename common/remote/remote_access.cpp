#include "common/remote/remote_access.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <string_view>

#include "common/util/printable.h"

namespace intervale {
namespace {

constexpr std::size_t kMostHeaderBytes = 64 << 10;
constexpr std::array<std::string_view, 10> kOurs{"host",   "range",           "connection", "content-length", "transfer-encoding",
                                                 "expect", "accept-encoding", "te",         "upgrade",        "trailer"};

// RFC 9110, section 5.6.2.
bool is_header_name(std::string_view name) {
  return !name.empty() && std::all_of(name.begin(), name.end(), [](unsigned char c) {
    return c < 0x80 && (std::isalnum(c) != 0 || std::string_view("!#$%&'*+-.^_`|~").find(char(c)) != std::string_view::npos);
  });
}

bool is_ours(std::string name) {
  std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return char(std::tolower(c)); });
  return name.starts_with("if-") || std::find(kOurs.begin(), kOurs.end(), name) != kOurs.end();
}

std::string_view stripped(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

std::string variable(const char* name) {
  const char* const value = std::getenv(name);
  return value == nullptr ? "" : value;
}

bool is_visible(const std::string& text) {
  return std::all_of(text.begin(), text.end(), [](unsigned char c) { return c > 0x20 && c < 0x7f; });
}

}  // namespace

Result<std::vector<std::string>> read_header_file(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) return fail("cannot read " + path.string() + ": " + std::strerror(errno));
  std::string text(kMostHeaderBytes + 1, '\0');
  in.read(text.data(), std::streamsize(text.size()));
  if (in.bad()) return fail("cannot read " + path.string());
  text.resize(std::size_t(in.gcount()));
  if (text.size() > kMostHeaderBytes) return fail(path.string() + ": more than 64 KiB: not a file of headers");
  std::vector<std::string> headers;
  std::string_view rest = text;
  for (int number = 1; !rest.empty(); ++number) {
    const std::size_t end = std::min(rest.find('\n'), rest.size());
    const std::string_view line = stripped(rest.substr(0, end));
    rest.remove_prefix(std::min(end + 1, rest.size()));
    if (line.empty() || line.front() == '#') continue;
    const auto wrong = [&](const std::string& what) { return fail(path.string() + ":" + std::to_string(number) + ": " + what); };
    const std::size_t colon = line.find(':');
    if (colon == std::string_view::npos || !is_header_name(line.substr(0, colon))) return wrong("expected 'Name: value'");
    const std::string name(line.substr(0, colon));
    const std::string_view value = stripped(line.substr(colon + 1));
    if (value.empty()) return wrong("the header " + name + " has no value");
    if (has_control_characters(value)) return wrong("control characters in the header " + name);
    if (is_ours(name)) return wrong("the header " + name + " is set by this program");
    headers.push_back(name + ": " + std::string(value));
  }
  return headers;
}

Result<AwsSigning> aws_from_environment(std::string region) {
  AwsSigning aws{std::move(region), variable("AWS_ACCESS_KEY_ID"), variable("AWS_SECRET_ACCESS_KEY"), variable("AWS_SESSION_TOKEN")};
  if (aws.key_id.empty() || aws.secret.empty()) return misuse("--aws-sign needs AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY in the environment");
  if (!is_visible(aws.key_id) || !is_visible(aws.secret) || !is_visible(aws.session_token))
    return misuse("the AWS keys in the environment must be of visible ASCII characters");
  const auto is_region = [](unsigned char c) { return c < 0x80 && (std::isalnum(c) != 0 || c == '-'); };
  if (aws.region.empty()) return misuse("--aws-sign needs a region: --aws-region or AWS_REGION");
  if (!std::all_of(aws.region.begin(), aws.region.end(), is_region)) return misuse("the AWS region must be like eu-west-1");
  return aws;
}

}  // namespace intervale
