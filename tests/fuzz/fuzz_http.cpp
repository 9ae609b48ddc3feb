// Bytes as an HTTP request. The first two bytes pick the server's state, who asks, and how; then, a line each: the
// target, Host, Accept-Encoding, If-None-Match, and the name of a data set.
#include <algorithm>
#include <array>
#include <cctype>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "server/builder/field_hierarchy.h"
#include "server/serve/http_routes.h"
#include "server/serve/request_target.h"
#include "tests/fuzz/lines.h"
#include "tests/support/analytic_fields.h"
#include "tests/support/temp_dir.h"

using namespace intervale;

namespace {

constexpr std::array<std::string_view, 5> kMethods{"GET", "HEAD", "POST", "get", "OPTIONS"};
constexpr std::string_view kOpen = "scans-open";  // a data set that every token opens

// What may be sent, by path; in every file its own words.
const std::map<std::string, std::string>& viewer_files() {
  static const std::map<std::string, std::string> all{
      {"/index.html", "<html>"}, {"/assets/index-BVx3_a9Z.js", "let a = 1;"}, {"/assets/50% more & less.txt", "more"}, {"/lone.gz", "lone"}};
  return all;
}
constexpr std::string_view kPackedPath = "/assets/index-BVx3_a9Z.js", kPacked = "packed";

StaticFiles load_viewer() {
  const TempDir around;
  const std::filesystem::path root = around / "viewer";
  for (const char* folder : {"assets", ".hidden"}) std::filesystem::create_directories(root / folder);
  for (const auto& [path, bytes] : viewer_files()) around.file("viewer" + path, bytes);
  around.file("viewer" + std::string(kPackedPath) + ".gz", kPacked);
  for (const char* name : {"secret", "viewer/.secret", "viewer/.hidden/secret"}) around.file(name, "secret");
  std::filesystem::create_symlink(around / "secret", root / "link");
  return StaticFiles::load(root).value();
}

Catalogue::Volume volume_named(std::string name) {
  Volume volume = testing::gyroid({2, 2, 2});
  volume.name = std::move(name);
  return std::make_shared<const IntervalVolume>(FieldHierarchy(volume, {.range = {-0.3, 0.2}}).compact().value());
}

// By rewriting in place, escape for escape.
std::optional<std::string> plain_path(std::string target) {
  target = target.substr(0, target.find('?'));
  if (target.empty() || target[0] != '/') return {};
  for (auto at = target.find('%'); at != std::string::npos; at = target.find('%', at + 1)) {
    const std::string digits = target.substr(at + 1, 2);
    if (digits.size() != 2 || !std::isxdigit(static_cast<unsigned char>(digits[0])) || !std::isxdigit(static_cast<unsigned char>(digits[1])))
      return {};
    target.replace(at, 3, 1, char(std::stoi(digits, nullptr, 16)));
  }
  if (target.find('\0') != std::string::npos) return {};
  return target;
}

std::string escaped_path(std::string_view path) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string target = "/";
  for (const unsigned char c : path.substr(1)) target += {'%', kDigits[c >> 4], kDigits[c & 15]};
  return target;
}

// Whether the header has a weight for gzip, or for what it does not name, that is above 0 and not above 1.
bool takes_gzip(std::string header) {
  std::transform(header.begin(), header.end(), header.begin(), [](unsigned char c) { return char(std::tolower(c)); });
  std::optional<bool> gzip, any;
  for (const std::string& item : testing::split_trimmed(header, ',')) {
    const auto parts = testing::split_trimmed(item, ';');
    const auto q = std::find_if(parts.begin() + 1, parts.end(), [](const std::string& part) { return part.starts_with("q="); });
    bool taken = true;
    if (q != parts.end()) {
      char* end = nullptr;
      const double weight = std::strtod(q->c_str() + 2, &end);
      taken = q->size() > 2 && q->find_first_not_of("0123456789.", 2) == std::string::npos && *end == '\0' && weight > 0 && weight <= 1;
    }
    if (!gzip && (parts[0] == "gzip" || parts[0] == "x-gzip")) gzip = taken;
    if (parts[0] == "*") any = taken;
  }
  return gzip.value_or(any.value_or(false));
}

std::string header_of(const HttpResponse& answer, std::string_view name) {
  for (const auto& [key, value] : answer.headers) {
    if (key == name) return value;
  }
  return {};
}

bool is_one_line(std::string_view text) {
  return std::none_of(text.begin(), text.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; });
}

