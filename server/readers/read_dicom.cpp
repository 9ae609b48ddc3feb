// A series of DICOM images, in a folder or a file of several frames, by GDCM: a program of its own, see child_reader.h.
//
// Images of one series are sorted along the normal of their planes (DICOM PS3.3, C.7.6.2.1.1: image position and
// orientation; axes of the world: L, P, S). The step from image to image need not be along the normal: a tilted gantry
// makes the affine a shear. Steps that differ are refused: GDCM and others would place the images wrongly without a word.
#include <gdcmImageReader.h>
#include <gdcmReader.h>
#include <gdcmStringFilter.h>
#include <gdcmTrace.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "common/util/printable.h"
#include "server/readers/reader_program.h"
#include "server/volume/header_bytes.h"
#include "server/volume/library_formats.h"

namespace intervale {
namespace {

constexpr double kEven = 0.01;  // of a step: so far may an image be from its place

// GDCM ends the program by its assertions. This says at which file.
std::array<char, 1024> g_last_words;
void say_last_words(int) {
  if (::ftruncate(STDERR_FILENO, 0) == 0) ::lseek(STDERR_FILENO, 0, SEEK_SET);  // instead of what assert() said
  const auto written = ::write(STDERR_FILENO, g_last_words.data(), std::strlen(g_last_words.data()));
  ::_exit(written < 0 ? 2 : 1);
}
void expect_crash_at(const std::filesystem::path& path) {
  const std::string words = in_quotes(path) + " is damaged: GDCM stops when it reads it\n";
  std::strncpy(g_last_words.data(), words.c_str(), g_last_words.size() - 1);
}

// What GDCM says while it reads. It fills pixels that are missing with zeros, and says so here only.
std::ostringstream g_warnings;
bool warns_of_missing_pixels() { return g_warnings.view().find("Incomplete Pixel Data") != std::string_view::npos; }

// One file.
struct Image {
  std::filesystem::path path;
  std::string series, description, modality, rescale_type;
  std::int64_t series_number = 0, instance = 0, temporal = 0, acquisition = 0;
  std::int64_t columns = 0, rows = 0, frames = 1;
  std::optional<std::array<double, 3>> position;
  std::optional<std::array<double, 6>> orientation;  // of a row, and of a column
  Vec3 spacing{1, 1, 1};                             // along a row, along a column, and that of slices that the file claims
  double slope = 1, intercept = 0;
};

std::string text_of(gdcm::StringFilter& filter, std::uint16_t group, std::uint16_t element) {
  std::string text = filter.ToString(gdcm::Tag(group, element));
  text.resize(std::strlen(text.c_str()));
  return std::string(trimmed(text));
}

template <class T>
T number_at(gdcm::StringFilter& filter, std::uint16_t group, std::uint16_t element, T otherwise) {
  return number_of<T>(text_of(filter, group, element)).value_or(otherwise);
}

template <std::size_t N>
std::optional<std::array<double, N>> numbers_at(gdcm::StringFilter& filter, std::uint16_t group, std::uint16_t element) {
  std::string text = text_of(filter, group, element);
  std::replace(text.begin(), text.end(), '\\', ' ');
  const auto numbers = numbers_of<double, N>(words_of(text));
  if (!numbers || !std::all_of(numbers->begin(), numbers->end(), [](double x) { return std::isfinite(x); })) return {};
  return numbers;
}

// What the elements before the pixels say. None: the file has no image.
std::optional<Image> scan(const std::filesystem::path& path) {
  expect_crash_at(path);
  g_warnings.str({});
  gdcm::Reader reader;
  reader.SetFileName(path.c_str());
  if (!reader.ReadUpToTag(gdcm::Tag(0x7fe0, 0x0010))) return {};
  gdcm::StringFilter filter;
  filter.SetFile(reader.GetFile());
  Image image;
  image.path = path;
  image.series = text_of(filter, 0x0020, 0x000e);
  image.description = text_of(filter, 0x0008, 0x103e);
  image.modality = text_of(filter, 0x0008, 0x0060);
  image.rescale_type = text_of(filter, 0x0028, 0x1054);
  image.series_number = number_at<std::int64_t>(filter, 0x0020, 0x0011, 0);
  image.instance = number_at<std::int64_t>(filter, 0x0020, 0x0013, 0);
  image.temporal = number_at<std::int64_t>(filter, 0x0020, 0x0100, 0);
  image.acquisition = number_at<std::int64_t>(filter, 0x0020, 0x0012, 0);
  image.rows = number_at<std::int64_t>(filter, 0x0028, 0x0010, 0);
  image.columns = number_at<std::int64_t>(filter, 0x0028, 0x0011, 0);
  image.frames = number_at<std::int64_t>(filter, 0x0028, 0x0008, 1);
  image.position = numbers_at<3>(filter, 0x0020, 0x0032);
  image.orientation = numbers_at<6>(filter, 0x0020, 0x0037);
  if (const auto spacing = numbers_at<2>(filter, 0x0028, 0x0030)) image.spacing = {(*spacing)[1], (*spacing)[0], 1};
  image.spacing[2] = number_at<double>(filter, 0x0018, 0x0088, number_at<double>(filter, 0x0018, 0x0050, 1));
  for (double& side : image.spacing) {
    if (!std::isfinite(side) || side == 0) side = 1;
    side = std::abs(side);
  }
  image.slope = number_at<double>(filter, 0x0028, 0x1053, 1);
  image.intercept = number_at<double>(filter, 0x0028, 0x1052, 0);
  if (!std::isfinite(image.slope) || image.slope == 0 || !std::isfinite(image.intercept)) image.slope = 1, image.intercept = 0;
  return image.rows > 0 && image.columns > 0 ? std::optional(image) : std::nullopt;
}

// Images that belong together: of one series, size and orientation. Of one position all time points follow each other.
struct Series {
  VolumePart part;
  std::vector<Image> images;
  std::size_t times = 1;
  [[nodiscard]] const Image& first() const { return images.front(); }
  [[nodiscard]] std::size_t slices() const { return images.size() / times; }
  [[nodiscard]] bool has_one_scale() const {
    return std::all_of(images.begin(), images.end(), [this](const Image& i) { return i.slope == first().slope && i.intercept == first().intercept; });
  }
  [[nodiscard]] const Image& at(std::size_t slice, std::size_t time) const { return images[slice * times + time]; }
};

Vec3 normal_of(const Image& image) {
  const auto& o = *image.orientation;
  return cross(Vec3{o[0], o[1], o[2]}, Vec3{o[3], o[4], o[5]});
}

// The place of an image along the normal; its number where it has no place.
double place_of(const Image& image) {
  if (!image.orientation || !image.position) return double(image.instance);
  return dot(normal_of(image), Vec3{(*image.position)[0], (*image.position)[1], (*image.position)[2]});
}

void sort(Series& series) {
  std::vector<std::pair<double, Image>> placed;
  for (Image& image : series.images) {
    const double place = place_of(image);
    placed.emplace_back(place, std::move(image));
  }
  std::stable_sort(placed.begin(), placed.end(), [](const auto& a, const auto& b) {
    const auto rank = [](const auto& one) { return std::tuple(one.first, one.second.temporal, one.second.acquisition, one.second.instance); };
    return rank(a) < rank(b);
  });
  const auto same = std::find_if(placed.begin(), placed.end(), [&](const auto& one) { return std::abs(one.first - placed[0].first) > 1e-3; });
  const auto times = std::size_t(same - placed.begin());
  series.times = placed.size() % times == 0 ? times : 1;
  series.images.clear();
  for (auto& [place, image] : placed) series.images.push_back(std::move(image));
}

Result<std::vector<Series>> series_in(const std::filesystem::path& path) {
  const auto files = files_of(path);
  if (!files) return tl::unexpected<Error>(files.error());
  std::map<std::tuple<std::int64_t, std::string, std::int64_t, std::int64_t, std::array<std::int64_t, 6>>, Series> groups;
  for (const auto& file : *files) {
    const auto start = InputFile::open(file).and_then([](const InputFile& opened) { return read_start(opened, 132); });
    if (!start || !begins_as_dicom(*start)) continue;
    auto image = scan(file);
    if (!image) continue;  // DICOMDIR, reports and the like
    std::array<std::int64_t, 6> orientation{};
    for (std::size_t k = 0; image->orientation && k < 6; ++k) orientation[k] = std::llround(std::clamp((*image->orientation)[k], -2.0, 2.0) * 1000);
    groups[{image->series_number, image->series, image->columns, image->rows, orientation}].images.push_back(std::move(*image));
  }
  std::vector<Series> all;
  std::map<std::string, int> seen;
  for (auto& [key, series] : groups) {
    sort(series);
    const Image& first = series.first();
    const int number = ++seen[first.series];
    series.part.name = (first.series.empty() ? "none" : first.series) + (number > 1 ? "#" + std::to_string(number) : "");
    const auto images = std::to_string(first.frames > 1 ? std::size_t(first.frames) : series.images.size());
    series.part.about = first.modality + (first.modality.empty() ? "" : " ") + std::to_string(first.columns) + " x " + std::to_string(first.rows) +
                        ", " + images + (images == "1" ? " image" : " images") + (first.description.empty() ? "" : ", " + first.description);
    all.push_back(std::move(series));
  }
  if (all.empty()) return fail(in_quotes(path) + " has no DICOM images");
  const auto images = [](const Series& series) { return series.images.size() * std::size_t(series.first().frames); };
  std::stable_sort(all.begin(), all.end(), [&](const Series& a, const Series& b) { return images(a) > images(b); });
  return all;
}

Vec3 vector_of(const std::array<double, 3>& p) { return {p[0], p[1], p[2]}; }

// Fails unless the steps from image to image are equal, and says where they are not. at: the images' places, two at
// least.
Result<void> check_even(const Series& series, const std::vector<Vec3>& at) {
  std::vector<Vec3> steps;
  std::vector<double> lengths;
  for (std::size_t k = 1; k < at.size(); ++k) {
    steps.push_back(subtract(at[k], at[k - 1]));
    lengths.push_back(length(steps.back()));
  }
  const auto middle = lengths.begin() + std::ptrdiff_t(lengths.size() / 2);
  std::nth_element(lengths.begin(), middle, lengths.end());
  const double usual = *middle;
  const auto typical = std::find_if(steps.begin(), steps.end(), [usual](const Vec3& step) { return length(step) == usual; });
  for (std::size_t k = 0; k < steps.size(); ++k) {
    if (length(subtract(steps[k], *typical)) <= kEven * usual) continue;
    const auto file = [&](std::size_t i) { return in_quotes(series.at(i, 0).path.filename()); };
    std::array<char, 80> numbers{};
    std::snprintf(numbers.data(), numbers.size(), "%g, where most others are %g", length(steps[k]), usual);
    return fail("the images are not evenly spaced: from " + file(k) + " to " + file(k + 1) + ", images " + std::to_string(k + 1) + " and " +
                std::to_string(k + 2) + " of " + std::to_string(at.size()) + ", it is " + numbers.data() + "; is one missing?");
  }
  return {};
}

// From the places of the images. Fails if they are not evenly spaced.
Result<Affine> affine_of(const Series& series) {
  const Image& first = series.first();
  if (!first.orientation) return Affine::of(first.spacing, first.position ? vector_of(*first.position) : Vec3{});
  const auto& o = *first.orientation;
  const Vec3 row = scaled(first.spacing[0], Vec3{o[0], o[1], o[2]}), column = scaled(first.spacing[1], Vec3{o[3], o[4], o[5]});
  const Vec3 origin = first.position ? vector_of(*first.position) : Vec3{};
  const std::size_t slices = series.slices();
  Vec3 step = scaled(first.spacing[2], normal_of(first));
  if (slices > 1 && first.position) {
    std::vector<Vec3> at;
    for (std::size_t k = 0; k < slices; ++k) {
      const Image& image = series.at(k, 0);
      if (!image.position) return fail(in_quotes(image.path) + " does not say where it is, other images of its series do");
      at.push_back(vector_of(*image.position));
    }
    if (auto even = check_even(series, at); !even) return tl::unexpected<Error>(even.error());
    step = scaled(1 / double(slices - 1), subtract(at.back(), at.front()));
  }
  return Affine::of_columns({row, column, step}, origin);
}

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
    expect_crash_at(path);
    auto pixels = std::make_unique<Pixels>();
    pixels->path_ = path;
    pixels->reader_.SetFileName(path.c_str());
    g_warnings.str({});
    if (!pixels->reader_.Read()) return fail(in_quotes(path) + ": its pixels cannot be read");
    if (warns_of_missing_pixels()) return fail(in_quotes(path) + " is cut short: it has not all of its pixels");
    const gdcm::PixelFormat& format = pixels->image().GetPixelFormat();
    if (format.GetSamplesPerPixel() != 1) return fail(in_quotes(path) + " is in colour; a volume has one number a sample");
    const auto type = type_of(format);
    if (!type) return fail(in_quotes(path) + ": its pixels are no integers of 8, 16 or 32 bits and no floats");
    pixels->type_ = *type;
    return pixels;
  }
  [[nodiscard]] const gdcm::Image& image() const { return reader_.GetImage(); }
  [[nodiscard]] SampleType type() const { return type_; }

