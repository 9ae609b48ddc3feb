// A series of DICOM images, in a folder or a file of several frames, by GDCM: a program of its own, see child_reader.h.
#include <gdcmImageReader.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "common/patch/visit_samples.h"
#include "common/util/printable.h"
#include "server/readers/dicom_series.h"
#include "server/readers/reader_program.h"

namespace intervale {
namespace {

std::optional<SampleType> type_of(const gdcm::PixelFormat& format) {
  switch (format.GetScalarType()) {
    case gdcm::PixelFormat::UINT8:
      return SampleType::u8;
    case gdcm::PixelFormat::INT8:
      return SampleType::i8;
    case gdcm::PixelFormat::UINT12:
    case gdcm::PixelFormat::UINT16:
      return SampleType::u16;
    case gdcm::PixelFormat::INT12:
    case gdcm::PixelFormat::INT16:
      return SampleType::i16;
    case gdcm::PixelFormat::UINT32:
      return SampleType::u32;
    case gdcm::PixelFormat::INT32:
      return SampleType::i32;
    case gdcm::PixelFormat::FLOAT32:
      return SampleType::f32;
    case gdcm::PixelFormat::FLOAT64:
      return SampleType::f64;
    default:
      return {};
  }
}

// A file with its pixels.
class Pixels {
 public:
  static Result<std::unique_ptr<Pixels>> open(const std::filesystem::path& path) {
    expect_trouble_at(path);
    auto pixels = std::make_unique<Pixels>();
    pixels->path_ = path;
    pixels->reader_.SetFileName(path.c_str());
    forget_warnings();
    if (!pixels->reader_.Read()) return fail(in_quotes(path) + ": its pixels cannot be read");
    if (lacks_pixels()) return fail(in_quotes(path) + " is cut short: it has not all of its pixels");
    const gdcm::PixelFormat& format = pixels->image().GetPixelFormat();
    if (format.GetSamplesPerPixel() != 1) return fail(in_quotes(path) + " is in colour; a volume has one number a sample");
    const auto type = type_of(format);
    if (!type) return fail(in_quotes(path) + ": its pixels are no integers of 8, 16 or 32 bits and no floats");
    // Writers do not agree on the order of these bytes, and the transfer syntax is retired (PS3.5, annex A.3).
    if (format.GetBitsAllocated() == 32 &&
        pixels->reader_.GetFile().GetHeader().GetDataSetTransferSyntax() == gdcm::TransferSyntax::ExplicitVRBigEndian)
      return fail(in_quotes(path) + " has pixels of 32 bits, big endian: store it little endian first");
    pixels->type_ = *type;
    return pixels;
  }
  [[nodiscard]] const gdcm::Image& image() const { return reader_.GetImage(); }
  [[nodiscard]] SampleType type() const { return type_; }

  // All frames. count: of the pixels that there should be.
  Result<void> read(std::uint64_t count, std::vector<std::byte>& out) {
    expect_trouble_at(path_);
    const std::uint64_t bytes = count * size_of(type_);
    if (image().GetBufferLength() != bytes) return fail(in_quotes(path_) + " differs from the other images in size or type");
    out.resize(bytes);
    if (!image().GetBuffer(reinterpret_cast<char*>(out.data())))
      return fail(in_quotes(path_) + ": its pixels are damaged or coded in a way that is not read");
    extend_signs(out);
    return {};
  }

 private:
  // Some codecs leave the bits above those that are stored empty.
  void extend_signs(std::vector<std::byte>& samples) const {
    const gdcm::PixelFormat& format = image().GetPixelFormat();
    if (format.GetPixelRepresentation() != 1 || format.GetBitsStored() == 0 || format.GetHighBit() + 1 != format.GetBitsStored()) return;
    const int unused = format.GetBitsAllocated() - format.GetBitsStored();
    const Volume shape{{}, {}, type_, {}};
    visit_samples(shape, [&]<class T>(std::span<const T>) {
      if constexpr (std::is_integral_v<T>) {
        if (unused <= 0 || unused >= int(8 * sizeof(T))) return;
        for (std::size_t at = 0; at + sizeof(T) <= samples.size(); at += sizeof(T)) {
          T number;
          std::memcpy(&number, &samples[at], sizeof number);
          number = T(T(std::make_unsigned_t<T>(number) << unused) >> unused);
          std::memcpy(&samples[at], &number, sizeof number);
        }
      }
    });
  }

