// Runs a fuzz target over files, where there is no libFuzzer: replay FOLDER|FILE...
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace {

void replay(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  const std::vector<char> bytes(std::istreambuf_iterator<char>(in), {});
  const auto exact = std::make_unique<std::uint8_t[]>(bytes.size());  // so that the address sanitizer sees every step beyond
  std::copy(bytes.begin(), bytes.end(), exact.get());
  std::printf("%s\n", path.c_str());
  std::fflush(stdout);  // before the target, which may crash
  LLVMFuzzerTestOneInput(exact.get(), bytes.size());
}

}  // namespace

int main(int argc, char** argv) {
  int files = 0;
  for (int i = 1; i < argc; ++i) {
    if (!std::filesystem::is_directory(argv[i])) {
      replay(argv[i]);
      ++files;
      continue;
    }
    for (const auto& entry : std::filesystem::directory_iterator(argv[i])) {
      replay(entry.path());
      ++files;
    }
  }
  if (files == 0) std::fputs("no file to replay\n", stderr);
  return files == 0 ? 1 : 0;
}
