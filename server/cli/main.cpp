#include "common/parallel/all_cores.h"
#include "server/cli/commands.h"
#include "server/cli/mpi_program.h"

int main(int argc, char** argv) {
  intervale::become_mpi_program(argc, argv);
  const intervale::AllCores all_cores;
  intervale::Program program("intervale", "Build, inspect, extract and serve multiresolution interval volumes");
  intervale::add_sample_command(program);
  intervale::add_build_command(program);
  intervale::add_info_command(program);
  intervale::add_verify_command(program);
  intervale::add_extract_command(program);
  intervale::add_serve_command(program);
  return program.run(argc, argv);
}
