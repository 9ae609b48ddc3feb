// Delta: the hierarchy of diamonds over the whole field, with which diamonds are relevant to a range and their errors.
//
// Weiss and De Floriani 2008, sections 4 and 6. Sigma (interval_volume.h) is made from it; and it is the baseline that Sigma is compared with, for it
// can be refined too: every side and cut is then computed from samples. Where the paper keeps a minimum and maximum for each diamond and tests them
// in each query, this keeps the answer for one range, one bit a diamond.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "common/codec/root_patch.h"
#include "common/diamond/domain.h"
#include "common/diamond/supercube.h"
#include "common/ivm/interval_volume.h"
#include "common/patch/description.h"
#include "server/builder/outline.h"
#include "server/volume/volume.h"

namespace intervale {

struct BuildOptions {
  Range range;  // alpha <= beta
  Refine refine = Refine::boundary;
  std::function<void(double)> progress = {};  // called now and then with the share done, 0 to 1, from any thread but never from two at once
};

class FieldHierarchy {
 public:
  // Samples finite; the volume must outlive the hierarchy. Uses all cores that oneTBB may. Beside the volume it takes half a byte a sample to
  // find the relevant diamonds, and then 4 bytes for each of them.
  FieldHierarchy(const Volume& volume, const BuildOptions& options);

  [[nodiscard]] const Domain& domain() const { return domain_; }
  [[nodiscard]] const SupercubeSet& set() const { return set_; }         // the relevant diamonds
  [[nodiscard]] float error(UpdateIndex i) const { return errors_[i]; }  // saturated over relevant children, rounded up to a float
  [[nodiscard]] Side side(Vertex v) const;                               // of any vertex
  [[nodiscard]] RootPatch root_patch() const;

  // What a diamond of a front knows before its split, and the cuts on its subdivision edges in the order in which Front::split takes them.
  [[nodiscard]] DiamondContext context(const Diamond& d) const;
  [[nodiscard]] std::vector<std::uint8_t> cuts(const Diamond& d) const;

  // Makes Sigma. The description's name is the volume's.
  [[nodiscard]] Result<IntervalVolume> compact() const;

 private:
  [[nodiscard]] double value(Vertex v) const;  // of any vertex: the sample it clamps to
  void measure_errors(const std::function<void(double)>& progress);
  void saturate(std::vector<float>& errors) const;
  [[nodiscard]] std::vector<Yield> yields(double max_error, const std::vector<UpdateCode>& codes, const std::vector<float>& levels) const;

  const Volume& volume_;
  Range range_;
  Refine refine_;
  Domain domain_;
  std::vector<Outlines> outlines_;  // by scale
  SupercubeSet set_;
  std::uint64_t unit_cuts_ = 0;  // vertices of the full mesh that are cuts
  std::vector<float> errors_;
};

}  // namespace intervale
