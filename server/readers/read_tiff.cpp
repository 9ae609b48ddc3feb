// The volume in a TIFF file of several pages, or in a folder of TIFF files, by libtiff: a program of its own, see
// child_reader.h.
//
// Distances come from OME-XML (docs.openmicroscopy.org/ome-model, "Pixels") or from what ImageJ writes into the
// description of the first page; resolutions of plain files are those of printers, and are not looked at.
#include <tiffio.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <pugixml.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/readers/reader_program.h"
#include "server/volume/header_bytes.h"
#include "server/volume/library_formats.h"

namespace intervale {
namespace {

constexpr tmsize_t kMostMemory = tmsize_t(1) << 30;  // bytes at once, for what a file claims
constexpr std::uint64_t kGreatestRatio = 10'000;     // of compression
constexpr std::size_t kMostPages = std::size_t(kMaxSide) * 16;

using Tiff = std::unique_ptr<TIFF, void (*)(TIFF*)>;

// Keeps the first message of libtiff.
int keep_error(TIFF*, void* to, const char*, const char* format, va_list arguments) {
  auto& message = *static_cast<std::string*>(to);
  if (!message.empty()) return 1;
  std::array<char, 200> text;
  std::vsnprintf(text.data(), text.size(), format, arguments);
  message = text.data();
  return 1;
}
int ignore_warning(TIFF*, void*, const char*, const char*, va_list) { return 1; }

class TiffFile {
 public:
  explicit TiffFile(const std::filesystem::path& path) : path_(path) {
    const std::unique_ptr<TIFFOpenOptions, void (*)(TIFFOpenOptions*)> options(TIFFOpenOptionsAlloc(), TIFFOpenOptionsFree);
    TIFFOpenOptionsSetMaxSingleMemAlloc(options.get(), kMostMemory);
    TIFFOpenOptionsSetErrorHandlerExtR(options.get(), keep_error, &message_);
    TIFFOpenOptionsSetWarningHandlerExtR(options.get(), ignore_warning, nullptr);
    tiff_.reset(TIFFOpenExt(path.c_str(), "rm", options.get()));
  }
  [[nodiscard]] bool is_open() const { return tiff_ != nullptr; }
  [[nodiscard]] TIFF* get() const { return tiff_.get(); }
  [[nodiscard]] std::uint64_t size() const {
    std::error_code none;
    return std::filesystem::file_size(path_, none);
  }
  [[nodiscard]] tl::unexpected<Error> failure(const std::string& what) const {
    return fail(in_quotes(path_) + ": " + what + (message_.empty() ? "" : " (" + message_ + ")"));
  }

 private:
  std::filesystem::path path_;
  std::string message_;
  Tiff tiff_{nullptr, TIFFClose};
};

// What must be the same on all pages.
struct Page {
  std::uint32_t width = 0, height = 0;
  std::uint16_t bits = 0, format = SAMPLEFORMAT_UINT, samples = 1;
  bool is_palette = false;
  friend bool operator==(const Page&, const Page&) = default;
};

Page page_of(TIFF* tiff) {
  Page page;
  TIFFGetField(tiff, TIFFTAG_IMAGEWIDTH, &page.width);
  TIFFGetField(tiff, TIFFTAG_IMAGELENGTH, &page.height);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_BITSPERSAMPLE, &page.bits);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_SAMPLEFORMAT, &page.format);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_SAMPLESPERPIXEL, &page.samples);
  std::uint16_t photometric = PHOTOMETRIC_MINISBLACK;
  TIFFGetField(tiff, TIFFTAG_PHOTOMETRIC, &photometric);
  page.is_palette = photometric == PHOTOMETRIC_PALETTE;
  return page;
}

std::optional<SampleType> type_of(const Page& page) {
  const bool is_signed = page.format == SAMPLEFORMAT_INT;
  if (page.format == SAMPLEFORMAT_IEEEFP) {
    if (page.bits == 32) return SampleType::f32;
    return page.bits == 64 ? std::optional(SampleType::f64) : std::nullopt;
  }
  if (page.format != SAMPLEFORMAT_UINT && page.format != SAMPLEFORMAT_VOID && !is_signed) return {};
  switch (page.bits) {
    case 8:
      return is_signed ? SampleType::i8 : SampleType::u8;
    case 16:
      return is_signed ? SampleType::i16 : SampleType::u16;
    case 32:
      return is_signed ? SampleType::i32 : SampleType::u32;
    default:
      return {};
  }
}

// What the description of the first page says.
struct Described {
  Vec3 spacing{1, 1, 1};
  std::string unit;
  std::uint64_t channels = 1, time_points = 1;
  std::uint64_t slices = 0;  // 0: not said
  bool has_known_units = true;
  std::string order = "ZCT";  // which of slice, channel and time changes first from page to page
};

