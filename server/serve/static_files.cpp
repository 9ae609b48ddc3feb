#include "server/serve/static_files.h"

#include <fmt/core.h>
#include <xxhash.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <fstream>
#include <system_error>
#include <utility>
#include <vector>

#include "server/serve/header_text.h"

namespace intervale {
namespace {

namespace fs = std::filesystem;

constexpr std::array<std::pair<std::string_view, std::string_view>, 14> kTypes{{
    {".html", "text/html; charset=utf-8"},
    {".js", "text/javascript; charset=utf-8"},
    {".mjs", "text/javascript; charset=utf-8"},
    {".css", "text/css; charset=utf-8"},
    {".wasm", "application/wasm"},
    {".svg", "image/svg+xml"},
    {".png", "image/png"},
    {".jpg", "image/jpeg"},
    {".ico", "image/x-icon"},
    {".json", "application/json"},
    {".map", "application/json"},
    {".webmanifest", "application/manifest+json"},
    {".txt", "text/plain; charset=utf-8"},
    {".woff2", "font/woff2"},
}};

std::string type_of(const fs::path& path) {
  const std::string extension = path.extension().string();
  const auto* const found = std::find_if(kTypes.begin(), kTypes.end(), [&](const auto& type) { return type.first == extension; });
  return std::string(found == kTypes.end() ? "application/octet-stream" : found->second);
}

// Vite names bundled files like assets/index-BVx3_a9Z.js. An ordinary word of eight letters has no digit and no
// capital; a hash without either is taken for a word, and the file is only revalidated more often than needed.
bool has_hash_in_name(std::string_view path) {
  constexpr std::size_t kHash = 8;
  if (!path.starts_with("/assets/")) return false;
  const std::string_view name = path.substr(path.rfind('/') + 1);
  const std::string_view stem = name.substr(0, name.find('.'));
  if (stem.size() < kHash + 2 || stem[stem.size() - kHash - 1] != '-') return false;
  const std::string_view hash = stem.substr(stem.size() - kHash);
  const auto is_base64 = [](unsigned char c) { return std::isalnum(c) != 0 || c == '_' || c == '-'; };
  const auto is_digit_or_upper = [](unsigned char c) { return std::isdigit(c) != 0 || std::isupper(c) != 0; };
  return std::all_of(hash.begin(), hash.end(), is_base64) && std::any_of(hash.begin(), hash.end(), is_digit_or_upper);
}

bool is_hidden(const fs::path& path) { return path.filename().string().starts_with('.'); }

bool lies_in(const fs::path& path, const fs::path& folder) {
  return std::mismatch(path.begin(), path.end(), folder.begin(), folder.end()).second == folder.end();
}

// Sorted, so that the first error does not depend on the file system. `root` is canonical.
Result<std::vector<fs::path>> files_below(const fs::path& root) {
  std::vector<fs::path> files;
  std::error_code error;
  for (fs::recursive_directory_iterator at(root, error), end; !error && at != end; at.increment(error)) {
    if (is_hidden(at->path())) {
      at.disable_recursion_pending();
      continue;
    }
    std::error_code ignored;
    if (!at->is_regular_file(ignored)) continue;
    const fs::path real = fs::canonical(at->path(), ignored);
    if (ignored || !lies_in(real, root)) continue;
    if (files.size() == kMaxStaticFiles) return fail("more than " + std::to_string(kMaxStaticFiles) + " files in " + root.string());
    files.push_back(at->path());
  }
  if (error) return fail("cannot read the folder " + root.string() + ": " + error.message());
  std::sort(files.begin(), files.end());
  return files;
}

// Fails at more than `room` bytes, even if the file grows while it is read.
Result<std::string> read_file(const fs::path& path, std::size_t room) {
  std::ifstream in(path, std::ios::binary);
  std::string bytes;
  std::array<char, 1 << 16> piece{};
  while (in && bytes.size() <= room) {
    in.read(piece.data(), piece.size());
    bytes.append(piece.data(), static_cast<std::size_t>(in.gcount()));
  }
  if (bytes.size() > room) return fail("more than " + std::to_string(kMaxStaticBytes >> 20) + " MiB of files, with " + path.string());
  if (!in.eof()) return fail("cannot read " + path.string());
  return bytes;
}

StaticContent content_of(std::string bytes) {
  std::string tag = fmt::format("\"{:016x}\"", XXH3_64bits(bytes.data(), bytes.size()));
  return {std::make_shared<const std::string>(std::move(bytes)), std::move(tag)};
}

// parameters: those of "gzip;q=0.5". A malformed weight counts as 0.
bool has_weight(std::string_view parameters) {
  while (!parameters.empty()) {
    const std::string_view parameter = split_off(parameters, ';');
    if (!iequals(parameter.substr(0, 2), "q=")) continue;
    double weight = 0;
    const auto [stop, failure] = std::from_chars(parameter.data() + 2, parameter.data() + parameter.size(), weight, std::chars_format::fixed);
    return failure == std::errc() && stop == parameter.data() + parameter.size() && weight > 0 && weight <= 1;
  }
  return true;
}

}  // namespace

Result<StaticFiles> StaticFiles::load(const fs::path& folder) {
  std::error_code error;
  const fs::path root = fs::canonical(folder, error);
  if (error) return fail("cannot read the folder " + folder.string() + ": " + error.message());
  const auto paths = files_below(root);
  if (!paths) return tl::unexpected(paths.error());
  std::map<std::string, std::string> contents;
  std::size_t room = kMaxStaticBytes;
  for (const fs::path& path : *paths) {
    auto bytes = read_file(path, room);
    if (!bytes) return tl::unexpected(bytes.error());
    room -= bytes->size();
    contents.emplace("/" + path.lexically_relative(root).generic_string(), std::move(*bytes));
  }
  StaticFiles files;
  for (auto& [path, bytes] : contents) {
    if (path.ends_with(".gz") && contents.contains(path.substr(0, path.size() - 3))) continue;
    StaticFile file{type_of(path), has_hash_in_name(path), content_of(std::move(bytes)), {}};
    if (const auto gzip = contents.find(path + ".gz"); gzip != contents.end()) file.gzip = content_of(std::move(gzip->second));
    files.files_.emplace(path, std::move(file));
  }
  if (files.find("/") == nullptr) return fail("no index.html in " + folder.string());
  return files;
}

const StaticFile* StaticFiles::find(std::string_view path) const {
  const auto found = files_.find(path == "/" ? "/index.html" : path);
  return found == files_.end() ? nullptr : &found->second;
}

std::optional<std::string> decode_path(std::string_view target) {
  std::string_view rest = target.substr(0, target.find('?'));
  if (!rest.starts_with('/')) return {};
  std::string path;
  while (!rest.empty()) {
    char c = rest.front();
    rest.remove_prefix(1);
    if (c == '%') {
      unsigned char byte = 0;
      if (rest.size() < 2 || std::from_chars(rest.data(), rest.data() + 2, byte, 16).ptr != rest.data() + 2) return {};
      c = static_cast<char>(byte);
      rest.remove_prefix(2);
    }
    if (c == '\0') return {};
    path += c;
  }
  return path;
}

bool accepts_gzip(std::string_view accept_encoding) {
  bool any = false;
  while (!accept_encoding.empty()) {
    std::string_view item = split_off(accept_encoding, ',');
    const std::string_view coding = split_off(item, ';');
    if (iequals(coding, "gzip") || iequals(coding, "x-gzip")) return has_weight(item);
    if (coding == "*") any = has_weight(item);
  }
  return any;
}

bool matches_etag(std::string_view if_none_match, std::string_view etag) {
  if (trimmed(if_none_match) == "*") return true;
  while (!if_none_match.empty()) {
    std::string_view tag = split_off(if_none_match, ',');  // our tags hold no comma
    if (tag.starts_with("W/")) tag.remove_prefix(2);
    if (tag == etag) return true;
  }
  return false;
}

}  // namespace intervale
