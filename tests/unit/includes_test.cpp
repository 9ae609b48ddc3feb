// The layers of the code: a folder includes only itself and folders of lower layers. kLayers is the only list of them.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <string>

namespace {

namespace fs = std::filesystem;

const std::map<std::string, int> kLayers{
    {"common/util", 1},    {"common/diamond", 2},     {"common/parallel", 2},                                                    //
    {"common/patch", 3},   {"common/view", 3},        {"common/mesh", 3},       {"common/mesh/io", 4},                           //
    {"common/codec", 5},   {"common/picture", 5},     {"common/program", 5},    {"common/remote", 8},                            //
    {"common/front", 6},   {"common/ivm", 7},         {"common/selection", 8},  {"common/ranges", 8},     {"common/api", 9},     //
    {"protocol", 9},       {"protocol/transport", 9}, {"protocol/session", 10},                                                  //
    {"client/core", 10},   {"client/net", 11},        {"client/view", 11},      {"client/program", 12},   {"client/local", 11},  //
    {"client/cli", 13},    {"client/load", 13},       {"client/web/core", 13},  {"client/web/local", 13}, {"client/api", 12},    //
    {"server/volume", 10}, {"server/readers", 11},    {"server/builder", 11},   {"server/serve", 12},     {"server/cli", 13},
    {"server/api", 12},    {"server/scratch", 2},     {"server/resume", 12},    {"server/cluster", 12},   {"server/mpi", 14},  //
};

// The folder of the table that a file lies in: the longest that is a prefix of its path. Empty if there is none.
std::string folder_of(const std::string& path) {
  std::string folder = fs::path(path).parent_path().generic_string();
  while (!folder.empty() && !kLayers.contains(folder)) folder = fs::path(folder).parent_path().generic_string();
  return folder;
}

// Whether a file of one folder may include a header of another.
bool may_include(const std::string& from, const std::string& to) {
  if (from == to) return true;
  const bool crosses = (from.starts_with("client/") && to.starts_with("server/")) || (from.starts_with("server/") && to.starts_with("client/"));
  return !crosses && kLayers.at(to) < kLayers.at(from);
}

}  // namespace

TEST(Includes, GoDownOnly) {
  const fs::path root = INTERVALE_SOURCES;
  std::set<std::string> seen;
  int includes = 0;
  for (const char* top : {"common", "protocol", "server", "client"}) {
    for (const auto& entry : fs::recursive_directory_iterator(root / top)) {
      const auto extension = entry.path().extension();
      if (!entry.is_regular_file() || (extension != ".h" && extension != ".cpp")) continue;
      const std::string path = fs::relative(entry.path(), root).generic_string(), from = folder_of(path);
      if (path.starts_with("client/examples/") || path.starts_with("client/python/")) continue;  // they use the installed headers
      ASSERT_FALSE(from.empty()) << path << " lies in a folder that is not in the table";
      seen.insert(from);
      std::ifstream file(entry.path());
      int number = 0;
      for (std::string line; std::getline(file, line);) {
        ++number;
        if (!line.starts_with("#include \"")) continue;
        const std::string header = line.substr(10, line.find('"', 10) - 10);
        if (header.ends_with("_generated.h")) continue;  // made by flatc
        ++includes;
        EXPECT_TRUE(fs::exists(root / header)) << path << ":" << number << ": " << header << " is not a path from the top folder";
        const std::string to = folder_of(header);
        EXPECT_TRUE(!to.empty() && may_include(from, to)) << path << ":" << number << ": " << from << " must not include " << header;
      }
    }
  }
  for (const auto& [folder, layer] : kLayers) EXPECT_TRUE(seen.contains(folder)) << folder << " is in the table, but holds no C++";
  EXPECT_GT(includes, 500);
}