// The metres in a unit of length; 0: not known.
double metres_in(std::string_view unit) {
  constexpr std::array<std::pair<std::string_view, double>, 7> kUnits{
      {{"\u00b5m", 1e-6}, {"nm", 1e-9}, {"mm", 1e-3}, {"cm", 1e-2}, {"m", 1}, {"\u00c5", 1e-10}, {"pm", 1e-12}}};
  const auto* const found = std::find_if(kUnits.begin(), kUnits.end(), [unit](const auto& known) { return known.first == unit; });
  return found == kUnits.end() ? 0 : found->second;
}

// The first child of that name, whatever its namespace is called.
pugi::xml_node child_of(const pugi::xml_node& node, std::string_view name) {
  return node.find_child([name](const pugi::xml_node& child) {
    const std::string_view whole = child.name();
    return whole.substr(whole.find(':') + 1) == name;
  });
}

Described described_by_ome(const pugi::xml_node& pixels) {
  Described d;
  const std::array<const char*, 3> keys{"PhysicalSizeX", "PhysicalSizeY", "PhysicalSizeZ"};
  for (std::size_t k = 0; k < 3; ++k) {
    const double size = pixels.attribute(keys[k]).as_double(1);
    if (!std::isfinite(size) || !(size > 0) || !pixels.attribute(keys[k])) continue;
    const std::string unit = pixels.attribute((std::string(keys[k]) + "Unit").c_str()).as_string("\u00b5m");
    if (d.unit.empty()) d.unit = unit;
    d.has_known_units = d.has_known_units && (unit == d.unit || (metres_in(unit) > 0 && metres_in(d.unit) > 0));
    d.spacing[k] = unit == d.unit ? size : size * metres_in(unit) / metres_in(d.unit);
  }
  d.slices = pixels.attribute("SizeZ").as_ullong(0);
  d.channels = pixels.attribute("SizeC").as_ullong(1);
  d.time_points = pixels.attribute("SizeT").as_ullong(1);
  const std::string order = pixels.attribute("DimensionOrder").as_string();
  for (const char* known : {"ZCT", "ZTC", "CZT", "CTZ", "TZC", "TCZ"}) {
    if (order == std::string("XY") + known) d.order = known;
  }
  return d;
}

Described described_by_imagej(std::string_view text, TIFF* tiff) {
  Described d;
  const auto value = [text](const std::string& key) {
    const auto at = text.find("\n" + key + "=");
    return at == text.npos ? std::string_view() : text.substr(at + key.size() + 2, text.find('\n', at + 1) - at - key.size() - 2);
  };
  d.channels = number_of<std::uint64_t>(value("channels")).value_or(1);
  d.time_points = number_of<std::uint64_t>(value("frames")).value_or(1);
  d.slices = number_of<std::uint64_t>(value("slices")).value_or(0);
  d.order = "CZT";
  d.unit = value("unit") == "micron" || value("unit") == "\\u00B5m" ? "\u00b5m" : std::string(value("unit"));
  float x = 0, y = 0;
  if (!d.unit.empty() && TIFFGetField(tiff, TIFFTAG_XRESOLUTION, &x) == 1 && TIFFGetField(tiff, TIFFTAG_YRESOLUTION, &y) == 1 && x > 0 && y > 0) {
    d.spacing[0] = 1 / double(x);
    d.spacing[1] = 1 / double(y);
  }
  const double z = number_of<double>(value("spacing")).value_or(d.unit.empty() ? 1 : d.spacing[0]);
  if (std::isfinite(z) && z != 0) d.spacing[2] = std::abs(z);
  return d;
}

Described description_of(TIFF* tiff) {
  const char* text = nullptr;
  if (TIFFGetField(tiff, TIFFTAG_IMAGEDESCRIPTION, &text) != 1 || text == nullptr) return {};
  if (std::string_view(text).starts_with("ImageJ=")) return described_by_imagej(text, tiff);
  pugi::xml_document document;
  if (!document.load_string(text)) return {};
  const pugi::xml_node pixels = child_of(child_of(child_of(document, "OME"), "Image"), "Pixels");
  return pixels ? described_by_ome(pixels) : Described();
}

