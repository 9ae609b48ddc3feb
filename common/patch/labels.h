// What the numbers of a data set mean to people.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "common/util/export.h"
#include "common/util/result.h"

namespace intervale {

inline constexpr std::size_t kMaxLabel = 64;  // bytes

// Each as is_label() accepts it; empty if it is not known.
struct Labels {
  std::string unit;        // of length
  std::string field;       // the field's name
  std::string field_unit;  // of its values
  std::string space{};     // directions of the world's axes: "RAS" is right, anterior, superior; "LPS" left, posterior, superior
  friend bool operator==(const Labels&, const Labels&) = default;
};

// Whether a text is UTF-8 of at most kMaxLabel bytes, without control characters.
[[nodiscard]] INTERVALE_EXPORT bool is_label(std::string_view text);

// Fails if one of them is no label.
[[nodiscard]] INTERVALE_EXPORT Result<void> check_labels(const Labels& labels);

}  // namespace intervale
