// HDF5 files, which a program of its own reads. Made by the library itself, where there is one.
#if __has_include(<hdf5.h>)
#include <gtest/gtest.h>
#include <hdf5.h>
#include <hdf5_hl.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include "common/patch/visit_samples.h"
#include "server/volume/read_volume.h"
#include "tests/support/temp_dir.h"

namespace intervale {
namespace {

class Hdf5 : public ::testing::Test {
 protected:
  // Numbers from `first` on, z, y, x, perhaps with time before them.
  static void add(hid_t file, const char* name, const std::vector<hsize_t>& dims, int first, bool is_packed = false) {
    std::vector<std::int16_t> numbers(std::accumulate(dims.begin(), dims.end(), hsize_t(1), std::multiplies<>()));
    std::iota(numbers.begin(), numbers.end(), std::int16_t(first));
    const hid_t space = H5Screate_simple(int(dims.size()), dims.data(), nullptr), how = H5Pcreate(H5P_DATASET_CREATE);
    if (is_packed) {
      H5Pset_chunk(how, int(dims.size()), dims.data());
      H5Pset_deflate(how, 6);
    }
    const hid_t set = H5Dcreate2(file, name, H5T_STD_I16BE, space, H5P_DEFAULT, how, H5P_DEFAULT);
    H5Dwrite(set, H5T_NATIVE_INT16, H5S_ALL, H5S_ALL, H5P_DEFAULT, numbers.data());
    H5Dclose(set);
    H5Pclose(how);
    H5Sclose(space);
  }
  static void add_attribute(hid_t file, const char* set_name, const char* name, const std::vector<double>& numbers) {
    const hid_t set = H5Dopen2(file, set_name, H5P_DEFAULT);
    const hsize_t count = numbers.size();
    const hid_t space = H5Screate_simple(1, &count, nullptr);
    const hid_t attribute = H5Acreate2(set, name, H5T_IEEE_F64LE, space, H5P_DEFAULT, H5P_DEFAULT);
    H5Awrite(attribute, H5T_NATIVE_DOUBLE, numbers.data());
    H5Aclose(attribute);
    H5Sclose(space);
    H5Dclose(set);
  }
  // A coordinate variable of NetCDF for an axis of an array.
  static void add_scale(hid_t file, const char* name, const std::vector<double>& at, const char* set_name, unsigned axis, bool is_single = false) {
    const hsize_t count = at.size();
    const hid_t space = H5Screate_simple(1, &count, nullptr);
    const hid_t scale = H5Dcreate2(file, name, is_single ? H5T_IEEE_F32LE : H5T_IEEE_F64LE, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    const hid_t set = H5Dopen2(file, set_name, H5P_DEFAULT);
    H5Dwrite(scale, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, at.data());
    H5DSset_scale(scale, name);
    H5DSattach_scale(set, scale, axis);
    H5Dclose(set);
    H5Dclose(scale);
    H5Sclose(space);
  }
  [[nodiscard]] hid_t create() const { return H5Fcreate(path_.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT); }
  const TempDir folder_;
  const std::filesystem::path path_ = folder_ / "v.h5";
};

std::vector<double> numbers_in(const Volume& volume) {
  return visit_samples(volume, [](auto samples) { return std::vector<double>(samples.begin(), samples.end()); });
}

TEST_F(Hdf5, ArraysHaveTheAxesZYX) {
  const hid_t file = create();
  add(file, "density", {4, 3, 2}, 100, true);
  add_attribute(file, "density", "element_size_um", {3, 2, 0.5});
  add_attribute(file, "density", "scale_factor", {2});
  add_attribute(file, "density", "add_offset", {-1});
  add(file, "flat", {4, 3}, 0);
  H5Fclose(file);
  const auto volume = read_volume(path_, {});
  ASSERT_TRUE(volume) << volume.error().message;
  EXPECT_EQ(volume->grid.dims, (std::array<std::int32_t, 3>{2, 3, 4}));
  EXPECT_EQ(volume->grid.affine, Affine::of({0.5, 2, 3}));
  EXPECT_EQ(volume->labels.unit, "\u00b5m");
  EXPECT_EQ(volume->labels.field, "density");
  for (std::size_t i = 0; i < 24; ++i) EXPECT_EQ(numbers_in(*volume)[i], 2 * (100 + double(i)) - 1) << i;
}

TEST_F(Hdf5, OneOfSeveralArraysIsChosen) {
  const hid_t file = create();
  add(file, "a", {2, 3, 4}, 0);
  add(file, "later", {3, 2, 3, 4}, 0);
  H5Fclose(file);
  const auto unchosen = read_volume(path_, {});
  ASSERT_FALSE(unchosen);
  EXPECT_TRUE(unchosen.error().usage);
  EXPECT_NE(unchosen.error().message.find("2 arrays: choose one with --part: /a (4 x 3 x 2 of i16), /later (4 x 3 x 2 of i16, 3 time points)"),
            std::string::npos)
      << unchosen.error().message;
  const auto named = named_volume(path_.string() + ":/later");
  EXPECT_EQ(named.path, path_);
  const auto volume = read_volume(named.path, {}, 2, named.part);
  ASSERT_TRUE(volume) << volume.error().message;
  EXPECT_EQ(numbers_in(*volume)[0], 48);
  EXPECT_FALSE(read_volume(path_, {}, 3, "/later"));
  EXPECT_FALSE(read_volume(path_, {}, {}, "/none"));
}

TEST_F(Hdf5, CoordinatesPlaceSamplesIfTheyAreEven) {
  const hid_t file = create();
  add(file, "t", {4, 3, 2}, 0);
  add_scale(file, "depth", {5, 7, 9, 11}, "t", 0);
  add_scale(file, "lat", {179.98, 179.99, 180}, "t", 1, true);  // rounded by more than a thousandth of the step
  add_scale(file, "nothing", {0, 0}, "t", 2);                   // as of a dimension without a variable
  H5Fclose(file);
  const auto volume = read_volume(path_, {});
  ASSERT_TRUE(volume) << volume.error().message;
  EXPECT_EQ(volume->grid.affine.spacing()[2], 2);
  EXPECT_EQ(volume->grid.affine.origin()[2], 5);
  EXPECT_NEAR(volume->grid.affine.spacing()[1], 0.01, 1e-4);
  EXPECT_EQ(volume->grid.affine.spacing()[0], 1);
}

TEST_F(Hdf5, UnevenCoordinatesAreRefusedByName) {
  const hid_t file = create();
  add(file, "t", {4, 3, 2}, 0);
  add_scale(file, "depth", {5, 7, 9, 25}, "t", 0);
  H5Fclose(file);
  const auto volume = read_volume(path_, {});
  ASSERT_FALSE(volume);
  EXPECT_NE(volume.error().message.find("'/depth' is not evenly spaced: from index 2 to 3 it goes from 9 to 25, where the usual step is 2"),
            std::string::npos)
      << volume.error().message;
}

// Samples from 0 on, in steps of 1, of which 5 stands for no value.
TEST_F(Hdf5, FillValuesAreNoValues) {
  const auto read_with = [this](const char* attribute, const std::vector<double>& missing, double slope, double offset) {
    const hid_t file = create();
    add(file, "t", {2, 2, 2}, 0);
    add_attribute(file, "t", attribute, missing);
    if (slope != 1) add_attribute(file, "t", "scale_factor", {slope});
    if (offset != 0) add_attribute(file, "t", "add_offset", {offset});
    H5Fclose(file);
    return read_volume(path_, {});
  };
  struct Case {
    double slope, offset;
    SampleType type;
  };
  for (const auto& [slope, offset, type] : {Case{1, 0, SampleType::f32}, Case{0.01, 27300, SampleType::f64}, Case{0.5, 100, SampleType::f32}}) {
    for (const char* attribute : {"_FillValue", "missing_value"}) {
      auto volume = read_with(attribute, {-7, 5}, slope, offset);
      ASSERT_TRUE(volume) << volume.error().message;
      EXPECT_EQ(volume->type, type);
      const auto numbers = numbers_in(*volume);
      EXPECT_TRUE(std::isnan(numbers[5]));
      EXPECT_NEAR(numbers[6], 6 * slope + offset, 1e-6);
      const auto finite = check_finite(*volume, {});
      ASSERT_FALSE(finite);
      EXPECT_NE(finite.error().message.find("sample (1, 0, 1) of 'v' is NaN"), std::string::npos) << finite.error().message;
      ASSERT_TRUE(check_finite(*volume, -1));
      EXPECT_EQ(numbers_in(*volume)[5], -1);
    }
  }
  const auto none = read_with("_FillValue", {-32768, 5.5, 1e300}, 1, 0);  // of which there are none
  ASSERT_TRUE(none) << none.error().message;
  EXPECT_EQ(none->type, SampleType::i16);
  EXPECT_EQ(numbers_in(*none)[5], 5);
}

// Half of an array is written; of bytes, and of files of other programs, the rest is as it is.
TEST_F(Hdf5, WhatWasNeverWrittenToNetcdfIsMissing) {
  for (const bool is_netcdf : {true, false}) {
    for (const hid_t type : {H5T_IEEE_F32LE, H5T_STD_I16LE, H5T_STD_I8LE}) {
      const hid_t file = create();
      const std::vector<hsize_t> dims{2, 2, 2}, half{1, 2, 2}, none{0, 0, 0};
      const double filler = type == H5T_IEEE_F32LE ? 9.9692099683868690e+36 : type == H5T_STD_I16LE ? -32767 : -127;
      const std::vector<float> numbers{1, 2, 3, 4};
      const hid_t how = H5Pcreate(H5P_DATASET_CREATE), space = H5Screate_simple(3, dims.data(), nullptr),
                  part = H5Screate_simple(3, half.data(), nullptr);
      H5Pset_fill_value(how, H5T_NATIVE_DOUBLE, &filler);
      const hid_t set = H5Dcreate2(file, "t", type, space, H5P_DEFAULT, how, H5P_DEFAULT);
      H5Sselect_hyperslab(space, H5S_SELECT_SET, none.data(), nullptr, half.data(), nullptr);
      H5Dwrite(set, H5T_NATIVE_FLOAT, part, space, H5P_DEFAULT, numbers.data());
      if (is_netcdf) {
        const hid_t scalar = H5Screate(H5S_SCALAR), attribute = H5Acreate2(file, "_NCProperties", H5T_STD_I32LE, scalar, H5P_DEFAULT, H5P_DEFAULT);
        H5Aclose(attribute);
        H5Sclose(scalar);
      }
      H5Dclose(set);
      H5Sclose(part);
      H5Sclose(space);
      H5Pclose(how);
      H5Fclose(file);
      const auto volume = read_volume(path_, {});
      ASSERT_TRUE(volume) << volume.error().message;
      const bool is_missing = is_netcdf && type != H5T_STD_I8LE;
      for (std::size_t i = 0; i < 8; ++i) {
        EXPECT_EQ(std::isnan(numbers_in(*volume)[i]), is_missing && i >= 4) << i;
        EXPECT_TRUE(i >= 4 || numbers_in(*volume)[i] == double(i + 1)) << i;
      }
    }
  }
}

TEST_F(Hdf5, FillValuesOfFloatsAreComparedAsTheyAreStored) {
  const hid_t file = create();
  const std::vector<hsize_t> dims{2, 2, 2};
  const std::vector<float> numbers{0.1F, 1e20F, 2, 3, 4, 5, 6, 7};
  const hid_t space = H5Screate_simple(3, dims.data(), nullptr);
  const hid_t set = H5Dcreate2(file, "t", H5T_IEEE_F32LE, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
  H5Dwrite(set, H5T_NATIVE_FLOAT, H5S_ALL, H5S_ALL, H5P_DEFAULT, numbers.data());
  H5Dclose(set);
  H5Sclose(space);
  add_attribute(file, "t", "_FillValue", {0.1});
  add_attribute(file, "t", "missing_value", {1e20});
  add_attribute(file, "t", "scale_factor", {2});
  H5Fclose(file);
  const auto volume = read_volume(path_, {});
  ASSERT_TRUE(volume) << volume.error().message;
  EXPECT_EQ(volume->type, SampleType::f32);
  for (std::size_t i = 0; i < 8; ++i) {
    const double number = numbers_in(*volume)[i];
    EXPECT_EQ(std::isnan(number), i < 2) << i;
    EXPECT_TRUE(i < 2 || number == 2.0 * double(i)) << i;
  }
}

// A file of a few bytes may claim any number of samples, and name other files for them.
TEST_F(Hdf5, OnlyTheFileItselfHasSamples) {
  const hid_t file = create();
  const std::vector<hsize_t> huge{100'000, 100'000, 1000}, chunk{1, 1000, 1000}, small{2, 2, 2};
  hid_t space = H5Screate_simple(3, huge.data(), nullptr), how = H5Pcreate(H5P_DATASET_CREATE);
  H5Pset_chunk(how, 3, chunk.data());
  H5Dclose(H5Dcreate2(file, "claims", H5T_STD_U8LE, space, H5P_DEFAULT, how, H5P_DEFAULT));
  H5Pclose(how);
  H5Sclose(space);
  space = H5Screate_simple(3, small.data(), nullptr);
  how = H5Pcreate(H5P_DATASET_CREATE);
  H5Pset_external(how, "/etc/passwd", 0, 8);
  H5Dclose(H5Dcreate2(file, "elsewhere", H5T_STD_U8LE, space, H5P_DEFAULT, how, H5P_DEFAULT));
  H5Pclose(how);
  H5Sclose(space);
  H5Fclose(file);
  const auto claims = read_volume(path_, {}, {}, "/claims");
  ASSERT_FALSE(claims);
  EXPECT_NE(claims.error().message.find("which cannot be the 10000000000000 of its samples"), std::string::npos) << claims.error().message;
  EXPECT_FALSE(read_volume(path_, {}, {}, "/elsewhere"));
}

class DamagedHdf5 : public Hdf5, public ::testing::WithParamInterface<int> {};

// Most of its bytes say what is in it: 24 numbers, coordinates and attributes.
TEST_P(DamagedHdf5, DoesNoHarm) {
  const hid_t file = create();
  add(file, "a", {4, 3, 2}, 0, true);
  add_attribute(file, "a", "_FillValue", {5});
  add_attribute(file, "a", "scale_factor", {0.5});
  add_scale(file, "z", {1, 2, 3, 4}, "a", 0);
  H5Fclose(file);
  const std::string whole = contents_of(path_);
  std::mt19937 random(unsigned(GetParam()) + 5);
  for (int trial = 0; trial < 50; ++trial) {
    std::string bytes = whole;
    const std::size_t end = trial % 2 == 0 ? std::min<std::size_t>(bytes.size(), 2048) : bytes.size();
    for (int k = 0; k < 1 + trial / 10; ++k) bytes[8 + random() % (end - 8)] = char(random());
    if (trial % 10 == 0) bytes.resize(8 + random() % (bytes.size() - 8));
    const auto volume = read_volume(folder_.file("damaged", bytes), {}, 0, "/a");
    if (volume) {
      EXPECT_EQ(volume->bytes.size(), volume->grid.sample_count() * size_of(volume->type));
    } else {
      EXPECT_EQ(volume.error().message.find('\n'), std::string::npos) << volume.error().message;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Fifty, DamagedHdf5, ::testing::Range(0, 5));

}  // namespace
}  // namespace intervale
#endif
