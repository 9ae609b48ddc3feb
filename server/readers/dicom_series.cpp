#include "server/readers/dicom_series.h"

#include <gdcmReader.h>
#include <gdcmStringFilter.h>
#include <gdcmTrace.h>
#include <unistd.h>

#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <map>
#include <new>
#include <sstream>
#include <string_view>
#include <tuple>
#include <utility>

#include "server/readers/reader_program.h"
#include "server/volume/header_bytes.h"
#include "server/volume/library_formats.h"

namespace intervale {
namespace {

constexpr double kEven = 0.01;  // of a step: so far may an image be from its place

std::array<char, 1024> g_last_words;
void say_last_words(int) {
  if (::ftruncate(STDERR_FILENO, 0) == 0) ::lseek(STDERR_FILENO, 0, SEEK_SET);  // instead of what assert() said
  const auto written = ::write(STDERR_FILENO, g_last_words.data(), std::strlen(g_last_words.data()));
  ::_exit(written < 0 ? 2 : 1);
}

std::ostringstream g_warnings;

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

// GDCM catches the exception, and says no more than that it cannot read the file.
bool g_lacked_memory = false;
void note_lack_of_memory() {
  g_lacked_memory = true;
  throw std::bad_alloc();
}

// What the elements before the pixels say. None: the file has no image. Fails if it claims to hold much more than it does.
Result<std::optional<DicomImage>> scan(const std::filesystem::path& path) {
  expect_trouble_at(path);
  g_warnings.str({});
  gdcm::Reader reader;
  reader.SetFileName(path.c_str());
  g_lacked_memory = false;
  const bool is_read = reader.ReadUpToTag(gdcm::Tag(0x7fe0, 0x0010));
  if (g_lacked_memory) return fail(in_quotes(path) + " is damaged: it claims to hold more than its size allows");
  if (!is_read) return std::nullopt;
  gdcm::StringFilter filter;
  filter.SetFile(reader.GetFile());
  DicomImage image;
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

Vec3 normal_of(const DicomImage& image) {
  const auto& o = *image.orientation;
  return cross(Vec3{o[0], o[1], o[2]}, Vec3{o[3], o[4], o[5]});
}

// The place of an image along the normal; its number where it has no place.
double place_of(const DicomImage& image) {
  if (!image.orientation || !image.position) return double(image.instance);
  return dot(normal_of(image), Vec3{(*image.position)[0], (*image.position)[1], (*image.position)[2]});
}

void sort(DicomSeries& series) {
  std::vector<std::pair<double, DicomImage>> placed;
  for (DicomImage& image : series.images) {
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

Vec3 vector_of(const std::array<double, 3>& p) { return {p[0], p[1], p[2]}; }

// Fails unless the steps from image to image are equal, and says where they are not. at: the images' places, two at
// least.
Result<void> check_even(const DicomSeries& series, const std::vector<Vec3>& at) {
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

}  // namespace

void expect_trouble_at(const std::filesystem::path& path) {
  std::error_code none;
  const auto bytes = std::filesystem::file_size(path, none);
  limit_memory_for(none ? 0 : bytes);
  const std::string words = in_quotes(path) + " is damaged: GDCM stops when it reads it\n";
  std::strncpy(g_last_words.data(), words.c_str(), g_last_words.size() - 1);
}

void forget_warnings() { g_warnings.str({}); }

bool lacks_pixels() { return g_warnings.view().find("Incomplete Pixel Data") != std::string_view::npos; }

void listen_to_gdcm() {
  std::set_new_handler(note_lack_of_memory);
  gdcm::Trace::SetStream(g_warnings);
  gdcm::Trace::WarningOn();
  gdcm::Trace::ErrorOff();
  gdcm::Trace::DebugOff();
  for (const int signal : {SIGABRT, SIGSEGV, SIGFPE, SIGBUS, SIGILL}) std::signal(signal, say_last_words);
}

Result<std::vector<DicomSeries>> dicom_series_in(const std::filesystem::path& path) {
  const auto files = files_of(path);
  if (!files) return tl::unexpected<Error>(files.error());
  std::map<std::tuple<std::int64_t, std::string, std::int64_t, std::int64_t, std::array<std::int64_t, 6>>, DicomSeries> groups;
  for (const auto& file : *files) {
    const auto start = InputFile::open(file).and_then([](const InputFile& opened) { return read_start(opened, 132); });
    if (!start || !begins_as_dicom(*start)) continue;
    auto scanned = scan(file);
    if (!scanned) return tl::unexpected<Error>(scanned.error());
    std::optional<DicomImage>& image = *scanned;
    if (!image) continue;  // DICOMDIR, reports and the like
    std::array<std::int64_t, 6> orientation{};
    for (std::size_t k = 0; image->orientation && k < 6; ++k) orientation[k] = std::llround(std::clamp((*image->orientation)[k], -2.0, 2.0) * 1000);
    groups[{image->series_number, image->series, image->columns, image->rows, orientation}].images.push_back(std::move(*image));
  }
  std::vector<DicomSeries> all;
  std::map<std::string, int> seen;
  for (auto& [key, series] : groups) {
    sort(series);
    const DicomImage& first = series.first();
    const int number = ++seen[first.series];
    series.part.name = (first.series.empty() ? "none" : first.series) + (number > 1 ? "#" + std::to_string(number) : "");
    const auto images = std::to_string(first.frames > 1 ? std::size_t(first.frames) : series.images.size());
    series.part.about = first.modality + (first.modality.empty() ? "" : " ") + std::to_string(first.columns) + " x " + std::to_string(first.rows) +
                        ", " + images + (images == "1" ? " image" : " images") + (first.description.empty() ? "" : ", " + first.description);
    all.push_back(std::move(series));
  }
  if (all.empty()) return fail(in_quotes(path) + " has no DICOM images");
  const auto images = [](const DicomSeries& series) { return series.images.size() * std::size_t(series.first().frames); };
  std::stable_sort(all.begin(), all.end(), [&](const DicomSeries& a, const DicomSeries& b) { return images(a) > images(b); });
  return all;
}

Result<Affine> affine_of(const DicomSeries& series) {
  const DicomImage& first = series.first();
  if (!first.orientation) return Affine::of(first.spacing, first.position ? vector_of(*first.position) : Vec3{});
  const auto& o = *first.orientation;
  const Vec3 row = scaled(first.spacing[0], Vec3{o[0], o[1], o[2]}), column = scaled(first.spacing[1], Vec3{o[3], o[4], o[5]});
  const Vec3 origin = first.position ? vector_of(*first.position) : Vec3{};
  const std::size_t slices = series.slices();
  Vec3 step = scaled(first.spacing[2], normal_of(first));
  if (slices > 1 && first.position) {
    std::vector<Vec3> at;
    for (std::size_t k = 0; k < slices; ++k) {
      const DicomImage& image = series.at(k, 0);
      if (!image.position) return fail(in_quotes(image.path) + " does not say where it is, other images of its series do");
      at.push_back(vector_of(*image.position));
    }
    if (auto even = check_even(series, at); !even) return tl::unexpected<Error>(even.error());
    step = scaled(1 / double(slices - 1), subtract(at.back(), at.front()));
  }
  return Affine::of_columns({row, column, step}, origin);
}

}  // namespace intervale
