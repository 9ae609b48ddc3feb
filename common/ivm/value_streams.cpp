#include "common/ivm/value_streams.h"

#include <xxhash.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <iterator>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "common/codec/coding_rate.h"
#include "common/codec/value_table.h"
#include "common/ivm/value_page.h"

namespace intervale {
namespace {

struct FieldRecord {
  std::int32_t dims[3];
  std::uint32_t type;
  double affine[12], step, max_error;
  std::int64_t first;
  std::uint32_t last, corners[kRootVertices], is_exact;
};
static_assert(sizeof(FieldRecord) == 176 && sizeof(PageRecord) == 16, "no padding");

FieldRecord record_of(const PagedValues& v, bool is_exact) {
  FieldRecord r{};
  std::copy(v.grid.dims.begin(), v.grid.dims.end(), r.dims);
  std::copy(v.grid.affine.rows.begin(), v.grid.affine.rows.end(), r.affine);
  r.type = std::uint32_t(v.format.type);
  r.step = v.format.step;
  r.max_error = v.max_error;
  r.first = v.format.first;
  r.last = v.format.last;
  r.is_exact = is_exact;
  std::copy(v.corners.begin(), v.corners.end(), r.corners);
  return r;
}

// The table of values, if the format has one. A writer keeps hardly more values than the pages have.
Result<void> read_table(const Container& file, ValueFormat& format) {
  const auto stored = file[StreamType::value_table];
  if (!has_table(format.step, format.type)) return stored.empty() ? Result<void>() : fail("a table of values does not belong to these values");
  if (format.last > most_coded_bits(file.file_bytes())) return fail("the file claims more values than it can hold");
  auto table = decode_value_table(octets(stored), std::size_t(format.last) + 1);
  if (!table) return tl::unexpected(table.error());
  format.table = std::make_shared<const std::vector<double>>(std::move(*table));
  return {};
}

template <class D>
Result<void> read_record(const Container& file, D& d) {
  FieldRecord r;
  const auto bytes = file.stream(StreamType::field, sizeof r);
  if (!bytes) return tl::unexpected(bytes.error());
  std::memcpy(&r, bytes->data(), sizeof r);
  std::copy(std::begin(r.dims), std::end(r.dims), d.grid.dims.begin());
  std::copy(std::begin(r.affine), std::end(r.affine), d.grid.affine.rows.begin());
  if (auto ok = check_grid(d.grid); !ok) return ok;
  if (r.type >= std::uint32_t(kSampleTypes)) return fail("the type of the samples is unknown");
  d.format = {SampleType(r.type), r.step, r.first, r.last};
  if (auto ok = read_table(file, d.format); !ok) return ok;
  if (auto ok = check_value_format(d.format); !ok) return ok;
  if (r.is_exact > 1) return fail("the field's record is damaged");
  d.is_exact = r.is_exact != 0;
  d.max_error = r.max_error;
  if (!(d.max_error >= 0) || !std::isfinite(d.max_error)) return fail("the largest error is negative or not finite");
  std::copy_n(r.corners, kRootVertices, d.corners.begin());
  if (std::any_of(d.corners.begin(), d.corners.end(), [&](ValueKey key) { return key > d.format.last; }))
    return fail("a corner's value is out of range");
  return {};
}

// A page as the file has it.
struct StoredPage {
  std::span<const std::byte> bytes;
  std::uint64_t checksum = 0;
};

// absent: not among those that are there. lost: it may need what is, or is absent. invalid: intact, but no page; no
// writer makes it.
enum class PageState : std::uint8_t { intact, absent, damaged, lost, invalid };

constexpr std::size_t kPagesAtOnce = 16;  // whose values are allocated together, or as many as were decoded before

// Room for the values of all pages up to this one.
void grow(const DecodedValues& to, const ValuePage& last) {
  const SupercubeSet& set = to.values.set;
  const BrickIndex end = last.back().end;
  const std::size_t values = end < set.bricks().size() ? std::size_t(set.bricks()[end].first) : set.size();
  ValueKeys keys(values, to.values.format.last);
  for (std::size_t i = 0; i < to.keys.size(); ++i) keys.set(i, to.keys[i]);
  to.keys = std::move(keys);
  if (to.error_levels != nullptr) to.error_levels->resize(std::min<std::size_t>(values, coarse_diamonds(set)));
}

// Takes so many pages off the front of an index and of the pages. there: which have their bytes there; null: all.
Result<std::vector<StoredPage>> take_stored(std::span<const std::byte>& index, std::span<const std::byte>& pages, std::size_t count,
                                            const std::vector<bool>* there) {
  if (index.size() / sizeof(PageRecord) < count) return fail("the index of the pages is damaged");
  std::vector<StoredPage> stored;
  stored.reserve(count);
  for (std::size_t page = 0; page < count; ++page) {
    PageRecord r;
    std::memcpy(&r, index.data(), sizeof r);
    index = index.subspan(sizeof r);
    if (there != nullptr && !(*there)[page]) {
      stored.emplace_back();
      continue;
    }
    if (r.bytes > pages.size()) return fail("the index of the pages is damaged");
    stored.push_back({pages.first(r.bytes), r.checksum});
    pages = pages.subspan(r.bytes);
  }
  return stored;
}

}  // namespace

void append_field(Streams& streams, const PagedValues& values, bool is_exact) {
  const FieldRecord field = record_of(values, is_exact);
  append(streams[StreamType::field], std::span(&field, 1));
  if (values.format.table) append<std::uint8_t>(streams[StreamType::value_table], encode_value_table(*values.format.table));
  const auto scales = std::size_t(Domain(values.grid.dims).levels());
  append(streams[StreamType::weights], std::span<const PredictorWeights>(&values.weights.of[0][0], scales * 3));
}

void append_values(Streams& streams, const PagedValues& values, bool is_exact, const ParallelFor& parallel, KeptPages* kept) {
  append_field(streams, values, is_exact);
  append_pages(values, streams[StreamType::page_index], streams[StreamType::pages], parallel, {kept, 0});
}

std::vector<std::uint8_t> encode_page(const PagedValues& values, const ValuePage& page, const PageName& name, KeptPages* kept) {
  if (kept == nullptr) return encode_page(values, page);
  if (auto found = kept->find(name)) return std::move(*found);
  std::vector<std::uint8_t> coded = encode_page(values, page);
  kept->keep(name, coded);
  return coded;
}

void append_pages(const PagedValues& values, std::vector<std::byte>& index, std::vector<std::byte>& to, const ParallelFor& parallel,
                  const PageKeeping& kept) {
  const std::vector<ValuePage> pages = pages_of(values.set);
  std::vector<std::vector<std::uint8_t>> coded(pages.size());
  parallel(pages.size(), [&](std::size_t page) { coded[page] = encode_page(values, pages[page], {kept.values, std::uint32_t(page)}, kept.by); });
  for (auto& page : coded) {
    const PageRecord record = record_of(page);
    append(index, std::span(&record, 1));
    append<std::uint8_t>(to, page);
    page = {};
  }
}

PageRecord record_of(std::span<const std::uint8_t> page) { return {page.size(), XXH3_64bits(page.data(), page.size())}; }

void append_labels(Streams& streams, const Labels& labels) {
  for (const std::string* text : {&labels.unit, &labels.field, &labels.field_unit, &labels.space}) {
    if (text == &labels.space && text->empty()) break;
    const auto bytes = std::uint8_t(text->size());
    append(streams[StreamType::labels], std::span(&bytes, 1));
    append<char>(streams[StreamType::labels], *text);
  }
}

Result<void> read_labels(const Container& file, Labels& to) {
  auto bytes = octets(file[StreamType::labels]);
  for (std::string* text : {&to.unit, &to.field, &to.field_unit, &to.space}) {
    if (text == &to.space && bytes.empty()) break;
    if (bytes.empty() || bytes[0] > kMaxLabel || bytes[0] >= bytes.size()) return fail("the labels are damaged");
    text->assign(bytes.begin() + 1, bytes.begin() + 1 + bytes[0]);
    bytes = bytes.subspan(1 + std::size_t(bytes[0]));
  }
  if (!bytes.empty()) return fail("the labels are damaged");
  return check_labels(to);
}

Result<void> read_field(const Container& file, FieldDescription& to) { return read_record(file, to); }
Result<void> read_field(const Container& file, Description& to) { return read_record(file, to); }

Result<void> read_weights(const Container& file, int levels, ValueWeights& to) {
  const auto bytes = file.stream(StreamType::weights, std::size_t(levels) * 3 * sizeof(PredictorWeights));
  if (!bytes) return tl::unexpected(bytes.error());
  std::memcpy(to.of.data(), bytes->data(), bytes->size());
  return {};
}

Result<void> read_pages(const Container& file, const DecodedValues& to, const ParallelFor& parallel, PageFaults* faults) {
  auto index = file[StreamType::page_index], pages = file[StreamType::pages];
  if (auto ok = take_pages(index, pages, to, parallel, faults); !ok) return ok;
  if (!index.empty() || !pages.empty()) return fail("the index of the pages is damaged");
  return {};
}

namespace {

// Pages of one scale in parallel: they depend on coarser ones only. What is allocated grows with what was decoded, so a
// file that claims more than it holds is found out before it takes much. there: null for all. Returns for each page whether
// it is lost, or not there.
Result<std::vector<bool>> take(std::span<const std::byte>& index, std::span<const std::byte>& from, const std::vector<bool>* there,
                               const DecodedValues& to, const ParallelFor& parallel, PageFaults* faults, const std::string& channel) {
  const SupercubeSet& set = to.values.set;
  const std::vector<ValuePage> pages = pages_of(set);
  const auto stored = take_stored(index, from, pages.size(), there);
  if (!stored) return tl::unexpected(stored.error());
  const auto scale = [&](std::size_t page) { return scale_of_key(set.bricks()[pages[page].front().first].key); };
  LostPages lost(set, pages);
  for (std::size_t first = 0, end = 0; first < pages.size(); first = end) {
    while (end < pages.size() && end - first < std::max(first, kPagesAtOnce) && scale(end) == scale(first)) ++end;
    grow(to, pages[end - 1]);
    std::vector<PageState> states(end - first);
    parallel(end - first, [&](std::size_t i) {
      const auto& [bytes, checksum] = (*stored)[first + i];
      if (there != nullptr && !(*there)[first + i])
        states[i] = PageState::absent;
      else if (XXH3_64bits(bytes.data(), bytes.size()) != checksum)
        states[i] = PageState::damaged;
      else if (lost.needs_lost(first + i))
        states[i] = PageState::lost;
      else if (!decode_page(to, pages[first + i], octets(bytes)))
        states[i] = PageState::invalid;
    });
    std::vector<std::size_t> lost_now;
    for (std::size_t i = 0; i < states.size(); ++i) {
      if (states[i] == PageState::intact) continue;
      if (states[i] == PageState::damaged || states[i] == PageState::invalid) {
        DamagedPage page = place_of(set, pages, first + i, to.values.grid.dims);
        page.channel = channel;
        if (faults == nullptr || first + i == 0 || states[i] == PageState::invalid) return fail(to_text(page) + " is damaged");
        faults->damaged.push_back(std::move(page));
      }
      lost_now.push_back(first + i);
    }
    lost.lose(lost_now);
  }
  return lost.lost();
}

}  // namespace

Result<void> take_pages(std::span<const std::byte>& index, std::span<const std::byte>& pages, const DecodedValues& to, const ParallelFor& parallel,
                        PageFaults* faults, const std::string& channel) {
  const auto lost = take(index, pages, nullptr, to, parallel, faults, channel);
  if (!lost) return tl::unexpected(lost.error());
  if (faults == nullptr || std::find(lost->begin(), lost->end(), true) == lost->end()) return {};
  faults->lost.resize(lost->size());
  for (std::size_t page = 0; page < lost->size(); ++page) faults->lost[page] = faults->lost[page] || (*lost)[page];
  return {};
}

Result<std::vector<bool>> take_some_pages(std::span<const std::byte> index, std::span<const std::byte> pages, const std::vector<bool>& there,
                                          const DecodedValues& to, const ParallelFor& parallel) {
  if (there.empty() || !there[0]) return fail("the first page is not there");
  auto decoded = take(index, pages, &there, to, parallel, nullptr, {});
  if (!decoded) return decoded;
  if (!index.empty() || !pages.empty()) return fail("the index of the pages is damaged");
  decoded->flip();
  return decoded;
}

std::vector<std::uint64_t> page_lengths(std::span<const std::byte> index) {
  std::vector<std::uint64_t> lengths(index.size() / sizeof(PageRecord));
  for (std::size_t page = 0; page < lengths.size(); ++page) {
    PageRecord r;
    std::memcpy(&r, index.data() + page * sizeof r, sizeof r);
    lengths[page] = r.bytes;
  }
  return lengths;
}

std::vector<std::uint64_t> take_faults(const Domain& domain, const SupercubeSet& set, PageFaults* faults, std::uint64_t& content_hash) {
  if (faults == nullptr || !faults->any()) return {};
  std::vector<std::uint64_t> left = slots_left(domain, set, faults->lost);
  faults->lost_updates = set.size();
  for (const std::uint64_t slots : left) faults->lost_updates -= std::uint64_t(std::popcount(slots));
  content_hash = XXH3_64bits_withSeed(left.data(), left.size() * sizeof left[0], content_hash);
  return left;
}

}  // namespace intervale
