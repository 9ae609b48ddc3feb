// What the index of a file tells of its pages: which of them some ranges do not need, and that the rest is as in the
// whole file.
#include "common/ivm/page_bounds.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <memory>
#include <optional>
#include <random>
#include <span>
#include <vector>

#include "common/ivm/ivm_container.h"
#include "common/ivm/load_volume.h"
#include "common/ivm/value_file.h"
#include "common/ivm/value_verify.h"
#include "common/mesh/mesh_digest.h"
#include "common/parallel/all_cores.h"
#include "common/ranges/extract_meshes.h"
#include "server/builder/value_builder.h"
#include "tests/support/analytic_fields.h"
#include "tests/support/seeds.h"
#include "tests/support/value_fields.h"

namespace intervale::page_boundss {
namespace {

using Dims = std::array<std::int32_t, 3>;
using Bytes = std::vector<std::byte>;

// Grows along x, by about one a sample; smooth, but for some noise.
ValueVolume ramp(const Dims& dims, double noise) {
  std::mt19937 random(1);
  std::vector<float> samples;
  for (std::int32_t z = 0; z < dims[2]; ++z) {
    for (std::int32_t y = 0; y < dims[1]; ++y) {
      for (std::int32_t x = 0; x < dims[0]; ++x)
        samples.push_back(float(x + 3 * std::sin(0.1 * y + 0.07 * z) + noise * std::ldexp(double(random()), -32)));
    }
  }
  Volume volume = testing::volume_of_type(SampleType::f32, dims, samples);
  return build_value_volume(volume, testing::value_field(volume, 0.125).format);
}
ValueVolume random_values(const Dims& dims, unsigned seed) {
  testing::ValueField field = testing::random_value_field(dims, seed);
  return build_value_volume(field.volume, field.format);
}

// Of the keys around each diamond and its descendants, by number, from their definition.
std::vector<KeySpan> spans_of(const ValueVolume& volume) {
  const SupercubeSet& set = volume.set();
  const Domain& domain = volume.domain();
  std::vector<KeySpan> spans(set.size());
  const Diamond root(domain.root());
  const auto key_at = [&](Vertex v) -> std::optional<ValueKey> {
    for (int corner = 0; corner < kRootVertices; ++corner) {
      if (root.vertex(corner) == v) return volume.description().corners[std::size_t(corner)];
    }
    const auto place = set.find(v);
    return place ? std::optional(volume.key(place->index)) : std::nullopt;
  };
  set.for_each_up([&](const Place& p) {
    const Diamond d(SupercubeSet::centre(p));
    KeySpan span{volume.key(p.index), volume.key(p.index)};
    for (int v = 0; v < d.row->vertices; ++v) {
      if (const auto key = key_at(d.vertex(v))) span.add(*key);
    }
    spans[p.index] = span;
  });
  set.for_each_up([&](const Place& p) {  // children before parents
    const Diamond d(SupercubeSet::centre(p));
    for (int k = 0; k < d.row->parents; ++k) {
      const auto parent = set.find(d.parent(k));
      if (!parent) continue;
      spans[parent->index].add(spans[p.index].least);
      spans[parent->index].add(spans[p.index].greatest);
    }
  });
  return spans;
}

TEST(PageBounds, HoldWhatLiesAroundAllDescendants) {
  std::vector<ValueVolume> volumes;
  volumes.push_back(ramp({140, 70, 66}, 0));
  volumes.push_back(ramp({130, 65, 66}, 2));
  volumes.push_back(random_values({65, 64, 63}, 3));
  volumes.push_back(random_values({3, 150, 40}, 4));
  volumes.push_back(random_values({2, 2, 2}, 5));
  for (const ValueVolume& volume : volumes) {
    const SupercubeSet& set = volume.set();
    const std::vector<ValuePage> pages = pages_of(set);
    const std::vector<PageBounds> bounds = bounds_of_pages(volume.parts(), pages, on_all_cores);
    EXPECT_EQ(bounds, bounds_of_pages(volume.parts(), pages)) << "on one thread";
    ASSERT_EQ(bounds.size(), pages.size());
    const std::vector<KeySpan> spans = spans_of(volume);
    for (std::size_t page = 0; page < pages.size(); ++page) {
      for (const BrickRun& block : pages[page]) {
        for (BrickIndex brick = block.first; brick < block.end; ++brick) {
          const std::size_t first = set.bricks()[brick].first;
          for (std::size_t i = first; i < first + set.updates(brick); ++i)
            ASSERT_TRUE(bounds[page].least <= spans[i].least && spans[i].greatest <= bounds[page].greatest) << "page " << page << ", update " << i;
        }
      }
    }
  }
}

// As tight as the part of the field that a page's descendants reach: blocks of 64 points, three before and two behind.
TEST(PageBounds, AreThoseOfThePlaceOfAPage) {
  const ValueVolume volume = ramp({260, 66, 66}, 0);
  const std::vector<ValuePage> pages = pages_of(volume.set());
  const std::vector<PageBounds> bounds = bounds_of_pages(volume.parts(), pages, on_all_cores);
  std::size_t narrow = 0;
  for (const PageBounds& b : bounds) narrow += std::size_t((double(b.greatest) - double(b.least)) * 0.125 <= 64 + 5 + 6.5);
  EXPECT_GE(narrow, 3U);
}

struct File {
  Bytes bytes;
  std::shared_ptr<const IntervalVolume> whole;
  StreamPlace pages;
};
const File& file() {
  static const File made = [] {
    File f;
    f.bytes = encode_values(ramp({260, 66, 66}, 1), on_all_cores);
    f.whole = std::make_shared<const IntervalVolume>(decode_volume(f.bytes, "made", on_all_cores).value());
    f.pages = place_of(StreamType::pages, f.bytes, f.bytes.size(), FileScope::every_range).value();
    return f;
  }();
  return made;
}

FileEnds ends_of(const Bytes& bytes, std::size_t first) {
  const StreamPlace& pages = file().pages;
  return {std::span(bytes).first(first), std::span(bytes).subspan(pages.offset + pages.bytes), bytes.size()};
}

// What is read, and the data set that is made of it.
Bytes read_of(const NeededPages& needed, std::size_t there) {
  Bytes read(file().bytes.begin(), file().bytes.begin() + std::ptrdiff_t(there));
  for (const StreamPlace& place : needed.places) {
    EXPECT_GE(place.offset, there);
    const auto from = file().bytes.begin() + std::ptrdiff_t(place.offset);
    read.insert(read.end(), from, from + std::ptrdiff_t(place.bytes));
  }
  return read;
}

TEST(PageBounds, WhatSomeRangesNeedGivesTheirMeshes) {
  Lod coarse, seen, few;
  coarse.error = 0.4;
  seen.camera = Camera{};
  seen.camera->eye = {400, 60, 50};
  seen.camera->look_at = {100, 30, 30};
  seen.camera->pixel_error = 3;
  few.max_tets = 5000;
  for (const ShownRanges& shown : std::vector<ShownRanges>{{{{30, 40}, Refine::boundary}},
                                                           {{{100, 101}, Refine::uniform}},
                                                           {{{-10, 20}, Refine::boundary}, {{240, 250}, Refine::boundary}},
                                                           {{{1000, 2000}, Refine::boundary}}}) {
    std::vector<std::vector<ExtractedMesh>> wanted;
    for (const Lod& lod : {Lod(), coarse, seen, few}) wanted.push_back(extract_meshes(file().whole, shown, lod, {}, on_all_cores).value());
    const std::vector<Lod> all{Lod(), coarse, seen, few}, one_of_them{Lod()};
    const std::array starts{std::size_t(file().pages.offset), std::size_t(file().pages.offset) + 1000, std::size_t(64) << 10};
    for (const std::size_t there : std::span(starts).first(testing::cases(starts.size()))) {
      const auto needed = needed_pages(ends_of(file().bytes, there), shown);
      ASSERT_TRUE(needed && *needed);
      const Bytes read = read_of(**needed, there);
      EXPECT_LT(read.size(), file().bytes.size() * 9 / 10);
      const auto made = decode_needed_volume({read, std::span(file().bytes).subspan(file().pages.offset + file().pages.bytes), file().bytes.size()},
                                             "made", (*needed)->pages, on_all_cores);
      ASSERT_TRUE(made) << made.error().message;
      EXPECT_EQ(made->description(), file().whole->description());
      const auto some = std::make_shared<const IntervalVolume>(*made);
      const std::vector<Lod>& lods = there == file().pages.offset ? all : one_of_them;
      for (std::size_t l = 0; l < lods.size(); ++l) {
        const auto found = extract_meshes(some, shown, lods[l], {}, on_all_cores);
        ASSERT_TRUE(found) << found.error().message;
        for (std::size_t i = 0; i < shown.size(); ++i) {
          EXPECT_EQ((*found)[i].updates, wanted[l][i].updates);
          EXPECT_EQ(mesh_digest((*found)[i].mesh), mesh_digest(wanted[l][i].mesh));
        }
      }
    }
  }
}

// Blocks that meet at faces, edges and corners.
TEST(PageBounds, WhatIsNeededIsAsInTheWholeWhereverSurfacesPass) {
  constexpr Dims kDims{134, 130, 70};
  std::mt19937 random(7);
  std::vector<float> samples;
  for (std::int32_t z = 0; z < kDims[2]; ++z) {
    for (std::int32_t y = 0; y < kDims[1]; ++y) {
      for (std::int32_t x = 0; x < kDims[0]; ++x) samples.push_back(float(std::hypot(x, y, z) + std::ldexp(double(random()), -32)));
    }
  }
  Volume volume = testing::volume_of_type(SampleType::f32, kDims, samples);
  const Bytes bytes = encode_values(build_value_volume(volume, testing::value_field(volume, 0.25).format), on_all_cores);
  const auto whole = std::make_shared<const IntervalVolume>(decode_volume(bytes, "made", on_all_cores).value());
  const StreamPlace pages = place_of(StreamType::pages, bytes, bytes.size(), FileScope::every_range).value();
  std::size_t least = bytes.size();
  for (int i = 0; i < 4; ++i) {
    const double alpha = std::ldexp(double(random()), -32) * 230;
    const ShownRanges shown{{{alpha, alpha + 2}, i % 2 == 0 ? Refine::boundary : Refine::uniform}};
    const auto needed =
        needed_pages({std::span(bytes).first(pages.offset), std::span(bytes).subspan(pages.offset + pages.bytes), bytes.size()}, shown);
    ASSERT_TRUE(needed && *needed);
    Bytes read(bytes.begin(), bytes.begin() + std::ptrdiff_t(pages.offset));
    for (const StreamPlace& place : (*needed)->places)
      read.insert(read.end(), bytes.begin() + std::ptrdiff_t(place.offset), bytes.begin() + std::ptrdiff_t(place.offset + place.bytes));
    least = std::min(least, read.size());
    const auto made =
        decode_needed_volume({read, std::span(bytes).subspan(pages.offset + pages.bytes), bytes.size()}, "made", (*needed)->pages, on_all_cores);
    ASSERT_TRUE(made) << made.error().message;
    const auto some = std::make_shared<const IntervalVolume>(*made);
    Lod lod;
    lod.error = i * 0.3;
    const auto one = extract_meshes(some, shown, lod, {}, on_all_cores), other = extract_meshes(whole, shown, lod, {}, on_all_cores);
    ASSERT_TRUE(one && other);
    EXPECT_EQ((*one)[0].updates, (*other)[0].updates);
    EXPECT_EQ(mesh_digest((*one)[0].mesh), mesh_digest((*other)[0].mesh)) << alpha;
  }
  EXPECT_LT(least, bytes.size() / 2);
}

TEST(PageBounds, AllIsReadWhereThatIsNeeded) {
  const auto all = needed_pages(ends_of(file().bytes, file().pages.offset), {{{-1000, 1000}, Refine::uniform}});
  ASSERT_TRUE(all && *all);
  ASSERT_EQ((*all)->places.size(), 1U);
  EXPECT_EQ((*all)->places[0].bytes, file().pages.bytes);
}

TEST(PageBounds, AreVerified) {
  auto read = decode_values(file().bytes, "made", on_all_cores);
  ASSERT_TRUE(read);
  EXPECT_TRUE(validate(*read, on_all_cores));
  ValueVolume::Parts parts = std::move(*read).take();
  ASSERT_GT(parts.page_bounds.size(), 3U);
  ++parts.page_bounds[3].least;
  const auto wrong = validate(ValueVolume(std::move(parts)), on_all_cores);
  ASSERT_FALSE(wrong);
  EXPECT_EQ(wrong.error().message, "values around page 3 of 6 are outside of its bounds");
}

TEST(PageBounds, DamageIsFound) {
  const ShownRanges shown{{{30, 40}, Refine::boundary}};
  const std::size_t there = file().pages.offset;
  const auto needed = needed_pages(ends_of(file().bytes, there), shown);
  ASSERT_TRUE(needed && *needed);
  const Bytes read = read_of(**needed, there);
  const auto made = [&](const Bytes& first, const std::vector<bool>& pages) {
    return decode_needed_volume({first, std::span(file().bytes).subspan(file().pages.offset + file().pages.bytes), file().bytes.size()}, "made",
                                pages);
  };
  for (std::size_t at = 8; at < read.size(); at += at < there ? 37 : read.size() / testing::cases(40)) {
    Bytes damaged = read;
    damaged[at] ^= std::byte(1);
    EXPECT_FALSE(made(damaged, (*needed)->pages)) << at;
  }
  EXPECT_FALSE(made(Bytes(read.begin(), read.end() - 1), (*needed)->pages));
  std::vector<bool> others = (*needed)->pages;
  others.flip();
  EXPECT_FALSE(made(read, others));
  others.pop_back();
  EXPECT_FALSE(made(read, others)) << "too few";
  // A page that finer ones are decoded with.
  std::vector<bool> less = (*needed)->pages;
  std::uint64_t first_page = 0;
  std::memcpy(&first_page, file().bytes.data() + place_of(StreamType::page_index, file().bytes, file().bytes.size(), FileScope::every_range)->offset,
              8);
  less[0] = false;
  Bytes without(read.begin(), read.begin() + std::ptrdiff_t(there));
  without.insert(without.end(), read.begin() + std::ptrdiff_t(there + first_page), read.end());
  EXPECT_FALSE(made(without, less));
  Bytes bytes = file().bytes;
  bytes[place_of(StreamType::page_bounds, bytes, bytes.size(), FileScope::every_range)->offset] ^= std::byte(1);
  EXPECT_FALSE(needed_pages(ends_of(bytes, there), shown));
}

}  // namespace
}  // namespace intervale::page_boundss