// What holds for every answer.
void check(const HttpRequest& request, const HttpState& state, const HttpResponse& answer) {
  constexpr std::array<unsigned, 9> kStatuses{200, 204, 304, 400, 401, 403, 404, 405, 503};
  testing::require(std::find(kStatuses.begin(), kStatuses.end(), answer.status) != kStatuses.end(), "the status is a known one");
  testing::require((answer.body == nullptr) == (answer.status == 204 || answer.status == 304), "only 204 and 304 have no body");
  for (const std::string* line : {&answer.content_type, &answer.content_security_policy, &answer.cache_control}) {
    testing::require(is_one_line(*line), "a header is one line");
  }
  for (const auto& [name, value] : answer.headers) testing::require(is_one_line(name + value), "a header is one line");
  // A policy's parts are put apart by semicolons: the host that was asked adds none.
  const auto parts = std::count(answer.content_security_policy.begin(), answer.content_security_policy.end(), ';');
  testing::require(parts == 0 || parts == 10, "a host adds nothing to the policy but itself");

  const auto path = plain_path(std::string(request.target));
  testing::require((answer.status == 400) == !path, "400 is for targets that cannot be read, and for them only");
  const std::string body = answer.body ? *answer.body : "";
  testing::require(body != "secret", "what lies outside is never sent");
  const std::string name = path == "/" ? "/index.html" : path.value_or("");
  const auto file = viewer_files().find(name);
  const bool is_file = file != viewer_files().end() && state.role == PortRole::all && state.viewer.find("/") != nullptr;
  const bool packed = header_of(answer, "Content-Encoding") == "gzip";
  for (const auto& [at, bytes] : viewer_files()) {
    if (body == bytes) testing::require(is_file && at == name && !packed, "a file is sent to who asks for it");
  }
  if (body == kPacked) testing::require(is_file && name == kPackedPath && packed, "what is packed says so");
  if (packed) testing::require(body == kPacked && takes_gzip(std::string(request.accept_encoding)), "only who takes gzip gets it");
  const bool reads = request.method == "GET" || request.method == "HEAD";
  if (is_file && reads) {
    testing::require(answer.status == 200 || answer.status == 304, "a file that is there is found");
    const std::string tag = header_of(answer, "ETag");
    testing::require(!tag.empty(), "a file has a tag");
    if (answer.status == 304) {
      testing::require(request.if_none_match.find(tag) != std::string_view::npos || request.if_none_match.find('*') != std::string_view::npos,
                       "304 is for who names the tag");
    } else if (name == kPackedPath) {
      testing::require(packed == takes_gzip(std::string(request.accept_encoding)), "who takes gzip gets it");
    }
  }
  if (!reads) testing::require(answer.status >= 400 || (request.method == "OPTIONS" && answer.status == 204), "other methods get nothing");
  const bool is_dataset = path && path->starts_with("/api/datasets/");
  const bool is_api = state.role == PortRole::all && (path == "/api/datasets" || is_dataset) && answer.status != 405;
  testing::require(header_of(answer, "Access-Control-Allow-Origin") == (is_api ? request.allowed_origin : ""),
                   "pages from elsewhere read what there is of data sets only");

  if (answer.status != 200 || path == "/metrics") return;
  std::set<std::string> shown;
  if (path == "/api/datasets") {
    testing::require(request.scope != nullptr, "data sets are told to who may know of them");
    const auto json = nlohmann::json::parse(body, nullptr, false);
    testing::require(json.is_object(), "JSON is JSON");
    for (const auto& one : json["datasets"]) shown.insert(one["name"]);
  }
  if (is_dataset) {
    const std::string wanted = path->substr(path->rfind('/') + 1);
    testing::require(request.scope != nullptr && request.scope->allows(wanted), "a data set is told to who may know of it");
    testing::require(nlohmann::json::parse(body, nullptr, false).value("name", "") == wanted, "the data set is the one asked for");
  }
  for (const auto& [dataset, volume] : state.catalogue.volumes()) {
    const bool allowed = request.scope != nullptr && request.scope->allows(dataset);
    if (path == "/api/datasets") testing::require(shown.contains(dataset) == allowed, "who asks sees what the token opens, and all of it");
    if (!allowed) testing::require(dataset != kOpen || body.find(dataset) == std::string::npos, "no page names what the token does not open");
  }
}

bool equal(const HttpResponse& a, const HttpResponse& b) {
  const bool bodies = a.body == b.body || (a.body && b.body && *a.body == *b.body);
  return a.status == b.status && bodies && a.content_type == b.content_type && a.headers == b.headers;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const StaticFiles viewer = load_viewer(), no_viewer;
  static const Metrics metrics;
  static const Memory memory;
  static const Catalogue::Volume open = volume_named(std::string(kOpen));
  static const Scope nothing({"nothing"}), scans({"scans-*"});
  if (size < 2) return 0;
  const std::array<const Scope*, 4> scopes{nullptr, &nothing, &scans, Scope::everything().get()};
  auto lines = testing::lines_of(data + 2, size - 2, 5);
  Catalogue catalogue;
  testing::require(catalogue.add(open).has_value(), "a plain name will do");
  if (!lines[4].empty()) (void)catalogue.add(volume_named(lines[4]));
  const HttpState state{
      .catalogue = catalogue,
      .metrics = metrics,
      .memory = memory,
      .viewer = data[0] & 1 ? no_viewer : viewer,
      .role = data[0] & 2 ? PortRole::metrics : PortRole::all,
      .has_metrics_port = (data[0] & 4) != 0,
      .server_status = std::array{ServerStatus::ready, ServerStatus::loading, ServerStatus::full, ServerStatus::draining}[data[0] / 8u % 4]};
  HttpRequest request{.method = kMethods[data[1] % kMethods.size()],
                      .target = lines[0],
                      .host = lines[1],
                      .accept_encoding = lines[2],
                      .if_none_match = lines[3],
                      .allowed_origin = data[0] & 64 ? "https://elsewhere.example" : "",
                      .scope = scopes[data[1] / 4u % scopes.size()]};
  if (const auto asked = request_target(lines[0], std::array<std::string_view, 1>{lines[1]}, 11)) {
    testing::require(asked->host.find_first_of(" /?#@\"") == std::string::npos, "a host is no more than that");
    testing::require(asked->target == lines[0] || asked->target.starts_with('/'), "a URL has a path");
    request.target = lines[0] = asked->target;
    request.host = lines[1] = asked->host;
  }
  const HttpResponse first = respond(request, state);
  check(request, state, first);
  const auto path = plain_path(lines[0]);
  if (!path || path == "/metrics") return 0;  // metrics are of the moment
  for (const std::string& target : {escaped_path(*path), escaped_path(*path) + "?" + lines[0]}) {
    request.target = target;
    testing::require(equal(respond(request, state), first), "neither escapes nor a query make a difference");
  }
  return 0;
}