// A page's samples, row by row.
Result<void> read_page(const TiffFile& file, const Page& page, std::size_t width, std::vector<std::byte>& out) {
  TIFF* const tiff = file.get();
  const std::uint64_t bytes = std::uint64_t(page.width) * page.height * width;
  if (bytes / kGreatestRatio > file.size()) return file.failure("a page says that it has " + std::to_string(bytes) + " bytes, which cannot be in it");
  out.assign(std::size_t(page.width) * page.height * width, std::byte());
  const std::size_t row = std::size_t(page.width) * width;
  if (TIFFIsTiled(tiff) == 0) {
    const tmsize_t size = TIFFStripSize(tiff);
    if (size <= 0 || std::size_t(size) > out.size()) return file.failure("its strips are longer than its page");
    for (std::uint32_t strip = 0; strip < TIFFNumberOfStrips(tiff); ++strip) {
      const std::size_t at = std::size_t(strip) * std::size_t(size);
      if (at >= out.size()) break;
      const std::size_t wanted = std::min(std::size_t(size), out.size() - at);
      if (TIFFReadEncodedStrip(tiff, strip, out.data() + at, tmsize_t(wanted)) != tmsize_t(wanted))
        return file.failure("a strip is damaged or cut short");
    }
    return {};
  }
  std::uint32_t tile_width = 0, tile_height = 0;
  TIFFGetField(tiff, TIFFTAG_TILEWIDTH, &tile_width);
  TIFFGetField(tiff, TIFFTAG_TILELENGTH, &tile_height);
  const tmsize_t size = TIFFTileSize(tiff);
  if (size <= 0 || size > kMostMemory || std::uint64_t(tile_width) * tile_height * width != std::uint64_t(size))
    return file.failure("its tiles have no size");
  std::vector<std::byte> tile(std::size_t(size), std::byte{});
  for (std::uint32_t y = 0; y < page.height; y += tile_height) {
    for (std::uint32_t x = 0; x < page.width; x += tile_width) {
      if (TIFFReadTile(tiff, tile.data(), x, y, 0, 0) != size) return file.failure("a tile is damaged or cut short");
      const std::size_t across = std::min(tile_width, page.width - x) * width;
      for (std::uint32_t k = 0; k < std::min(tile_height, page.height - y); ++k)
        std::copy_n(tile.begin() + std::ptrdiff_t(k * std::size_t(tile_width) * width), across,
                    out.begin() + std::ptrdiff_t((y + k) * row + x * width));
    }
  }
  return {};
}

// Where the pages of a file are, but for smaller copies of pages and masks. One at least.
Result<std::vector<toff_t>> full_pages(const TiffFile& file) {
  std::vector<toff_t> offsets;
  for (bool is_last = false; !is_last;) {
    std::uint32_t kind = 0;
    TIFFGetFieldDefaulted(file.get(), TIFFTAG_SUBFILETYPE, &kind);
    if ((kind & (FILETYPE_REDUCEDIMAGE | FILETYPE_MASK)) == 0) offsets.push_back(TIFFCurrentDirOffset(file.get()));
    if (offsets.size() > kMostPages) return file.failure("it has more pages than a volume has slices");
    is_last = TIFFLastDirectory(file.get()) != 0;
    if (!is_last && TIFFReadDirectory(file.get()) != 1) return file.failure("its pages are damaged or cut short");
  }
  if (offsets.empty()) return file.failure("it has no page");
  return offsets;
}

// The pages of a file or of a folder's files, one after the other.
class Pages {
 public:
  static Result<Pages> of(const std::filesystem::path& path) {
    const auto files = files_of(path);
    if (!files) return tl::unexpected<Error>(files.error());
    Pages pages;
    for (const auto& file : *files) {
      if (is_tiff(file)) pages.files_.push_back(file);
    }
    if (pages.files_.empty()) return fail(in_quotes(path) + " has no TIFF files");
    if (auto opened = pages.open(0); !opened) return tl::unexpected<Error>(opened.error());
    if (pages.files_.size() > 1) return pages;
    const auto offsets = full_pages(*pages.file_);
    if (!offsets) return tl::unexpected<Error>(offsets.error());
    pages.offsets_ = *offsets;
    return pages.go_to(0).map([&] { return std::move(pages); });
  }

  [[nodiscard]] std::size_t size() const { return files_.size() > 1 ? files_.size() : offsets_.size(); }
  [[nodiscard]] bool is_one_file() const { return files_.size() == 1; }
  [[nodiscard]] const TiffFile& file() const { return *file_; }  // at the page last gone to
  Result<void> go_to(std::size_t page) {
    if (files_.size() > 1) return open(page);
    if (TIFFSetSubDirectory(file_->get(), offsets_[page]) != 1) return file_->failure("page " + std::to_string(page + 1) + " cannot be read");
    return {};
  }

