#include "common/util/interned_words.h"

#include <random>

namespace intervale {

// By a secret of the process, since words follow what clients choose: nobody can make many that have the same place.
InternedWords::Hash InternedWords::hash_of(std::uint64_t word) {
  static const std::uint64_t kSecret = [] {
    std::random_device random;
    return std::uint64_t(random()) << 32 | random();
  }();
  std::uint64_t mixed = word ^ kSecret;  // the finalizer of MurmurHash3, Austin Appleby
  mixed = (mixed ^ mixed >> 33) * 0xff51afd7ed558ccd;
  mixed = (mixed ^ mixed >> 33) * 0xc4ceb9fe1a85ec53;
  return {std::size_t(mixed >> 60), std::size_t(mixed >> 40) % kPlaces};
}

std::size_t InternedWords::find(const Hash& hash, std::uint64_t word) const {
  const Shard& shard = shards_[hash.shard];
  std::size_t place = hash.place;
  while (true) {
    const std::uint16_t at = shard.places[place].load(std::memory_order_acquire);
    if (at == 0 || (*this)[number_of(hash.shard, at)] == word) return place;
    place = (place + 1) % kPlaces;
  }
}

// Uses a word whose number may just have got another one, if it is used by others.
bool InternedWords::use_if_used(Number number) {
  Uses uses = uses_[number].load(std::memory_order_acquire);
  while (uses != 0 && uses != kForever) {
    if (uses_[number].compare_exchange_weak(uses, Uses(uses + 1), std::memory_order_acq_rel)) return true;
  }
  return uses == kForever;
}

std::optional<InternedWords::Number> InternedWords::use(std::uint64_t word) {
  const Hash hash = hash_of(word);
  Shard& shard = shards_[hash.shard];
  if (const unsigned at = shard.places[find(hash, word)].load(std::memory_order_acquire); at != 0) {
    const Number number = number_of(hash.shard, at);
    if (use_if_used(number)) {
      if ((*this)[number] == word) return number;
      release(number);
    }
  }
  if (shard.is_full()) return {};
  const std::lock_guard lock(shard.changing);
  const std::size_t place = find(hash, word);
  if (const unsigned at = shard.places[place].load(std::memory_order_relaxed); at != 0) {
    const Number number = number_of(hash.shard, at);
    if (!use_if_used(number)) uses_[number].store(1, std::memory_order_release);  // who wanted to remove it looks again
    return number;
  }
  if (shard.is_full()) return {};
  std::uint16_t in_shard = shard.free;
  if (in_shard != 0) {
    shard.free = std::uint16_t((*this)[number_of(hash.shard, in_shard)]);
  } else {
    in_shard = ++shard.numbers;
  }
  const Number number = number_of(hash.shard, in_shard);
  words_[number].store(word, std::memory_order_relaxed);
  uses_[number].store(1, std::memory_order_release);
  shard.places[place].store(in_shard, std::memory_order_release);
  return number;
}

void InternedWords::use_again(Number number) { (void)use_if_used(number); }

void InternedWords::release(Number number) {
  Uses uses = uses_[number].load(std::memory_order_relaxed);
  do {
    if (uses == kForever) return;
  } while (!uses_[number].compare_exchange_weak(uses, Uses(uses - 1), std::memory_order_acq_rel));
  if (uses == 1) remove(number);
}

// Takes its number from a word that is not used any more, unless it is again, or another thread has done so.
void InternedWords::remove(Number number) {
  const std::size_t in = number / kNumbers;
  Shard& shard = shards_[in];
  const std::lock_guard lock(shard.changing);
  if (uses_[number].load(std::memory_order_acquire) != 0) return;
  const Hash hash = hash_of((*this)[number]);
  std::size_t hole = find(hash, (*this)[number]);
  const auto in_shard = std::uint16_t(number % kNumbers + 1);
  if (shard.places[hole].load(std::memory_order_relaxed) != in_shard) return;
  // Those behind move up, as far as they are not before their own place then.
  for (std::size_t place = (hole + 1) % kPlaces;; place = (place + 1) % kPlaces) {
    const std::uint16_t at = shard.places[place].load(std::memory_order_relaxed);
    if (at == 0) break;
    const std::size_t own = hash_of((*this)[number_of(in, at)]).place;
    if ((place - own) % kPlaces < (place - hole) % kPlaces) continue;
    shard.places[hole].store(at, std::memory_order_release);
    hole = place;
  }
  shard.places[hole].store(0, std::memory_order_release);
  words_[number].store(shard.free, std::memory_order_relaxed);
  shard.free = in_shard;
}

}  // namespace intervale
