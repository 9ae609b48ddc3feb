#include "server/readers/tiff_pages.h"

#include <algorithm>
#include <array>
#include <cstdarg>
#include <cstdio>
#include <utility>

#include "server/readers/reader_program.h"
#include "server/volume/header_bytes.h"
#include "server/volume/library_formats.h"

namespace intervale {
namespace {

constexpr tmsize_t kMostMemory = tmsize_t(1) << 30;  // bytes at once, for what a file claims
constexpr std::uint64_t kGreatestRatio = 10'000;     // of compression
constexpr std::size_t kMostPages = std::size_t(kMaxSide) * 16;

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
Result<std::vector<Directory>> full_pages(const TiffFile& file) {
  std::vector<Directory> pages;
  std::uint64_t number = 0;
  for (bool is_last = false; !is_last; ++number) {
    std::uint32_t kind = 0;
    TIFFGetFieldDefaulted(file.get(), TIFFTAG_SUBFILETYPE, &kind);
    if ((kind & (FILETYPE_REDUCEDIMAGE | FILETYPE_MASK)) == 0) pages.push_back({TIFFCurrentDirOffset(file.get()), number});
    if (number > kMostPages) return file.failure("it has more pages than a volume has slices");
    is_last = TIFFLastDirectory(file.get()) != 0;
    if (!is_last && TIFFReadDirectory(file.get()) != 1) return file.failure("its pages are damaged or cut short");
  }
  if (pages.empty()) return file.failure("it has no page");
  return pages;
}

bool is_tiff(const std::filesystem::path& path) {
  return InputFile::open(path).and_then([](const InputFile& file) { return read_start(file, 4); }).map(begins_as_tiff).value_or(false);
}

}  // namespace

TiffFile::TiffFile(const std::filesystem::path& path) : path_(path) {
  const std::unique_ptr<TIFFOpenOptions, void (*)(TIFFOpenOptions*)> options(TIFFOpenOptionsAlloc(), TIFFOpenOptionsFree);
  TIFFOpenOptionsSetMaxSingleMemAlloc(options.get(), kMostMemory);
  TIFFOpenOptionsSetErrorHandlerExtR(options.get(), keep_error, &message_);
  TIFFOpenOptionsSetWarningHandlerExtR(options.get(), ignore_warning, nullptr);
  tiff_.reset(TIFFOpenExt(path.c_str(), "rm", options.get()));
}

std::uint64_t TiffFile::size() const {
  std::error_code none;
  return std::filesystem::file_size(path_, none);
}

tl::unexpected<Error> TiffFile::failure(const std::string& what) const {
  return fail(in_quotes(path_) + ": " + what + (message_.empty() ? "" : " (" + message_ + ")"));
}

Result<Pages> Pages::of(const std::filesystem::path& path) {
  const auto files = files_of(path);
  if (!files) return tl::unexpected<Error>(files.error());
  Pages pages;
  for (const auto& file : *files) {
    if (is_tiff(file)) pages.files_.push_back(file);
  }
  if (pages.files_.empty()) return fail(in_quotes(path) + " has no TIFF files");
  if (auto opened = pages.open(0); !opened) return tl::unexpected<Error>(opened.error());
  if (pages.files_.size() > 1) return pages;
  auto directories = full_pages(*pages.file_);
  if (!directories) return tl::unexpected<Error>(directories.error());
  pages.directories_ = *std::move(directories);
  return pages.go_to(0).map([&] { return std::move(pages); });
}

Page Pages::page() const {
  TIFF* const tiff = file_->get();
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

std::optional<std::size_t> Pages::of_directory(std::uint64_t number) const {
  const auto found =
      std::lower_bound(directories_.begin(), directories_.end(), number, [](const Directory& one, std::uint64_t n) { return one.number < n; });
  if (found == directories_.end() || found->number != number) return {};
  return std::size_t(found - directories_.begin());
}

Result<void> Pages::go_on_for(std::uint64_t count) {
  TIFF* const tiff = file_->get();
  const Page first = page();
  std::uint16_t compression = COMPRESSION_NONE;
  TIFFGetFieldDefaulted(tiff, TIFFTAG_COMPRESSION, &compression);
  if (compression != COMPRESSION_NONE || TIFFIsTiled(tiff) != 0) return file_->failure("only plain images can follow the one of its one page");
  if (first.width > std::uint32_t(kMaxSide) || first.height > std::uint32_t(kMaxSide) || count > kMostPages)
    return file_->failure("its images are larger than a volume may be");
  const std::uint64_t row = std::uint64_t(first.width) * first.samples * first.bits / 8, bytes = row * first.height;
  const std::uint64_t offset = TIFFGetStrileOffset(tiff, 0), size = file_->size();
  const std::uint64_t strip = std::uint64_t(std::max<tmsize_t>(0, TIFFStripSize(tiff)));
  for (std::uint32_t k = 1; k < TIFFNumberOfStrips(tiff); ++k) {
    if (TIFFGetStrileOffset(tiff, k) != offset + k * strip) return file_->failure("the strips of its one page do not follow each other");
  }
  if (bytes == 0 || offset == 0 || offset > size || count > (size - offset) / bytes)
    return file_->failure("it says that it has " + std::to_string(count) + " images of " + std::to_string(bytes) +
                          " bytes, which are not in it; is it cut short?");
  auto opened = InputFile::open(file_->path());
  if (!opened) return tl::unexpected<Error>(opened.error());
  images_.emplace(Images{*std::move(opened), offset, bytes, count});
  return {};
}

Result<void> Pages::read_image(std::size_t number, std::size_t width, std::vector<std::byte>& out) const {
  out.resize(images_->bytes);
  if (auto done = images_->file.read(images_->offset + number * images_->bytes, out); !done) return done;
  if (TIFFIsByteSwapped(file_->get()) != 0) {
    for (std::size_t at = 0; at + width <= out.size(); at += width)
      std::reverse(out.begin() + std::ptrdiff_t(at), out.begin() + std::ptrdiff_t(at + width));
  }
  return {};
}

Result<void> Pages::read(std::size_t number, const Page& first, std::size_t width, std::vector<std::byte>& out) {
  if (images_) return read_image(number, width, out);
  if (auto gone = go_to(number); !gone) return gone;
  if (page() != first) return file_->failure("page " + std::to_string(number + 1) + " differs from the first in size or type");
  return read_page(*file_, first, width, out);
}

Result<void> Pages::go_to(std::size_t page) {
  if (files_.size() > 1) return open(page);
  if (TIFFSetSubDirectory(file_->get(), directories_[page].offset) != 1)
    return file_->failure("page " + std::to_string(page + 1) + " cannot be read");
  return {};
}

Result<void> Pages::open(std::size_t number) {
  file_ = std::make_unique<TiffFile>(files_[number]);
  if (!file_->is_open()) return file_->failure("cannot be read as TIFF");
  if (files_.size() == 1 || TIFFLastDirectory(file_->get()) != 0) return {};
  const auto directories = full_pages(*file_);
  if (!directories) return tl::unexpected<Error>(directories.error());
  if (directories->size() > 1) return file_->failure("it has several pages; build a volume from it alone");
  return TIFFSetDirectory(file_->get(), 0) == 1 ? Result<void>() : file_->failure("its pages are damaged");
}

}  // namespace intervale