 private:
  static bool is_tiff(const std::filesystem::path& path) {
    return InputFile::open(path).and_then([](const InputFile& file) { return read_start(file, 4); }).map(begins_as_tiff).value_or(false);
  }
  Result<void> open(std::size_t number) {
    file_ = std::make_unique<TiffFile>(files_[number]);
    if (!file_->is_open()) return file_->failure("cannot be read as TIFF");
    if (files_.size() == 1 || TIFFLastDirectory(file_->get()) != 0) return {};
    const auto offsets = full_pages(*file_);
    if (!offsets) return tl::unexpected<Error>(offsets.error());
    if (offsets->size() > 1) return file_->failure("it has several pages; build a volume from it alone");
    return TIFFSetDirectory(file_->get(), 0) == 1 ? Result<void>() : file_->failure("its pages are damaged");
  }
  std::vector<std::filesystem::path> files_;
  std::vector<toff_t> offsets_;  // of pages, in a single file
  std::unique_ptr<TiffFile> file_;
};

Result<VolumeHeader> header_of(const Pages& pages, const Page& page, const Described& described, const ReaderRequest& request) {
  const TiffFile& file = pages.file();
  const std::string name = in_quotes(request.path);
  const auto type = type_of(page);
  if (page.samples != 1 || page.is_palette) return file.failure("its pages are in colour; a volume has one number a sample");
  if (!type)
    return file.failure("pages of " + std::to_string(page.bits) + " bits are not read; integers of 8, 16 and 32 bits and floats of 32 and 64 are");
  const std::uint64_t channels = described.channels, times = described.time_points, all = pages.size();
  if (channels == 0 || times == 0 || channels > all || times > all || all % (channels * times) != 0)
    return fail(name + " has " + std::to_string(all) + " pages, which are not those of " + std::to_string(channels) + " channels and " +
                std::to_string(times) + " time points");
  if (described.slices != 0 && described.slices != all / channels / times)
    return fail(name + " has " + std::to_string(all) + " pages, and says that it has " + std::to_string(described.slices) + " slices, " +
                std::to_string(channels) + " channels and " + std::to_string(times) + " time points; are pages missing?");
  if (!described.has_known_units) return fail(name + ": its distances along x, y and z are in different units");
  VolumeHeader header;
  const auto grid = make_grid({page.width, page.height, std::int64_t(all / channels / times)}, Affine::of(described.spacing), name);
  if (!grid) return tl::unexpected<Error>(grid.error());
  header.grid = *grid;
  header.type = *type;
  header.time_points = times;
  header.parts_are = "channels";
  for (std::uint64_t c = 0; channels > 1 && c < channels; ++c) header.parts.push_back({std::to_string(c), "channel " + std::to_string(c)});
  if (is_label(described.unit)) header.labels.unit = described.unit;
  if (auto size = check_size(header, name); !size) return tl::unexpected<Error>(size.error());
  return header;
}

Result<void> read(const ReaderRequest& request) {
  auto pages = Pages::of(request.path);
  if (!pages) return tl::unexpected<Error>(pages.error());
  const Page first = page_of(pages->file().get());
  Described described = description_of(pages->file().get());
  if (!pages->is_one_file()) {  // each file is one slice
    described.channels = described.time_points = 1;
    described.slices = 0;
  }
  const auto header = header_of(*pages, first, described, request);
  if (!header) return tl::unexpected<Error>(header.error());
  const std::uint64_t channel = request.part ? number_of<std::uint64_t>(*request.part).value_or(described.channels) : 0;
  if (channel >= described.channels) return misuse(in_quotes(request.path) + " has no channel of that number: the first is 0");
  if (auto written = write_header(*header); !written || request.only_header) return written;

  std::vector<std::byte> samples;
  const auto slices = std::uint64_t(header->grid.dims[2]);
  for (std::uint64_t z = 0; z < slices; ++z) {
    std::uint64_t number = 0, stride = 1;
    for (const char axis : described.order) {
      number += stride * (axis == 'Z' ? z : axis == 'C' ? channel : request.time_point);
      stride *= axis == 'Z' ? slices : axis == 'C' ? described.channels : described.time_points;
    }
    if (number >= pages->size()) return misuse(in_quotes(request.path) + " has no time point of that number: the first is 0");
    if (auto gone = pages->go_to(number); !gone) return gone;
    if (page_of(pages->file().get()) != first)
      return pages->file().failure("page " + std::to_string(number + 1) + " differs from the first in size or type");
    if (auto done = read_page(pages->file(), first, size_of(header->type), samples); !done) return done;
    if (auto written = write_samples(samples); !written) return written;
  }
  return {};
}

}  // namespace
}  // namespace intervale

int main(int argc, char** argv) { intervale::run_reader(argc, argv, intervale::read); }
