#include "server/cli/mpi_program.h"

#include <fmt/core.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <initializer_list>
#include <system_error>

#include "common/program/program.h"

namespace intervale {
namespace {

// The number in the first of these variables that is set; -1: none is.
long number_of(std::initializer_list<const char*> names) {
  for (const char* name : names) {
    if (const char* const text = std::getenv(name)) return std::strtol(text, nullptr, 10);
  }
  return -1;
}

}  // namespace

void become_mpi_program(int argc, char** argv) {
  if (argc < 2 || std::strcmp(argv[1], "build") != 0) return;
  // Of Open MPI's mpirun; of srun, which speaks PMI or PMIx.
  const long rank = number_of({"OMPI_COMM_WORLD_RANK", "PMIX_RANK", "PMI_RANK"});
  if (rank < 0 || number_of({"OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "SLURM_STEP_NUM_TASKS"}) < 2) return;
  std::error_code none;
  const auto folder = std::filesystem::read_symlink("/proc/self/exe", none).parent_path();
  for (const auto& program : {folder / "intervale-mpi", folder.parent_path() / "libexec" / "intervale" / "intervale-mpi"})
    ::execv(program.c_str(), argv);  // returns if it is not there
  if (rank == 0) fmt::print(stderr, "intervale: this program was built without MPI, and builds with one rank only\n");
  std::exit(kExitFailed);
}

}  // namespace intervale
