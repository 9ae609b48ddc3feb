#include "client/core/budget.h"

#include <algorithm>
#include <bit>
#include <boost/unordered/unordered_flat_map.hpp>
#include <cmath>
#include <utility>
#include <vector>

#include "common/view.h"

namespace intervale {
namespace {

constexpr double kWorthIt = 1.1;  // what is shown instead of something else matters more by this: a view that trembles does not change the mesh

class Balance {
 public:
  Balance(Front& front, std::uint64_t max_tets, const Importance& importance) : front_(front), max_tets_(max_tets) {
    for (const SlotGroup& g : front.splits()) groups_.push_back({importance(g.key), g.key, g.slots});
    // Of those that matter alike, coarse ones come first.
    std::sort(groups_.begin(), groups_.end(),
              [](const Group& a, const Group& b) { return std::pair(-a.importance, a.key) < std::pair(-b.importance, b.key); });
    end_ = groups_.size();
    for (std::size_t g = 0; g < end_; ++g) place_.emplace(groups_[g].key, g);
  }

  void run() {
    while (front_.tet_count() > max_tets_ && hide_least(HUGE_VAL)) {
    }
    for (std::size_t g = 0; g < end_ && front_.shown_count() < front_.split_count(); ++g) {
      const std::uint64_t hidden = groups_[g].slots & ~front_.shown_slots(groups_[g].key);
      for (std::uint64_t left = hidden; left != 0; left &= left - 1) {
        wanted_.clear();
        if (!show({groups_[g].key, std::countr_zero(left)}, groups_[g].importance / kWorthIt)) return;
      }
    }
  }

 private:
  struct Group {
    double importance = 0;
    SupercubeKey key = 0;
    std::uint64_t slots = 0;
  };

  // Shows a split and its ancestors; what matters less than `worth` and is not one of them makes room. False if there is none.
  bool show(Front::Handle handle, double worth) {
    wanted_.push_back(handle);
    if (!front_.is_hidden(handle)) return true;
    bool all = true;
    for_each_parent(handle, [&](Front::Handle parent) { all = all && show(parent, worth); });
    if (!all) return false;
    while (!front_.show(handle, max_tets_)) {
      if (!hide_least(worth)) return false;
    }
    return true;
  }

  template <class Visit>
  static void for_each_parent(Front::Handle handle, const Visit& visit) {
    const Diamond d(centre_of(handle.supercube, handle.slot));
    for (int k = 0; k < d.row->parents; ++k) {
      const Vertex c = d.parent(k);
      if ((c.x | c.y | c.z) < 0) continue;
      const Diamond parent(c);
      if (parent.row->cls == 3) continue;  // a corner of the domain
      const int up = parent.scale + 2;
      visit({supercube_key(parent.scale, {c.x >> up, c.y >> up, c.z >> up}), kSlotOfType[parent.type]});
    }
  }

  // Hides a split if none of its children is shown, and then its ancestors that waited for that: those that matter less.
  bool hide(Front::Handle handle) {
    if (std::find(wanted_.begin(), wanted_.end(), handle) != wanted_.end() || !front_.hide(handle)) return false;
    for_each_parent(handle, [&](Front::Handle parent) {
      const auto place = place_.find(parent.supercube);
      if (place != place_.end() && place->second >= end_) hide(parent);
    });
    return true;
  }

  // Hides what it can of the last supercube that has something to hide and matters less than `worth`. False if there is none.
  bool hide_least(double worth) {
    for (; end_ > 0 && groups_[end_ - 1].importance < worth; --end_) {
      const SupercubeKey key = groups_[end_ - 1].key;
      bool hidden = false;
      for (int cls = 2; cls >= 0; --cls) {
        for (std::uint64_t left = front_.shown_slots(key) & kSlotsOfClass[cls]; left != 0; left &= left - 1) {
          hidden = hide({key, std::countr_zero(left)}) || hidden;
        }
      }
      if (hidden) return true;
    }
    return false;
  }

  Front& front_;
  std::uint64_t max_tets_;
  std::vector<Group> groups_;                                   // what matters most first
  boost::unordered_flat_map<SupercubeKey, std::size_t> place_;  // of a group among them
  std::size_t end_ = 0;                                         // from here on all is hidden that could be
  std::vector<Front::Handle> wanted_;                           // a split to be shown, and those of its ancestors that were looked at
};

}  // namespace

Importance size_on_screen(const Camera& camera, const Grid& grid) {
  return [view = View(camera, grid), domain = Domain(grid.dims)](SupercubeKey key) {
    return std::ldexp(view.pixels_per_unit(region_of(domain, key, 1)), scale_of_key(key));
  };
}

void balance(Front& front, std::uint64_t max_tets, const Importance& importance) { Balance(front, max_tets, importance).run(); }

}  // namespace intervale
