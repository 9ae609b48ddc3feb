// The functions that the time goes into, one at a time, on a sample of the product's own.
#include <benchmark/benchmark.h>

#include <memory>
#include <vector>

#include "common/codec/value_coder.h"
#include "common/ivm/batch_encoder.h"
#include "common/ivm/extraction.h"
#include "common/ivm/ivm_file.h"
#include "common/ivm/refinement.h"
#include "common/ivm/split_lattice.h"
#include "common/selection/stream_plan.h"
#include "protocol/limits.h"
#include "server/builder/field_hierarchy.h"
#include "tests/bench/cases.h"
#include "tests/bench/delta.h"
#include "tests/support/batches.h"

namespace intervale::bench {
namespace {

constexpr int kSize = 97;  // samples a side: large enough that nothing fits a cache it would not fit in use

struct Fixture {
  Case c = *sample_case("gyroid", kSize);
  FieldHierarchy hierarchy{*c.volume, {c.range, c.refine, {}}};
  std::shared_ptr<const IntervalVolume> sigma = std::make_shared<const IntervalVolume>(*hierarchy.compact(c.format));
  std::vector<Place> places;                        // of all updates, coarse to fine
  std::vector<std::vector<std::uint8_t>> payloads;  // of the whole stream
  SplitSet all{sigma->set()};

