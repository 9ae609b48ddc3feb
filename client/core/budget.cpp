#include "client/core/budget.h"

#include <algorithm>
#include <boost/unordered/unordered_flat_map.hpp>
#include <cmath>
#include <utility>

#include "common/util/bits.h"
#include "common/view/screen_error.h"

namespace intervale {
namespace {

// A split takes the place of another one only if it is more important by this factor. So a trembling camera does not
// change the mesh.
constexpr double kHysteresis = 1.1;

// The splits of one supercube.
struct Group {
  double importance = 0;
  SupercubeKey key = 0;
  std::uint64_t slots = 0;
};

// The most important first; of equally important ones, the coarse ones first.
std::vector<Group> by_importance(const std::vector<SlotGroup>& splits, const Importance& importance) {
  std::vector<Group> groups;
  groups.reserve(splits.size());
  for (const SlotGroup& g : splits) groups.push_back({importance(g.key), g.key, g.slots});
  std::sort(groups.begin(), groups.end(),
            [](const Group& a, const Group& b) { return std::pair(-a.importance, a.key) < std::pair(-b.importance, b.key); });
  return groups;
}

// The supercube of a diamond, and its slot there.
Front::Handle handle_of(const Diamond& d) {
  const int up = d.scale + 2;
  return {supercube_key(d.scale, {d.centre.x >> up, d.centre.y >> up, d.centre.z >> up}), kSlotOfType[d.type]};
}

template <class Visit>
void for_each_parent(Front::Handle handle, const Visit& visit) {
  const Diamond d(centre_of(handle.supercube, handle.slot));
  for (int k = 0; k < d.row->parents; ++k) {
    const Vertex c = d.parent(k);
    if ((c.x | c.y | c.z) < 0) continue;
    const Diamond parent(c);
    if (parent.row->cls == 3) continue;  // a corner of the domain
    visit(handle_of(parent));
  }
}

class Balance {
 public:
  Balance(std::span<Front> fronts, std::uint64_t max_tets, const Importance& importance, const SeenBox* region)
      : fronts_(fronts), max_tets_(max_tets), region_(region), groups_(by_importance(fronts[0].splits(), importance)), end_(groups_.size()) {
    for (std::size_t g = 0; g < end_; ++g) place_.emplace(groups_[g].key, g);
  }

  void run() {
    if (region_ != nullptr) hide_outside();
    fit();
    show_what_fits();
    if (tet_count() <= max_tets_) return;
    // Hiding can add tetrahedra: a coarse patch may have more than the fine ones that it replaces.
    wanted_.clear();
    end_ = groups_.size();
    fit();
  }

 private:
  // A split, in the mesh of one of the fronts.
  struct Shown {
    std::size_t front = 0;
    Front::Handle handle;
    friend bool operator==(const Shown&, const Shown&) = default;
  };

  [[nodiscard]] std::uint64_t tet_count() const {
    std::uint64_t tets = 0;
    for (const Front& front : fronts_) tets += front.tet_count();
    return tets;
  }

  // The slots of a supercube whose diamonds meet the region.
  [[nodiscard]] std::uint64_t slots_in_region(SupercubeKey key) const {
    if (region_ == nullptr) return ~std::uint64_t(0);
    const ScreenError::Region around = region_of(fronts_[0].state().domain, key, 1);
    if (!region_->meets(around.middle, around.reach)) return 0;
    std::uint64_t slots = 0;
    for (int i = 0; i < kSlots; ++i) slots |= std::uint64_t(region_->meets(centre_of(key, Slot(i)), std::int32_t(1) << scale_of_key(key))) << i;
    return slots;
  }

  // Children before their parents: a split can be hidden if none of its children is shown.
  void hide_outside() {
    std::vector<SlotGroup> groups = fronts_[0].splits();  // coarse scales first
    for (auto group = groups.rbegin(); group != groups.rend(); ++group) {
      const std::uint64_t outside = group->slots & ~slots_in_region(group->key);
      for (Front& front : fronts_) {
        for (int cls = 2; cls >= 0; --cls) {
          for (const Slot slot : set_bits<Slot>(front.shown_slots(group->key) & outside & kSlotsOfClass[cls])) front.hide({group->key, slot});
        }
      }
    }
  }

  void fit() {
    while (tet_count() > max_tets_ && hide_least(HUGE_VAL)) {
    }
  }

  void show_what_fits() {
    for (std::size_t g = 0; g < end_; ++g) {
      bool any = false;
      for (std::size_t f = 0; f < fronts_.size(); ++f) {
        if (fronts_[f].withheld_count() == 0) continue;
        any = true;
        std::uint64_t hidden = counting_slots(fronts_[f], groups_[g].key) & ~fronts_[f].shown_slots(groups_[g].key);
        if (hidden != 0) hidden &= slots_in_region(groups_[g].key);
        for (const Slot slot : set_bits<Slot>(hidden)) {
          wanted_.clear();
          if (!show({f, {groups_[g].key, slot}}, groups_[g].importance / kHysteresis)) return;
        }
      }
      if (!any) return;
    }
  }

  // The splits of a supercube that count for a front's range. The others follow them.
  [[nodiscard]] static std::uint64_t counting_slots(const Front& front, SupercubeKey key) {
    const FrontState::Block* const block = front.state().find_block(scale_of_key(key), position_of_key(key));
    return block == nullptr ? 0 : block->counts;
  }

