#include "common/front/batch_decoder.h"

#include <string>

#include "common/codec/batch.h"
#include "common/codec/byte_planes.h"
#include "common/codec/residual_coder.h"
#include "common/codec/split_names.h"
#include "common/util/bits.h"

namespace intervale {
namespace {

tl::unexpected<Error> damaged(const char* what) { return fail(std::string("a batch is damaged: ") + what); }

}  // namespace

Result<std::uint64_t> apply_batch(Front& front, std::span<const std::uint8_t> bytes, std::uint64_t max_tets) {
  const auto keys = take_supercubes(bytes, kBatchUpdatesMost);
  if (!keys) return damaged(keys.error().message.c_str());
  const auto length = take_varint(bytes);
  if (!length || *length != bytes.size()) return damaged("its length is wrong");

  std::uint64_t updates = 0;
  const char* wrong = nullptr;
  RangeDecoder coder(bytes);
  FlagModel flags;
  ResidualCoder residuals;
  residuals.is_plain = coder.raw_bits(1) != 0;
  FrontCursor cursor(front.state());
  // Reads the flag of the diamond that the cursor found, and splits it if the flag is set. False if the batch is
  // damaged.
  const auto take = [&](int cls) {
    const bool is_split = flags.code(coder, cls, cursor.context().is_mixed(), residuals.is_plain);
    if (coder.is_overdrawn()) {
      wrong = "it has fewer flags than its supercubes call for";
      return false;
    }
    if (!is_split) return true;
    if (updates == kBatchUpdatesMost) {
      wrong = "it has too many updates";
      return false;
    }
    const DiamondContext& context = cursor.gather_cuts();
    Prediction prediction(context);
    const unsigned side_residual = residuals.code_side(coder);
    const Side side = Side((unsigned(prediction.side()) + side_residual) % 3);
    const auto count = context.count_cuts(side);
    std::array<std::uint8_t, kMaxCuts> coded{}, cuts;
    residuals.code_cuts(coder, cls, side_residual, unsigned(count.all), unsigned(count.first), coded.data());
    if (coder.is_overdrawn()) {
      wrong = "it has fewer bytes than its updates call for";
      return false;
    }
    prediction.decode(side, std::span(coded).first(std::size_t(count.all)), cuts.data());
    front.split(cursor, side, std::span(cuts).first(std::size_t(count.all)), max_tets);
    ++updates;
    return true;
  };
  for_each_class(
      keys->size(), [&](std::size_t g) { return (*keys)[g]; },
      [&](std::size_t g, int cls) {
        cursor.move_to((*keys)[g]);
        for (const Slot slot : set_bits<Slot>(kSlotsOfClass[cls] & ~cursor.here().split)) {
          if (cursor.find(slot) && !take(cls)) return false;
        }
        return true;
      });
  if (wrong != nullptr) return damaged(wrong);
  if (!coder.is_spent()) return damaged("it has more than its updates call for");
  return updates;
}

}  // namespace intervale
