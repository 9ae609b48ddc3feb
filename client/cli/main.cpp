#include "client/cli/commands.h"

int main(int argc, char** argv) {
  intervale::Program program("intervale-client", "Receives interval volumes from a server and writes or draws meshes");
  intervale::add_list_command(program);
  intervale::add_fetch_command(program);
  return program.run(argc, argv);
}
