// The commands of intervale, one file each.
#pragma once

#include "common/program/program.h"

namespace intervale {

void add_sample_command(Program& program);
void add_build_command(Program& program);
void add_info_command(Program& program);
void add_verify_command(Program& program);
void add_extract_command(Program& program);
void add_serve_command(Program& program);

}  // namespace intervale
