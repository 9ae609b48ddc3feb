// The command line of intervale-load.
#pragma once

#include "common/program/program.h"

namespace intervale {

void add_load_command(Program& program);

}  // namespace intervale
