// How much files may take, and that reading them can be stopped.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <functional>
#include <string>
#include <vector>

#include "common/ivm/ivm_container.h"
#include "common/ivm/ivm_file.h"
#include "common/ivm/load_volume.h"
#include "common/ivm/value_file.h"
#include "common/parallel/all_cores.h"
#include "server/builder/value_builder.h"
#include "server/builder/value_steps.h"
#include "tests/support/interval_volumes.h"
#include "tests/support/temp_dir.h"

namespace intervale {
namespace {

using ::testing::HasSubstr;

// The bytes of small data sets of both kinds.
std::vector<std::vector<std::byte>> both_kinds() {
  Volume volume = testing::gyroid({33, 20, 17});
  const auto values = build_value_volume(volume, choose_value_format(volume, {}).value());
  return {encode_ivm(testing::build(testing::gyroid({33, 20, 17}), {.range = {-0.3, 0.4}, .refine = Refine::uniform})), encode_values(values)};
}

TEST(Reading, StopsWhereverItIsAsked) {
  const TempDir folder;
  for (const auto& bytes : both_kinds()) {
    const auto path = folder.file("a.ivm", std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
    std::size_t asked = 0, stop_at = ~std::size_t(0);
    const ParallelFor parallel = [&](std::size_t count, const std::function<void(std::size_t)>& piece) {
      for (std::size_t i = 0; i < count; ++i) {
        if (++asked == stop_at) throw Stopped();
        piece(i);
      }
    };
    ASSERT_TRUE(load_volume(path, parallel));
    const std::size_t pieces = asked;
    EXPECT_GT(pieces, 20u);
    for (stop_at = 1; stop_at <= pieces; ++stop_at) {
      asked = 0;
      EXPECT_THROW((void)load_volume(path, parallel), Stopped) << stop_at;
    }
  }
}

// The room that a file needs is more than what remains of it in memory, and not many times more.
TEST(Reading, TakesNoMoreThanTheRoom) {
  for (const auto& bytes : both_kinds()) {
    const auto fits = [&](std::uint64_t room) {
      try {
        return decode_volume(bytes, "a", serial, room).has_value();
      } catch (const NoRoom&) {
        return false;
      }
    };
    const std::uint64_t remains = decode_volume(bytes, "a").value().memory_bytes();
    EXPECT_FALSE(fits(remains / 2));
    EXPECT_TRUE(fits(8 * remains));
  }
}

// With right checksums. What they hold is not enough for what they claim.
TEST(Reading, ClaimsThatTheirPartsCannotHoldAreRefused) {
  const auto bytes = encode_ivm(testing::build(testing::gyroid({9, 7, 6}), {.range = {-0.3, 0.4}}));
  const auto file = Container::open(bytes, FileScope::one_range).value();
  const auto changed = [&](StreamType type, std::size_t at, std::uint64_t number) {
    Streams streams;
    for (std::uint32_t t = 1; t < kStreamTypes; ++t) {
      const auto stream = file[StreamType(t)];
      streams[StreamType(t)].assign(stream.begin(), stream.end());
    }
    std::memcpy(streams[type].data() + at, &number, sizeof number);
    return decode_ivm(make_container(FileScope::one_range, streams), "a", serial, 1 << 20);
  };
  constexpr std::size_t kUpdates = 24, kSupercubes = 40;  // of the range's record
  for (const std::uint64_t updates : {std::uint64_t(215'000'000), std::uint64_t(1) << 40, ~std::uint64_t(0)}) {
    const auto decoded = changed(StreamType::range, kUpdates, updates);
    ASSERT_FALSE(decoded);
    EXPECT_THAT(decoded.error().message, HasSubstr("claims more values than it can hold"));
  }
  EXPECT_FALSE(changed(StreamType::range, kSupercubes, 1'000'000));
}

}  // namespace
}  // namespace intervale
