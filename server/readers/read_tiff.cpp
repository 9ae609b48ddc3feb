// The volume in a TIFF file of several pages, or in a folder of TIFF files, by libtiff: a program of its own, see
// child_reader.h.
#include <optional>
#include <string>
#include <vector>

#include "server/readers/reader_program.h"
#include "server/readers/tiff_description.h"
#include "server/readers/tiff_pages.h"
#include "server/readers/tiff_planes.h"
#include "server/volume/header_bytes.h"

namespace intervale {
namespace {

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

Result<VolumeHeader> header_of(const Pages& pages, const Page& page, const Described& described, const Planes& planes, const ReaderRequest& request) {
  const TiffFile& file = pages.file();
  const std::string name = in_quotes(request.path);
  const auto type = type_of(page);
  if (page.samples != 1 || page.is_palette) return file.failure("its pages are in colour; a volume has one number a sample");
  if (!type)
    return file.failure("pages of " + std::to_string(page.bits) + " bits are not read; integers of 8, 16 and 32 bits and floats of 32 and 64 are");
  if (!described.has_known_units) return fail(name + ": its distances along x, y and z are in different units");
  VolumeHeader header;
  const auto grid = make_grid({page.width, page.height, std::int64_t(planes.slices)}, Affine::of(described.spacing), name);
  if (!grid) return tl::unexpected<Error>(grid.error());
  header.grid = *grid;
  header.type = *type;
  header.time_points = planes.time_points;
  header.parts_are = "channels";
  for (std::uint64_t c = 0; planes.channels > 1 && c < planes.channels; ++c)
    header.parts.push_back({std::to_string(c), "channel " + std::to_string(c)});
  if (is_label(described.unit)) header.labels.unit = described.unit;
  if (auto size = check_size(header, name); !size) return tl::unexpected<Error>(size.error());
  return header;
}

Result<void> read(const ReaderRequest& request) {
  auto pages = Pages::of(request.path);
  if (!pages) return tl::unexpected<Error>(pages.error());
  const Page first = pages->page();
  Described described = description_of(pages->file().get());
  if (!pages->is_one_file()) {  // each file is one slice
    described.channels = described.time_points = 1;
    described.slices = 0;
    described.data.clear();
  } else if (pages->size() == 1 && described.images > 1) {
    if (auto more = pages->go_on_for(described.images); !more) return more;
  }
  const auto planes = planes_of(described, *pages, in_quotes(request.path));
  if (!planes) return tl::unexpected<Error>(planes.error());
  const auto header = header_of(*pages, first, described, *planes, request);
  if (!header) return tl::unexpected<Error>(header.error());
  const std::uint64_t channel = request.part ? number_of<std::uint64_t>(*request.part).value_or(planes->channels) : 0;
  if (channel >= planes->channels) return misuse(in_quotes(request.path) + " has no channel of that number: the first is 0");
  if (auto written = write_header(*header); !written || request.only_header) return written;
  if (request.time_point >= planes->time_points) return misuse(in_quotes(request.path) + " has no time point of that number: the first is 0");

  std::vector<std::byte> samples;
  for (std::uint64_t z = 0; z < planes->slices; ++z) {
    const std::uint64_t page = planes->page_of(z, channel, request.time_point);
    if (auto done = pages->read(page, first, size_of(header->type), samples); !done) return done;
    if (auto written = write_samples(samples); !written) return written;
  }
  return {};
}

}  // namespace
}  // namespace intervale

int main(int argc, char** argv) { intervale::run_reader(argc, argv, intervale::read); }