  std::filesystem::path path_;
  gdcm::ImageReader reader_;
  SampleType type_ = SampleType::u8;
};

// Stored numbers as values, where each image has a slope and an intercept of its own.
std::vector<std::byte> values_of(std::span<const std::byte> stored, SampleType type, const DicomImage& image) {
  std::vector<float> values;
  const auto count = stored.size() / size_of(type);
  values.reserve(count);
  const Volume shape{{}, {}, type, {}};
  visit_samples(shape, [&]<class T>(std::span<const T>) {
    for (std::size_t i = 0; i < count; ++i) {
      T number;
      std::memcpy(&number, &stored[i * sizeof(T)], sizeof number);
      values.push_back(float(image.slope * double(number) + image.intercept));
    }
  });
  std::vector<std::byte> bytes(values.size() * sizeof(float));
  std::memcpy(bytes.data(), values.data(), bytes.size());
  return bytes;
}

void set_labels(const DicomImage& image, VolumeHeader& header) {
  header.labels.space = "LPS";
  header.labels.unit = "mm";
  if (is_label(image.modality)) header.labels.field = image.modality;
  const std::string unit = image.rescale_type.empty() || image.rescale_type == "US" ? (image.modality == "CT" ? "HU" : "") : image.rescale_type;
  if (is_label(unit)) header.labels.field_unit = unit;
}

// A series of which the first file is open.
struct Opened {
  const DicomSeries* series;
  VolumeHeader header;
  std::unique_ptr<Pixels> pixels;
};

// A file of several frames: where they lie, GDCM knows from the elements of each frame.
Result<Opened> open_frames(Opened opened) {
  const DicomImage& only = opened.series->first();
  const gdcm::Image& image = opened.pixels->image();
  const double* const spacing = image.GetSpacing();
  const double* const origin = image.GetOrigin();
  const double* const axes = image.GetDirectionCosines();
  const Vec3 row{axes[0], axes[1], axes[2]}, column{axes[3], axes[4], axes[5]};
  const Affine affine = Affine::of_columns({scaled(spacing[0], row), scaled(spacing[1], column), scaled(spacing[2], cross(row, column))},
                                           {origin[0], origin[1], origin[2]});
  const auto grid = make_grid({only.columns, only.rows, only.frames}, affine, in_quotes(only.path));
  if (!grid) return tl::unexpected<Error>(grid.error());
  opened.header.grid = *grid;
  opened.header.type = opened.pixels->type();
  opened.header.slope = image.GetSlope();
  opened.header.intercept = image.GetIntercept();
  return opened;
}

// Files of one image each.
Result<Opened> open_images(Opened opened, const std::filesystem::path& path) {
  const DicomSeries& series = *opened.series;
  const DicomImage& first = series.first();
  const auto affine = affine_of(series);
  if (!affine) return tl::unexpected<Error>(affine.error());
  const auto grid = make_grid({first.columns, first.rows, std::int64_t(series.slices())}, *affine, in_quotes(path));
  if (!grid) return tl::unexpected<Error>(grid.error());
  opened.header.grid = *grid;
  opened.header.time_points = series.times;
  opened.header.type = series.has_one_scale() ? opened.pixels->type() : SampleType::f32;
  if (series.has_one_scale()) {
    opened.header.slope = first.slope;
    opened.header.intercept = first.intercept;
  }
  return opened;
}

Result<Opened> open(const DicomSeries& series, const std::filesystem::path& path) {
  auto pixels = Pixels::open(series.first().path);
  if (!pixels) return tl::unexpected<Error>(pixels.error());
  Opened opened{&series, {}, std::move(*pixels)};
  opened.header.parts_are = "series";
  set_labels(series.first(), opened.header);
  auto done = series.first().frames > 1 ? open_frames(std::move(opened)) : open_images(std::move(opened), path);
  if (!done) return done;
  if (auto size = check_size(done->header, in_quotes(path)); !size) return tl::unexpected<Error>(size.error());
  return done;
}

Result<void> write_images(Opened& opened, std::uint64_t time_point) {
  const DicomSeries& series = *opened.series;
  std::vector<std::byte> samples;
  if (series.first().frames > 1) {
    return opened.pixels->read(opened.header.grid.sample_count(), samples).and_then([&] { return write_samples(samples); });
  }
  if (time_point >= series.times) return misuse("the series has no time point of that number: the first is 0");
  const SampleType type = opened.pixels->type();
  for (std::size_t k = 0; k < series.slices(); ++k) {
    const DicomImage& image = series.at(k, time_point);
    auto pixels = k == 0 && time_point == 0 ? Result<std::unique_ptr<Pixels>>(std::move(opened.pixels)) : Pixels::open(image.path);
    if (!pixels) return tl::unexpected<Error>(pixels.error());
    if ((*pixels)->type() != type) return fail(in_quotes(image.path) + " has samples of another type than the first image");
    if (auto done = (*pixels)->read(std::uint64_t(image.columns) * std::uint64_t(image.rows), samples); !done) return done;
    if (auto written = write_samples(series.has_one_scale() ? samples : values_of(samples, type, image)); !written) return written;
  }
  return {};
}

// The series asked for, or else the first that is a volume.
Result<Opened> choose(const std::vector<DicomSeries>& all, const ReaderRequest& request) {
  if (request.part) {
    const auto found = std::find_if(all.begin(), all.end(), [&](const DicomSeries& series) { return series.part.name == *request.part; });
    if (found == all.end()) return misuse(in_quotes(request.path) + " has no series '" + printable(*request.part) + "'");
    return open(*found, request.path);
  }
  auto first = open(all.front(), request.path);
  for (std::size_t k = 1; !first && k < all.size(); ++k) {
    if (auto other = open(all[k], request.path)) return other;
  }
  return first;
}

Result<void> read(const ReaderRequest& request) {
  listen_to_gdcm();
  const auto all = dicom_series_in(request.path);
  if (!all) return tl::unexpected<Error>(all.error());
  auto opened = choose(*all, request);
  if (!opened) return tl::unexpected<Error>(opened.error());
  for (const DicomSeries& series : *all) {
    if (all->size() > 1) opened->header.parts.push_back(series.part);
  }
  if (auto written = write_header(opened->header); !written || request.only_header) return written;
  return write_images(*opened, request.time_point);
}

}  // namespace
}  // namespace intervale

int main(int argc, char** argv) { intervale::run_reader(argc, argv, intervale::read); }
