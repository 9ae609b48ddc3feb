#include "client/load/load_command.h"

int main(int argc, char** argv) {
  intervale::Program program("intervale-load", "Loads a server with many clients that change their views, and measures what they get");
  intervale::add_load_command(program);
  return program.run(argc, argv);
}
