// Delta as the paper has it: the hierarchy of diamonds over the whole field, from which the mesh of any range is
// extracted. The baseline of Table 2.
//
// Weiss and De Floriani 2008, section 4: beside the samples it keeps the error of every diamond, and the least and the
// greatest value in it, which say whether the diamond is relevant to a range. FieldHierarchy (server/builder) answers
// that for one range only; this one answers it in each query.
//
// Where it differs from the paper: there a query computes the side of each centre and the coefficients of the cuts from
// samples. Here it computes the key of the sample, because that is what a front is split by. The front derives the
// sides and, when it makes the mesh, the cuts: for Delta and for Sigma alike.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "common/front/front.h"
#include "common/patch/description.h"
#include "common/patch/volume.h"

namespace intervale::bench {

class Delta {
 public:
  virtual ~Delta() = default;

  // In which order a query goes down, and how it asks the front.
  enum class Walk {
    diamonds,    // the paper's: diamond by diamond, each found by its centre
    supercubes,  // the fastest we know: supercube by supercube, as Sigma's queries go, though nothing of Delta is held so
  };

  // The front in which every relevant diamond with a saturated error above `error` (field units) is split; at error 0
  // every relevant one. Virtual once a query: inside, everything knows the samples' type. One thread.
  [[nodiscard]] virtual Front refine(const Range& range, Refine mode, double error, Walk walk) const = 0;

  // Errors and values of all diamonds, the samples not counted.
  [[nodiscard]] virtual std::size_t memory_bytes() const = 0;
};

// Measures every diamond; on all cores that oneTBB may use. Samples finite; the volume must outlive what comes back.
// format: one whose values all samples are.
[[nodiscard]] std::unique_ptr<Delta> make_delta(const Volume& volume, const ValueFormat& format);

}  // namespace intervale::bench
