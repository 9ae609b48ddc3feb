// The model of bench_scaling: many clients that replay recorded sessions at servers which keep pages in a cache. No I/O.
#pragma once

#include <algorithm>
#include <boost/unordered/unordered_flat_map.hpp>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <vector>

namespace intervale::bench {

// Pages in bounded memory; those used least recently leave.
class LruCache {
 public:
  explicit LruCache(std::uint64_t most_bytes) : most_bytes_(most_bytes), entries_(1) {}

  // Whether the page is there. If not, it is from now on, unless it is larger than the cache.
  bool touch(std::uint64_t page, std::uint32_t bytes) {
    if (const auto found = at_.find(page); found != at_.end()) {
      unlink(found->second);
      link(found->second);
      return true;
    }
    if (bytes > most_bytes_) return false;
    while (bytes_ + bytes > most_bytes_) remove_oldest();
    std::uint32_t i = 0;
    if (free_.empty()) {
      i = std::uint32_t(entries_.size());
      entries_.emplace_back();
    } else {
      i = free_.back();
      free_.pop_back();
    }
    entries_[i] = {page, bytes, 0, 0};
    link(i);
    at_.emplace(page, i);
    bytes_ += bytes;
    return false;
  }
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }
  [[nodiscard]] std::size_t pages() const { return at_.size(); }

 private:
  // A ring: entry 0 is no page, after it comes the one used last, before it the one used least recently.
  struct Entry {
    std::uint64_t page = 0;
    std::uint32_t bytes = 0, before = 0, after = 0;
  };
  void unlink(std::uint32_t i) {
    entries_[entries_[i].before].after = entries_[i].after;
    entries_[entries_[i].after].before = entries_[i].before;
  }
  void link(std::uint32_t i) {
    entries_[i].before = 0;
    entries_[i].after = entries_[0].after;
    entries_[entries_[0].after].before = i;
    entries_[0].after = i;
  }
  void remove_oldest() {
    const std::uint32_t i = entries_[0].before;
    unlink(i);
    at_.erase(entries_[i].page);
    bytes_ -= entries_[i].bytes;
    free_.push_back(i);
  }
  std::uint64_t most_bytes_, bytes_ = 0;
  std::vector<Entry> entries_;
  std::vector<std::uint32_t> free_;
  boost::unordered_flat_map<std::uint64_t, std::uint32_t> at_;
};

// Zipf's law: the share of number k, from 0, is proportional to 1 / (k + 1)^exponent.
class Zipf {
 public:
  Zipf(std::uint32_t count, double exponent) {
    double sum = 0;
    for (std::uint32_t k = 0; k < count; ++k) sums_.push_back(sum += std::pow(k + 1.0, -exponent));
    for (double& s : sums_) s /= sum;
  }
  [[nodiscard]] double share(std::uint32_t k) const { return sums_[k] - (k == 0 ? 0 : sums_[k - 1]); }
  // The number at a fraction in [0, 1).
  [[nodiscard]] std::uint32_t at(double fraction) const {
    const auto found = std::upper_bound(sums_.begin(), sums_.end(), fraction);
    return std::uint32_t(std::min(found - sums_.begin(), std::ptrdiff_t(sums_.size()) - 1));
  }

 private:
  std::vector<double> sums_;  // of the shares so far
};

// A second of a recorded session.
struct Second {
  double cpu_seconds = 0, bytes = 0;
  std::uint64_t updates = 0;
  std::vector<std::uint32_t> pages;   // that are read, each once
  std::vector<std::uint32_t> firsts;  // of those, the ones that the session had not read before
};

struct Recording {
  std::vector<Second> seconds;
  double memory_bytes = 0;  // of the session, at its end
};

// A data set, and sessions that were recorded with it.
struct Template {
  std::vector<std::uint32_t> page_bytes;  // as they are stored
  std::vector<std::uint32_t> page_values;
  double bytes_a_value = 0;    // in memory, once decoded, with all that a server keeps of it today
  double seconds_a_value = 0;  // to decode it
  double head_bytes = 0;       // of the file, besides its pages
  std::vector<Recording> users;
  std::vector<Recording> drags;  // of users who drag a range, which are not replayed
};

// Which replica a client is sent to.
enum class Routing : std::uint8_t {
  random,
  hashed,  // by data set
  spread,  // by data set, to two replicas or more, twice as many as its share calls for: of two of them, the one with fewer clients
};