  // All frames. count: of the pixels that there should be.
  Result<void> read(std::uint64_t count, std::vector<std::byte>& out) {
    expect_crash_at(path_);
    const std::uint64_t bytes = count * size_of(type_);
    if (image().GetBufferLength() != bytes) return fail(in_quotes(path_) + " differs from the other images in size or type");
    out.resize(bytes);
    if (!image().GetBuffer(reinterpret_cast<char*>(out.data())))
      return fail(in_quotes(path_) + ": its pixels are damaged or coded in a way that is not read");
    return {};
  }

 private:
  std::filesystem::path path_;
  gdcm::ImageReader reader_;
  SampleType type_ = SampleType::u8;
};

// Stored numbers as values, where each image has a slope and an intercept of its own.
std::vector<std::byte> values_of(std::span<const std::byte> stored, SampleType type, const Image& image) {
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

void set_labels(const Image& image, VolumeHeader& header) {
  header.space = "LPS";
  header.labels.unit = "mm";
  if (is_label(image.modality)) header.labels.field = image.modality;
  const std::string unit = image.rescale_type.empty() || image.rescale_type == "US" ? (image.modality == "CT" ? "HU" : "") : image.rescale_type;
  if (is_label(unit)) header.labels.field_unit = unit;
}

// A series of which the first file is open.
struct Opened {
  const Series* series;
  VolumeHeader header;
  std::unique_ptr<Pixels> pixels;
};

// A file of several frames: where they lie, GDCM knows from the elements of each frame.
Result<Opened> open_frames(Opened opened) {
  const Image& only = opened.series->first();
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
  const Series& series = *opened.series;
  const Image& first = series.first();
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

Result<Opened> open(const Series& series, const std::filesystem::path& path) {
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
  const Series& series = *opened.series;
  std::vector<std::byte> samples;
  if (series.first().frames > 1) {
    return opened.pixels->read(opened.header.grid.sample_count(), samples).and_then([&] { return write_samples(samples); });
  }
  if (time_point >= series.times) return misuse("the series has no time point of that number: the first is 0");
  const SampleType type = opened.pixels->type();
  for (std::size_t k = 0; k < series.slices(); ++k) {
    const Image& image = series.at(k, time_point);
    auto pixels = k == 0 && time_point == 0 ? Result<std::unique_ptr<Pixels>>(std::move(opened.pixels)) : Pixels::open(image.path);
    if (!pixels) return tl::unexpected<Error>(pixels.error());
    if ((*pixels)->type() != type) return fail(in_quotes(image.path) + " has samples of another type than the first image");
    if (auto done = (*pixels)->read(std::uint64_t(image.columns) * std::uint64_t(image.rows), samples); !done) return done;
    if (auto written = write_samples(series.has_one_scale() ? samples : values_of(samples, type, image)); !written) return written;
  }
  return {};
}

// The series asked for, or else the first that is a volume.
Result<Opened> choose(const std::vector<Series>& all, const ReaderRequest& request) {
  if (request.part) {
    const auto found = std::find_if(all.begin(), all.end(), [&](const Series& series) { return series.part.name == *request.part; });
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
  gdcm::Trace::SetStream(g_warnings);
  gdcm::Trace::WarningOn();
  gdcm::Trace::ErrorOff();
  gdcm::Trace::DebugOff();
  for (const int signal : {SIGABRT, SIGSEGV, SIGFPE, SIGBUS, SIGILL}) std::signal(signal, say_last_words);
  const auto all = series_in(request.path);
  if (!all) return tl::unexpected<Error>(all.error());
  auto opened = choose(*all, request);
  if (!opened) return tl::unexpected<Error>(opened.error());
  for (const Series& series : *all) {
    if (all->size() > 1) opened->header.parts.push_back(series.part);
  }
  if (auto written = write_header(opened->header); !written || request.only_header) return written;
  return write_images(*opened, request.time_point);
}

}  // namespace
}  // namespace intervale

int main(int argc, char** argv) { intervale::run_reader(argc, argv, intervale::read); }
