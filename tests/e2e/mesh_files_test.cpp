// Mesh files as other people's programs read them.
#include <gtest/gtest.h>
#include <unistd.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/support/complaints.h"
#include "tests/support/programs.h"
#include "tests/support/temp_dir.h"

namespace intervale {
namespace {

// Extracts a .vtu and a .vtp, and has VTK and meshio read them.
void expect_readable(const std::filesystem::path& ivm, const std::vector<std::string>& lod) {
  const TempDir folder;
  std::vector<std::string> reader{kPython, INTERVALE_E2E "/peers/read_mesh.py"};
  nlohmann::json extracted;
  for (const char* name : {"mesh.vtu", "mesh.vtp"}) {
    std::vector<std::string> extract{program("intervale"), "extract", ivm, "--json", "-o", folder / name};
    extract.insert(extract.end(), lod.begin(), lod.end());
    extracted = json_of(run(extract));
    reader.push_back(folder / name);
  }
  for (const char* key : {"vertices", "tets", "volume"}) reader.push_back(extracted.at(key).dump());
  const Finished finished = run(reader);
  EXPECT_EQ(finished.status, 0);
  EXPECT_EQ(finished.out, "");
  EXPECT_EQ(finished.err, "");
}

TEST(MeshFiles, VtkAndMeshioReadWhatExtractWrites) {
  if (::access(kPython, X_OK) != 0 || run({kPython, "-c", "import meshio, vtk"}).status != 0)
    GTEST_SKIP() << "no python3-vtk9 and python3-meshio here";
  for (const std::vector<std::string>& lod : std::vector<std::vector<std::string>>{{}, {"--error-percent", "20"}}) expect_readable(buckyball(), lod);

  const TempDir folder;
  const auto raw = folder.file("zeros.raw", std::string(27, '\0'));
  const auto built =
      run({program("intervale"), "build", raw, "--dims", "3", "3", "3", "--type", "u8", "--range", "1", "2", "-o", folder / "empty.ivm"});
  ASSERT_EQ(built.status, 0) << built.err;
  SCOPED_TRACE("an empty mesh");
  expect_readable(folder / "empty.ivm", {});
}

}  // namespace
}  // namespace intervale
