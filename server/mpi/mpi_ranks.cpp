#include "server/mpi/mpi_ranks.h"

#define OMPI_SKIP_MPICXX 1  // bindings that MPI 3 has dropped
#include <mpi.h>

#include <algorithm>
#include <cstdlib>

namespace intervale {
namespace {

constexpr std::size_t kAtOnce = 1 << 22;  // elements: MPI counts in int, and takes memory for as many again

template <class T>
void reduce(std::span<T> values, MPI_Datatype type, MPI_Op operation) {
  for (; !values.empty(); values = values.subspan(std::min(kAtOnce, values.size())))
    MPI_Allreduce(MPI_IN_PLACE, values.data(), int(std::min(kAtOnce, values.size())), type, operation, MPI_COMM_WORLD);
}

}  // namespace

MpiRanks::MpiRanks(int& argc, char**& argv) {
  int provided = 0;
  MPI_Init_thread(&argc, &argv, MPI_THREAD_FUNNELED, &provided);
  MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
  MPI_Comm_size(MPI_COMM_WORLD, &size_);
}

MpiRanks::~MpiRanks() { MPI_Finalize(); }

void MpiRanks::max(std::span<float> values) { reduce(values, MPI_FLOAT, MPI_MAX); }
void MpiRanks::max(std::span<double> values) { reduce(values, MPI_DOUBLE, MPI_MAX); }
void MpiRanks::sum(std::span<std::uint64_t> values) { reduce(values, MPI_UINT64_T, MPI_SUM); }
void MpiRanks::unite(std::span<std::uint8_t> bits) { reduce(bits, MPI_BYTE, MPI_BOR); }

std::vector<std::vector<std::byte>> MpiRanks::gather(std::span<const std::byte> bytes) {
  std::uint64_t own = bytes.size();
  std::vector<std::uint64_t> sizes(std::size_t(size_), 0);
  MPI_Allgather(&own, 1, MPI_UINT64_T, sizes.data(), 1, MPI_UINT64_T, MPI_COMM_WORLD);
  std::vector<std::vector<std::byte>> all;
  for (int rank = 0; rank < size_; ++rank) {
    std::vector<std::byte>& to = all.emplace_back(sizes[std::size_t(rank)]);
    if (rank == rank_) std::copy(bytes.begin(), bytes.end(), to.begin());
    for (std::size_t at = 0; at < to.size(); at += kAtOnce)
      MPI_Bcast(to.data() + at, int(std::min(kAtOnce, to.size() - at)), MPI_BYTE, rank, MPI_COMM_WORLD);
  }
  return all;
}

void MpiRanks::abort(int status) {
  MPI_Abort(MPI_COMM_WORLD, status);
  std::_Exit(status);
}

}  // namespace intervale
