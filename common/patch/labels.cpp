#include "common/patch/labels.h"

#include "common/util/printable.h"
#include "common/util/utf8.h"

namespace intervale {

bool is_label(std::string_view text) { return text.size() <= kMaxLabel && is_utf8(text) && !has_control_characters(text); }

Result<void> check_labels(const Labels& labels) {
  if (is_label(labels.unit) && is_label(labels.field) && is_label(labels.field_unit) && is_label(labels.space)) return {};
  return fail("a unit, the field's name or the world's space is not UTF-8 of at most " + std::to_string(kMaxLabel) +
              " bytes without control characters");
}

}  // namespace intervale
