// A program for a format that is not there, as where a package is installed in part.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "tests/support/complaints.h"
#include "tests/support/library_files.h"
#include "tests/support/programs.h"
#include "tests/support/temp_dir.h"

namespace intervale {
namespace {

TEST(MissingReader, IsToldInOneLine) {
  const TempDir folder;
  const auto alone = folder / "a/b/bin";  // deep, as libexec is looked for above
  std::filesystem::create_directories(alone);
  std::filesystem::copy_file(program("intervale"), alone / "intervale");
  const auto tiff = folder.file("v.tif", testing::tiff_file(3, 2, {{1, 2, 3, 4, 5, 6}, {1, 2, 3, 4, 5, 6}}));
  const auto dicom = folder.file("v.dcm", testing::dicom_file({}));
  const auto hdf5 = folder.file("v.h5", "\x89HDF\r\n\x1a\n");
  std::filesystem::create_directory(folder / "v.zarr");
  static_cast<void>(folder.file("v.zarr/.zgroup", "{}"));
  const struct {
    std::filesystem::path file;
    std::string about;
  } cases[] = {{tiff, "v.tif' is TIFF, which needs the program 'read-tiff': it is not installed beside this one"},
               {dicom, "v.dcm' is DICOM, which needs the program 'read-dicom'"},
               {hdf5, "v.h5' is HDF5, which needs the program 'read-hdf5'"},
               {folder / "v.zarr", "v.zarr' is Zarr, which needs the program 'read-zarr'"}};
  for (const auto& [file, about] : cases) {
    expect_complaint(run({alone / "intervale", "info", file}), 1, about, "intervale: ");
    expect_complaint(run({alone / "intervale", "build", file, "-o", folder / "v.ivm"}), 1, about, "intervale: ");
    EXPECT_FALSE(std::filesystem::exists(folder / "v.ivm"));
  }
}

}  // namespace
}  // namespace intervale
