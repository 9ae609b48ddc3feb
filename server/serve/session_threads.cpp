#include "server/serve/session_threads.h"

namespace intervale {

using protocol::CloseCode;
using protocol::Fault;

SessionState::Find find_granted(const AtomicSharedPtr<Catalogue>& catalogue, std::shared_ptr<const Scope> scope) {
  return [&catalogue, scope = std::move(scope)](const std::string& name) -> tl::expected<SessionState::Volume, Fault> {
    // Before the lookup: the client must not learn whether a data set exists that its token does not grant.
    if (!scope || !scope->allows(name)) return tl::unexpected(Fault{CloseCode::forbidden, "the token does not grant this data set"});
    const auto current = catalogue.load();
    auto volume = current ? current->find(name) : nullptr;
    if (!volume) return tl::unexpected(Fault{CloseCode::no_such_dataset, "no such data set; see /api/datasets"});
    return volume;
  };
}

std::shared_ptr<const RangeAnswer> SessionThreads::ask(const RangeCache::Volume& volume, const ShownRanges& shown, Distances distances) {
  return ranges_.ask(volume, shown, distances, payer_, wake_);
}

void SessionThreads::search(const std::shared_ptr<BudgetSearch>& search) {
  const auto go_on = [weak = std::weak_ptr(search)](Memory::Share& held) {
    const auto one = weak.lock();
    if (!one) return false;
    const bool has_more = one->go_on();
    if (has_more) held.resize(one->memory_bytes());  // the session takes what is done
    return has_more;
  };
  background_.run(payer_, go_on, wake_);
}

}  // namespace intervale
