// The commands of intervale-client, one file each.
#pragma once

#include "common/program/program.h"

namespace intervale {

void add_list_command(Program& program);
void add_fetch_command(Program& program);

}  // namespace intervale