  // Shows a split that counts, and its ancestors. Splits less important than `worth` that are not among these make
  // room. False if there is not enough room.
  bool show(const Shown& split, double worth) {
    want(split);
    while (!fronts_[split.front].show(split.handle, tets_left(fronts_, split.front, max_tets_))) {
      if (!hide_least(worth)) return false;
    }
    return true;
  }

  // Of the ancestors, those that are shown keep theirs shown.
  void want(const Shown& split) {
    if (std::find(wanted_.begin(), wanted_.end(), split) != wanted_.end()) return;
    wanted_.push_back(split);
    if (fronts_[split.front].is_hidden(split.handle)) for_each_parent(split.handle, [&](Front::Handle parent) { want({split.front, parent}); });
  }

  // Hides a split if none of its children is shown; then its parents, if they are less important and only this child
  // kept them shown.
  bool hide(const Shown& split) {
    if (std::find(wanted_.begin(), wanted_.end(), split) != wanted_.end() || !fronts_[split.front].hide(split.handle)) return false;
    for_each_parent(split.handle, [&](Front::Handle parent) {
      const auto place = place_.find(parent.supercube);
      if (place != place_.end() && place->second >= end_) hide({split.front, parent});
    });
    return true;
  }

  // Of the least important supercube with anything to hide, hides all that it can. False if each such supercube is at
  // least as important as `worth`.
  bool hide_least(double worth) {
    for (; end_ > 0 && groups_[end_ - 1].importance < worth; --end_) {
      const SupercubeKey key = groups_[end_ - 1].key;
      bool hidden = false;
      for (std::size_t f = 0; f < fronts_.size(); ++f) {
        for (int cls = 2; cls >= 0; --cls) {
          for (const Slot slot : set_bits<Slot>(fronts_[f].shown_slots(key) & kSlotsOfClass[cls])) hidden = hide({f, {key, slot}}) || hidden;
        }
      }
      if (hidden) return true;
    }
    return false;
  }

  std::span<Front> fronts_;
  std::uint64_t max_tets_;
  const SeenBox* region_;                                       // null: everywhere
  std::vector<Group> groups_;                                   // the most important first
  boost::unordered_flat_map<SupercubeKey, std::size_t> place_;  // of a supercube in groups_
  std::size_t end_ = 0;                                         // everything from here on that can be hidden is hidden
  // The split to be shown, and those of its ancestors that are hidden or first above these: not to be hidden.
  std::vector<Shown> wanted_;
};

}  // namespace

Importance size_on_screen(const Camera& camera, const Grid& grid) {
  return [view = ScreenError(camera, grid), domain = Domain(grid.dims)](SupercubeKey key) {
    return std::ldexp(view.pixels_per_unit(region_of(domain, key, 1)), scale_of_key(key));
  };
}

void balance(std::span<Front> fronts, std::uint64_t max_tets, const Importance& importance, const SeenBox* region) {
  Balance(fronts, max_tets, importance, region).run();
}

std::vector<SlotGroup> least_important(const Front& front, std::uint64_t count, std::size_t max_supercubes, const Importance& importance) {
  const std::vector<SlotGroup> splits = front.splits();
  // Slots of the splits not chosen yet; of the others.
  boost::unordered_flat_map<SupercubeKey, std::uint64_t> left, chosen;
  for (const SlotGroup& g : splits) left.emplace(g.key, g.slots);
  const auto is_left = [&left](Front::Handle h) {
    const auto found = left.find(h.supercube);
    return found != left.end() && (found->second >> h.slot & 1) != 0;
  };
  const auto has_child_left = [&is_left](Front::Handle h) {
    const Diamond d(centre_of(h.supercube, h.slot));
    bool any = false;
    for (int k = 0; k < d.row->children && d.has_children() && !any; ++k) {
      const Vertex c = d.child(k);
      any = (c.x | c.y | c.z) >= 0 && is_left(handle_of(Diamond(c)));
    }
    return any;
  };
  // Once the last child of a less important parent is chosen, the parent follows at once.
  const std::vector<Group> groups = by_importance(splits, importance);
  boost::unordered_flat_map<SupercubeKey, std::size_t> place;
  for (std::size_t g = 0; g < groups.size(); ++g) place.emplace(groups[g].key, g);
  std::size_t now = groups.size();
  const auto choose = [&](const auto& again, Front::Handle h) -> void {
    if (count == 0 || !is_left(h) || has_child_left(h)) return;
    if (!chosen.contains(h.supercube) && chosen.size() == max_supercubes) return;
    left[h.supercube] &= ~(std::uint64_t(1) << h.slot);
    chosen[h.supercube] |= std::uint64_t(1) << h.slot;
    --count;
    for_each_parent(h, [&](Front::Handle parent) {
      const auto found = place.find(parent.supercube);
      if (found != place.end() && found->second > now) again(again, parent);
    });
  };
  while (now-- > 0 && count > 0) {
    for (const std::uint64_t cls : {kSlotsOfClass[2], kSlotsOfClass[1], kSlotsOfClass[0]}) {
      for (const Slot slot : set_bits<Slot>(groups[now].slots & cls)) choose(choose, {groups[now].key, slot});
    }
  }
  std::vector<SlotGroup> result;
  for (const auto& [key, slots] : chosen) result.push_back({{}, {}, key, slots});
  std::sort(result.begin(), result.end(), [](const SlotGroup& a, const SlotGroup& b) { return a.key < b.key; });
  return result;
}

}  // namespace intervale