struct Crowd {
  std::uint32_t clients = 0, replicas = 1, data_sets = 1;  // clients: at any time; whoever leaves is replaced
  double exponent = 0.9;                                   // of Zipf's law
  Routing routing = Routing::random;
  std::uint64_t cache_bytes = 0;              // of each replica
  std::uint32_t warm_up = 30, measured = 30;  // seconds
};

// Over all replicas, for each second that was measured.
struct Rates {
  double reads = 0, misses = 0, miss_bytes = 0;  // of pages
  double cpu = 0, decoding = 0;                  // seconds of a core: of sessions, and of missing pages
  double fullest = 1;                            // the processor time of the busiest replica over the mean
  double bytes = 0, updates = 0;                 // sent to clients
  double cached_bytes = 0;                       // at the end
};

[[nodiscard]] inline Rates simulate(const Crowd& crowd, const std::vector<Template>& templates) {
  struct Client {
    std::uint32_t data_set = 0, replica = 0, second = 0;
    const Recording* recording = nullptr;
  };
  std::mt19937_64 random(1);
  const Zipf zipf(crowd.data_sets, crowd.exponent);
  const auto fraction = [&] { return double(random() >> 11) * 0x1p-53; };
  std::vector<std::uint32_t> present(crowd.replicas);  // clients
  const auto begin = [&](Client& c) {
    c.data_set = zipf.at(fraction());
    const Template& from = templates[c.data_set % templates.size()];
    c.recording = &from.users[random() % from.users.size()];
    c.second = 0;
    const std::uint64_t home = std::mt19937_64(c.data_set + 1)();
    const double share = zipf.share(c.data_set) * crowd.replicas;
    const auto wide = crowd.routing == Routing::random   ? crowd.replicas
                      : crowd.routing == Routing::hashed ? 1
                                                         : std::min(crowd.replicas, 1 + std::uint32_t(std::ceil(2 * share)));
    const auto one = [&] { return std::uint32_t((home + random() % wide) % crowd.replicas); };
    c.replica = one();
    if (const std::uint32_t other = one(); crowd.routing == Routing::spread && present[other] < present[c.replica]) c.replica = other;
    ++present[c.replica];
  };
  std::vector<Client> clients(crowd.clients);
  for (Client& c : clients) {
    begin(c);
    c.second = std::uint32_t(random() % c.recording->seconds.size());
  }
  std::vector<LruCache> caches(crowd.replicas, LruCache(crowd.cache_bytes));
  std::vector<double> busy(crowd.replicas);
  Rates sum;
  for (std::uint32_t now = 0; now < crowd.warm_up + crowd.measured; ++now) {
    if (now == crowd.warm_up) {
      sum = {};
      std::fill(busy.begin(), busy.end(), 0);
    }
    for (Client& c : clients) {
      if (c.second == c.recording->seconds.size()) {
        --present[c.replica];
        begin(c);
      }
      const Second& second = c.recording->seconds[c.second++];
      const Template& data = templates[c.data_set % templates.size()];
      double decoding = 0;
      for (const std::uint32_t page : second.pages) {
        const double values = data.page_values[page];
        if (caches[c.replica].touch(std::uint64_t(c.data_set) << 32 | page, std::uint32_t(values * data.bytes_a_value))) continue;
        ++sum.misses;
        sum.miss_bytes += data.page_bytes[page];
        decoding += values * data.seconds_a_value;
      }
      sum.reads += double(second.pages.size());
      sum.cpu += second.cpu_seconds;
      sum.decoding += decoding;
      sum.bytes += second.bytes;
      sum.updates += double(second.updates);
      busy[c.replica] += second.cpu_seconds + decoding;
    }
  }
  for (double* rate : {&sum.reads, &sum.misses, &sum.miss_bytes, &sum.cpu, &sum.decoding, &sum.bytes, &sum.updates}) *rate /= crowd.measured;
  const double mean = (sum.cpu + sum.decoding) * crowd.measured / crowd.replicas;
  sum.fullest = mean > 0 ? *std::max_element(busy.begin(), busy.end()) / mean : 1;
  for (const LruCache& cache : caches) sum.cached_bytes += double(cache.bytes());
  return sum;
}

}  // namespace intervale::bench
