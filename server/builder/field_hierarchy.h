// Delta: the hierarchy of diamonds over the whole field, with the diamonds that are relevant to a range, and their
// errors.
//
// Weiss and De Floriani 2008, sections 4 and 6. Sigma (interval_volume.h) is made from it. Where the paper stores a
// minimum and maximum for each diamond and tests them in each query, this stores the result for one range, one bit a
// diamond.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "common/diamond/domain.h"
#include "common/diamond/supercube.h"
#include "common/ivm/interval_volume.h"
#include "common/patch/description.h"
#include "common/patch/range.h"
#include "common/patch/volume.h"
#include "common/ranges/border_shape.h"
#include "server/builder/kept_errors.h"

namespace intervale {

struct BuildOptions {
  Range range;  // alpha <= beta
  Refine refine = Refine::boundary;
  std::function<void(double)> progress = {};  // called with the fraction done, 0 to 1, from any thread, one call at a time
  KeptErrors* kept = nullptr;                 // errors of this very volume that were measured before, and where others go
};

template <class T>
struct Field;

class FieldHierarchy {
 public:
  // Samples are finite; the volume must outlive the hierarchy. Throws as find_relevant() does. Uses all cores that
  // oneTBB may. Memory beside the volume: half a byte a sample to find the relevant diamonds, then 4 bytes for each of
  // them.
  FieldHierarchy(const Volume& volume, const BuildOptions& options);

  [[nodiscard]] const Domain& domain() const { return domain_; }
  [[nodiscard]] const SupercubeSet& set() const { return set_; }         // the relevant diamonds
  [[nodiscard]] float error(UpdateIndex i) const { return errors_[i]; }  // saturated over relevant children, rounded up to a float
  [[nodiscard]] Side side(Vertex v) const;                               // of any vertex

  // Builds Sigma. The description's name is the volume's. format: one whose values all samples are (round_samples());
  // without it, an exact one, which may fail (choose_value_format() with step 0). is_exact: whether the samples are
  // those of the input.
  [[nodiscard]] Result<IntervalVolume> compact(const std::optional<ValueFormat>& format = {}, bool is_exact = true) const;
  // The same, to be assembled.
  [[nodiscard]] Result<IntervalVolume::Parts> parts(const std::optional<ValueFormat>& format, bool is_exact) const;

 private:
  [[nodiscard]] double value(Vertex v) const;  // of any vertex: the sample it clamps to
  void measure_errors(const std::function<void(double)>& progress, KeptErrors* kept);
  struct BrickPart;
  template <class T>
  [[nodiscard]] BrickPart count_brick(const Field<T>& field, BrickIndex brick) const;
  [[nodiscard]] FullMesh full_mesh(const std::vector<BrickPart>& parts) const;

  const Volume& volume_;
  Range range_;
  Refine refine_;
  Domain domain_;
  std::vector<BorderShapes> shapes_;  // by scale
  SupercubeSet set_;
  std::uint64_t unit_cuts_ = 0;  // vertices of the full mesh that are cuts
  std::vector<float> errors_;
};

}  // namespace intervale
