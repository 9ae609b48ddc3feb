// Not installed: what is known inside of a data set, as the libraries tell it.
#pragma once

#include "common/api/data_set_info.h"
#include "common/patch/description.h"

namespace intervale {

[[nodiscard]] DataSetInfo info_of(const Description& description);

}  // namespace intervale