  Fixture() {
    sigma->set().for_each_down([this](const Place& p) {
      places.push_back(p);
      all.insert(p);
    });
    StreamPlan plan(sigma);
    plan.set_lod(Lod{});
    while (auto batch = plan.next(protocol::kMaxBatchPayload)) payloads.push_back(std::move(batch->payload));
  }
};

const Fixture& fixture() {
  static const Fixture made;
  return made;
}

void count_items(benchmark::State& state, std::size_t items) { state.SetItemsProcessed(std::int64_t(state.iterations()) * std::int64_t(items)); }

void find_update(benchmark::State& state) {
  const auto& f = fixture();
  for (auto _ : state) {
    for (const Place& p : f.places) benchmark::DoNotOptimize(f.sigma->set().find(SupercubeSet::centre(p)));
  }
  count_items(state, f.places.size());
}
BENCHMARK(find_update);

void gather(const SplitLattice& lattice, Slot slot, VertexKeys& around) {
  switch (class_of_slot(slot)) {
    case 0:
      lattice.gather<0>(slot, around);
      break;
    case 1:
      lattice.gather<1>(slot, around);
      break;
    default:
      lattice.gather<2>(slot, around);
  }
}

// The keys at the vertices of each update's diamond, and at its centre.
void look_up_update(benchmark::State& state) {
  const auto& f = fixture();
  VertexKeys around{};
  for (auto _ : state) {
    SplitLattice lattice(*f.sigma, f.all);
    for (const Place& p : f.places) {
      lattice.move_to(p.key);
      benchmark::DoNotOptimize(lattice.splittable(std::uint64_t(1) << p.slot));
      gather(lattice, p.slot, around);
      benchmark::DoNotOptimize(around);
      benchmark::DoNotOptimize(f.sigma->key(p.index));
    }
  }
  count_items(state, f.places.size());
}
BENCHMARK(look_up_update)->Unit(benchmark::kMillisecond);

void predict_values(benchmark::State& state) {
  const auto& f = fixture();
  const Description& d = f.sigma->description();
  SplitLattice lattice(*f.sigma, f.all);
  std::vector<VertexKeys> around(f.places.size());
  for (std::size_t i = 0; i < f.places.size(); ++i) {
    lattice.move_to(f.places[i].key);
    if (lattice.splittable(std::uint64_t(1) << f.places[i].slot) != 0) gather(lattice, f.places[i].slot, around[i]);
  }
  for (auto _ : state) {
    for (std::size_t i = 0; i < f.places.size(); ++i) {
      const Place& p = f.places[i];
      benchmark::DoNotOptimize(predict_value(class_of_slot(p.slot), scale_of_key(p.key), around[i], d.weights, d.format.last));
    }
  }
  count_items(state, f.places.size());
}
BENCHMARK(predict_values)->Unit(benchmark::kMillisecond);

void apply_batches(benchmark::State& state) {
  const auto& f = fixture();
  for (auto _ : state) {
    Front front = root_front(f.sigma->description());
    for (const auto& payload : f.payloads) benchmark::DoNotOptimize(testing::apply_to(front, f.sigma->description(), payload).has_value());
  }
  count_items(state, f.places.size());
}
BENCHMARK(apply_batches)->Unit(benchmark::kMillisecond);

// As large a batch as there may be, of a client that has all others.
void encode_one_batch(benchmark::State& state) {
  const auto& f = fixture();
  std::vector<SlotGroup> groups;
  std::size_t updates = 0;
  const SupercubeSet& set = f.sigma->set();
  for (BrickIndex b{0}; b < set.bricks().size(); ++b) {
    set.for_each_supercube(b, [&](SupercubeIndex s, SupercubeKey key) {
      const auto more = std::size_t(std::popcount(set.occupancy()[s]));
      if (updates + more > kBatchUpdatesMost) return;
      updates += more;
      groups.push_back({b, s, key, set.occupancy()[s]});
    });
  }
  for (auto _ : state) benchmark::DoNotOptimize(encode_batch(*f.sigma, {f.sigma->description().whole()}, f.all, groups));
  count_items(state, updates);
}
BENCHMARK(encode_one_batch)->Unit(benchmark::kMillisecond);

void plan_stream(benchmark::State& state) {
  const auto& f = fixture();
  for (auto _ : state) {
    StreamPlan plan(f.sigma);
    plan.set_lod(Lod{});
    while (auto batch = plan.next(protocol::kMaxBatchPayload)) benchmark::DoNotOptimize(batch->payload.data());
  }
  count_items(state, f.places.size());
}
BENCHMARK(plan_stream)->Unit(benchmark::kMillisecond);

// Items: tetrahedra.
void make_mesh(benchmark::State& state) {
  const auto& f = fixture();
  const auto extraction = extract(*f.sigma, Lod{});
  for (auto _ : state) benchmark::DoNotOptimize(extraction->front.mesh());
  count_items(state, f.sigma->description().full.tets);
}
BENCHMARK(make_mesh)->Unit(benchmark::kMillisecond);

// Argument: percent of the largest error.
void select_updates(benchmark::State& state) {
  const auto& f = fixture();
  Lod lod;
  lod.error_percent = double(state.range(0));
  for (auto _ : state) benchmark::DoNotOptimize(select(*f.sigma, lod));
  count_items(state, f.places.size());
}
BENCHMARK(select_updates)->Arg(0)->Arg(3)->Unit(benchmark::kMicrosecond);

void select_in_box(benchmark::State& state) {
  const auto& f = fixture();
  Lod lod;
  lod.roi = Box{{-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5}};
  for (auto _ : state) benchmark::DoNotOptimize(select(*f.sigma, lod));
  count_items(state, f.places.size());
}
BENCHMARK(select_in_box)->Unit(benchmark::kMicrosecond);

void decode_file(benchmark::State& state) {
  const auto& f = fixture();
  const auto bytes = encode_ivm(*f.sigma);
  for (auto _ : state) benchmark::DoNotOptimize(decode_ivm(bytes, "gyroid").has_value());
  count_items(state, f.places.size());
}
BENCHMARK(decode_file)->Unit(benchmark::kMillisecond);

// Items: samples. All cores.
void measure_field(benchmark::State& state) {
  const auto& f = fixture();
  for (auto _ : state) benchmark::DoNotOptimize(FieldHierarchy(*f.c.volume, {f.c.range, f.c.refine, {}}).set().size());
  count_items(state, f.c.volume->grid.sample_count());
}
BENCHMARK(measure_field)->Unit(benchmark::kMillisecond)->UseRealTime();

void compact_field(benchmark::State& state) {
  const auto& f = fixture();
  for (auto _ : state) benchmark::DoNotOptimize(f.hierarchy.compact(f.c.format).has_value());
  count_items(state, f.c.volume->grid.sample_count());
}
BENCHMARK(compact_field)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace intervale::bench
