// Files in the browser: what is written to an AtomicFile is kept in memory.
#pragma once

#include <cstddef>
#include <vector>

namespace intervale {

// What was committed last; then nothing, until something else is.
[[nodiscard]] std::vector<std::byte> take_committed_file();

}  // namespace intervale
