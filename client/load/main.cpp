#include "client/load/load_command.h"

int main(int argc, char** argv) {
  intervale::Program program("intervale-load", "Runs many clients that change their views, and measures what a server sends them");
  intervale::add_load_command(program);
  return program.run(argc, argv);
}
