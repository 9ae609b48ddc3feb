// An array of an HDF5 file, NetCDF-4 and MATLAB 7.3 among them, by libhdf5: a program of its own, see child_reader.h.
//
// Arrays of three axes are z, y, x, as in C; of four axes the first one is time. Attributes that are read: units, long_name,
// scale_factor and add_offset (CF conventions, sections 3.1, 3.2, 8.1), and those of hdf5_axes.h and
// hdf5_missing.h.
#include <hdf5.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "server/readers/hdf5_axes.h"
#include "server/readers/hdf5_missing.h"
#include "server/readers/hdf5_object.h"
#include "server/readers/reader_program.h"

namespace intervale {
namespace {

constexpr std::size_t kMostArrays = 10'000;
constexpr std::uint64_t kGreatestRatio = 10'000;  // of compression; sparse arrays and filters of high ratio are below

Handle dataset_of(hid_t file, const std::string& name) { return {H5Dopen2(file, name.c_str(), H5P_DEFAULT), H5Dclose}; }

// An array that is a volume.
struct Array {
  std::string name;
  std::vector<hsize_t> dims;  // three: z, y, x; or four: time before them
  SampleType type = SampleType::u8;
  [[nodiscard]] std::uint64_t times() const { return dims.size() == 4 ? dims[0] : 1; }
  [[nodiscard]] const hsize_t* zyx() const { return dims.data() + dims.size() - 3; }
};

std::optional<SampleType> type_of(hid_t dataset) {
  const Handle type(H5Dget_type(dataset), H5Tclose);
  const std::size_t size = type.is_open() ? H5Tget_size(type.get()) : 0;
  const H5T_class_t kind = H5Tget_class(type.get());
  if (kind == H5T_FLOAT) return size <= 4 ? SampleType::f32 : SampleType::f64;
  if (kind != H5T_INTEGER) return {};
  const bool is_signed = H5Tget_sign(type.get()) == H5T_SGN_2;
  switch (size) {
    case 1:
      return is_signed ? SampleType::i8 : SampleType::u8;
    case 2:
      return is_signed ? SampleType::i16 : SampleType::u16;
    case 4:
      return is_signed ? SampleType::i32 : SampleType::u32;
    default:
      return {};
  }
}

// In SampleType's order.
hid_t memory_type(SampleType type) {
  const std::array<hid_t, 8> kTypes{H5T_NATIVE_UINT8,  H5T_NATIVE_INT8,  H5T_NATIVE_UINT16, H5T_NATIVE_INT16,
                                    H5T_NATIVE_UINT32, H5T_NATIVE_INT32, H5T_NATIVE_FLOAT,  H5T_NATIVE_DOUBLE};
  return kTypes[std::size_t(type)];
}

// Numbers of three axes or four, all longer than 1 but for time.
std::optional<Array> array_of(hid_t file, const std::string& name) {
  const Handle dataset = dataset_of(file, name);
  if (!dataset.is_open() || !is_in_file(dataset.get())) return {};
  Array array{name, dims_of(dataset.get()), {}};
  const auto type = type_of(dataset.get());
  if (!type || (array.dims.size() != 3 && array.dims.size() != 4)) return {};
  if (std::any_of(array.zyx(), array.zyx() + 3, [](hsize_t n) { return n < 2 || n > hsize_t(kMaxSide); }) || array.times() == 0) return {};
  array.type = *type;
  return array;
}

// All datasets; links out of the file are not followed.
std::vector<std::string> names_in(hid_t file) {
  std::vector<std::string> names;
  const auto visit = [](hid_t, const char* name, const H5O_info_t* info, void* to) -> herr_t {
    auto& all = *static_cast<std::vector<std::string>*>(to);
    if (info->type == H5O_TYPE_DATASET) all.push_back(std::string("/") + name);
    return all.size() > kMostArrays ? 1 : 0;
  };
  H5Ovisit2(file, H5_INDEX_NAME, H5_ITER_INC, visit, &names, H5O_INFO_BASIC);
  return names;
}

double scalar(hid_t object, const char* name, double otherwise) {
  const auto numbers = numbers_of_attribute(object, name, 1);
  return numbers.empty() ? otherwise : numbers[0];
}

Result<VolumeHeader> header_of(hid_t file, const Array& array, const std::string& where) {
  const Handle dataset = dataset_of(file, array.name);
  VolumeHeader header;
  header.parts_are = "arrays";
  header.type = array.type;
  header.time_points = array.times();
  header.slope = scalar(dataset.get(), "scale_factor", 1);
  header.intercept = scalar(dataset.get(), "add_offset", 0);
  if (header.slope == 0) header.slope = 1;
  const std::string field = text_of_attribute(dataset.get(), "long_name"), unit = text_of_attribute(dataset.get(), "units");
  const std::string name = array.name.substr(array.name.rfind('/') + 1);
  if (is_label(field.empty() ? name : field)) header.labels.field = field.empty() ? name : field;
  if (is_label(unit)) header.labels.field_unit = unit;
  const auto* const n = array.zyx();
  auto places = places_of(dataset.get(), {n[0], n[1], n[2]}, where);
  if (!places) return tl::unexpected<Error>(places.error());
  header.labels.unit = places->unit;
  const auto grid = make_grid({std::int64_t(n[2]), std::int64_t(n[1]), std::int64_t(n[0])}, places->affine, where);
  if (!grid) return tl::unexpected<Error>(grid.error());
  header.grid = *grid;
  if (auto size = check_size(header, where); !size) return tl::unexpected<Error>(size.error());
  const std::uint64_t bytes = header.data_bytes() * header.time_points;
  if (bytes / kGreatestRatio > H5Dget_storage_size(dataset.get()))
    return fail(where + ": '" + array.name + "' has " + std::to_string(H5Dget_storage_size(dataset.get())) + " bytes, which cannot be the " +
                std::to_string(bytes) + " of its samples");
  return header;
}

// Some slices of z, in the type of the array. Fails to stop.
using TakeSlices = std::function<Result<void>(std::span<const std::byte> samples)>;

Result<void> read_slices(hid_t file, const Array& array, const ReaderRequest& request, const TakeSlices& take) {
  if (request.time_point >= array.times()) return misuse(in_quotes(request.path) + " has no time point of that number: the first is 0");
  const Handle dataset = dataset_of(file, array.name), space(H5Dget_space(dataset.get()), H5Sclose);
  const std::size_t rank = array.dims.size();
  std::vector<hsize_t> start(rank, 0), count = array.dims;
  // A chunk may have several slices: they are read at once if they are not long.
  constexpr std::uint64_t kBytes = 64 << 20;
  const std::uint64_t slice = array.zyx()[1] * array.zyx()[2] * size_of(array.type);
  const hsize_t step = std::max<std::uint64_t>(1, std::min<std::uint64_t>(array.zyx()[0], kBytes / slice));
  std::vector<std::byte> samples;
  if (rank == 4) start[0] = request.time_point, count[0] = 1;
  for (hsize_t z = 0; z < array.zyx()[0]; z += step) {
    start[rank - 3] = z;
    count[rank - 3] = std::min<hsize_t>(step, array.zyx()[0] - z);
    samples.resize(slice * count[rank - 3]);
    const Handle memory(H5Screate_simple(int(rank), count.data(), nullptr), H5Sclose);
    const bool is_read = H5Sselect_hyperslab(space.get(), H5S_SELECT_SET, start.data(), nullptr, count.data(), nullptr) >= 0 &&
                         H5Dread(dataset.get(), memory_type(array.type), memory.get(), space.get(), H5P_DEFAULT, samples.data()) >= 0;
    if (!is_read)
      return fail(in_quotes(request.path) + ": '" + array.name + "' cannot be read from slice " + std::to_string(z + 1) +
                  " on; is it damaged, or compressed by a filter that is not installed?");
    if (auto taken = take(samples); !taken) return taken;
  }
  return {};
}

// Writes the header and the samples. Integers some of which are no values become floats, as the header must say before: so
// they are read twice.
Result<void> write_volume(hid_t file, const Array& array, VolumeHeader header, const ReaderRequest& request) {
  const MissingNumbers missing = MissingNumbers::of(dataset_of(file, array.name).get());
  const double slope = header.slope, intercept = header.intercept;
  if (missing.any() && !is_float(array.type) && request.time_point < array.times()) {
    bool are_there = false;
    auto looked = read_slices(file, array, request, [&](std::span<const std::byte> samples) -> Result<void> {
      are_there = missing.are_in(samples, array.type);
      return are_there ? fail("") : Result<void>();
    });
    if (!looked && !are_there) return looked;
    if (are_there) {
      header.type = float_type_for(array.type, slope, intercept);
      header.slope = 1, header.intercept = 0;
    }
  }
  if (auto written = write_header(header); !written) return written;
  const bool are_changed = missing.any() && is_float(header.type);
  return read_slices(file, array, request, [&](std::span<const std::byte> samples) {
    return are_changed ? write_samples(missing.as_nan(samples, array.type, header.type, slope, intercept)) : write_samples(samples);
  });
}

Result<void> read(const ReaderRequest& request) {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  const std::string name = in_quotes(request.path);
  const Handle file(H5Fopen(request.path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose);
  if (!file.is_open()) return fail(name + " cannot be read as HDF5; is it damaged or cut short?");
  std::vector<Array> arrays;
  for (const std::string& one : names_in(file.get())) {
    if (auto array = array_of(file.get(), one)) arrays.push_back(std::move(*array));
  }
  if (arrays.empty()) return fail(name + " has no array of numbers with three axes, or four of which the first is time");
  auto chosen = arrays.begin();
  if (request.part) {
    const std::string wanted = request.part->starts_with('/') ? *request.part : "/" + *request.part;
    chosen = std::find_if(arrays.begin(), arrays.end(), [&](const Array& array) { return array.name == wanted; });
    if (chosen == arrays.end()) return misuse(name + " has no array '" + wanted + "' that is a volume");
  }
  auto header = header_of(file.get(), *chosen, name);
  while (!header && !request.part && ++chosen != arrays.end()) {  // the first that is whole
    if (auto other = header_of(file.get(), *chosen, name)) header = std::move(other);
  }
  if (!header) return tl::unexpected<Error>(header.error());
  for (const Array& array : arrays) {
    if (arrays.size() == 1) break;
    const auto* const n = array.zyx();
    header->parts.push_back({array.name, std::to_string(n[2]) + " x " + std::to_string(n[1]) + " x " + std::to_string(n[0]) + " of " +
                                             name_of(array.type) +
                                             (array.dims.size() == 4 ? ", " + std::to_string(array.times()) + " time points" : "")});
  }
  return request.only_header ? write_header(*header) : write_volume(file.get(), *chosen, *std::move(header), request);
}

}  // namespace
}  // namespace intervale

int main(int argc, char** argv) { intervale::run_reader(argc, argv, intervale::read); }
