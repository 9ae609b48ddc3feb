// The streams of an .ivm file that hold values: what both scopes share. FORMAT.md is the specification.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/ivm/ivm_container.h"
#include "common/ivm/kept_pages.h"
#include "common/ivm/page_faults.h"
#include "common/ivm/paged_values.h"
#include "common/ivm/value_page.h"
#include "common/util/parallel.h"
#include "common/util/result.h"

namespace intervale {

// Writes field, weights, page_index, pages, and value_table if the format has one. The same bytes whatever `parallel` is, and
// whichever of their pages were kept; kept may be null.
void append_values(Streams& streams, const PagedValues& values, bool is_exact, const ParallelFor& parallel, KeptPages* kept);

// The same, without the pages and their index.
void append_field(Streams& streams, const PagedValues& values, bool is_exact);

// The inverse, of bytes from outside. read_field() sets and checks grid, format, corners, max_error and is_exact.
[[nodiscard]] Result<void> read_field(const Container& file, FieldDescription& to);
[[nodiscard]] Result<void> read_field(const Container& file, Description& to);
// The stream of labels.
void append_labels(Streams& streams, const Labels& labels);
[[nodiscard]] Result<void> read_labels(const Container& file, Labels& to);
// levels: of the field's domain
[[nodiscard]] Result<void> read_weights(const Container& file, int levels, ValueWeights& to);
// Sets keys and error levels, which have no elements at first, and grow with what is decoded. All the rest is known. faults:
// takes damaged pages, whose keys and levels are any; null: they are an error, as the first page always is.
[[nodiscard]] Result<void> read_pages(const Container& file, const DecodedValues& to, const ParallelFor& parallel, PageFaults* faults);

// What the index has of a page.
struct PageRecord {
  std::uint64_t bytes = 0, checksum = 0;
};
[[nodiscard]] PageRecord record_of(std::span<const std::uint8_t> page);

// Pages that are kept, if `by` is not null: of which values they are (PageName::values).
struct PageKeeping {
  KeptPages* by = nullptr;
  std::uint32_t values = 0;
};
// As encode_page() makes a page, or as it was kept. kept: or null.
[[nodiscard]] std::vector<std::uint8_t> encode_page(const PagedValues& values, const ValuePage& page, const PageName& name, KeptPages* kept);
// Appends the pages of some values, and their index: for each page its bytes and their XXH3-64, two numbers of 8 bytes.
void append_pages(const PagedValues& values, std::vector<std::byte>& index, std::vector<std::byte>& pages, const ParallelFor& parallel,
                  const PageKeeping& kept);
// The inverse, of bytes from outside: takes them off the front of both.
[[nodiscard]] Result<void> take_pages(std::span<const std::byte>& index, std::span<const std::byte>& pages, const DecodedValues& to,
                                      const ParallelFor& parallel, PageFaults* faults, const std::string& channel = {});
// The same where only some pages are there, one for each of the index, and `pages` has the bytes of those alone. Sets
// the keys and levels of those that are decoded: all that are there, but for those that may need one that is not. The
// first one must be there. A damaged page is an error. Returns for each page whether it was decoded.
[[nodiscard]] Result<std::vector<bool>> take_some_pages(std::span<const std::byte> index, std::span<const std::byte> pages,
                                                        const std::vector<bool>& there, const DecodedValues& to, const ParallelFor& parallel);

// The bytes of each page, from a stream page_index. They are not checked.
[[nodiscard]] std::vector<std::uint64_t> page_lengths(std::span<const std::byte> index);

// What is left once all pages of field and channels were read: by supercube, as slots_left(); empty if nothing is lost. Sets
// lost_updates, and changes the hash of the contents, which are others now.
[[nodiscard]] std::vector<std::uint64_t> take_faults(const Domain& domain, const SupercubeSet& set, PageFaults* faults, std::uint64_t& content_hash);

}  // namespace intervale
