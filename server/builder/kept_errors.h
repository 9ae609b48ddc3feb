// Errors of diamonds that outlive the program that measures them, so that another one goes on from there.
#pragma once

#include <span>

namespace intervale {

// One thread.
class KeptErrors {
 public:
  KeptErrors() = default;
  KeptErrors(const KeptErrors&) = delete;
  KeptErrors& operator=(const KeptErrors&) = delete;
  virtual ~KeptErrors() = default;

  // Sets the errors of all relevant diamonds of a scale, by number and not saturated, if they were kept. False: they are
  // not there, and what `errors` holds is undefined.
  [[nodiscard]] virtual bool find_errors(int scale, std::span<float> errors) = 0;
  // What it throws ends the build.
  virtual void keep_errors(int scale, std::span<const float> errors) = 0;
};

}  // namespace intervale
