#include "client/api/session.h"

#include <string_view>
#include <utility>

#include "client/core/client_session.h"
#include "common/api/describe_data_set.h"
#include "protocol/messages.h"

namespace intervale {
namespace {

static_assert(kStreamProtocol == std::string_view(protocol::kSubprotocol) && kStreamPath == std::string_view(protocol::kPath));

ViewRequest to_view(const MeshRequest& request) {
  return {.lod = request.lod,
          .camera = request.lod.camera,
          .budget = {.max_tets = request.lod.max_tets.value_or(UINT64_MAX)},
          .shown = request.shown,
          .channels = request.channels};
}

}  // namespace

struct Session::State {
  ClientSession session;
};

Session::Session(std::unique_ptr<State> state) : state_(std::move(state)) {}
Session::Session(Session&&) noexcept = default;
Session& Session::operator=(Session&&) noexcept = default;
Session::~Session() = default;

Result<Session> Session::start(std::string data_set, const MeshRequest& request, std::string client) {
  if (client.empty()) client = "libintervale " INTERVALE_VERSION;
  Session session(std::make_unique<State>(State{ClientSession({.dataset = std::move(data_set), .client = std::move(client)})}));
  if (auto looked = session.look(request); !looked) return tl::unexpected(looked.error());
  return session;
}

Result<void> Session::look(const MeshRequest& request) {
  if (auto valid = check_request(request); !valid) return valid;
  return state_->session.look(to_view(request));
}

void Session::connected() { state_->session.connected(ClientSession::Clock::now()); }
void Session::disconnected() { state_->session.disconnected(); }

Result<void> Session::receive(std::span<const std::uint8_t> message) {
  const auto event = state_->session.receive(message, ClientSession::Clock::now());
  if (!event) return tl::unexpected(event.error());
  return {};
}

std::vector<Session::Message> Session::take_messages() { return state_->session.take_messages(); }
bool Session::may_reconnect() const { return state_->session.state() != ClientSession::State::closed; }
bool Session::is_done() const { return state_->session.state() == ClientSession::State::idle; }

std::optional<DataSetInfo> Session::info() const {
  const Description* description = state_->session.description();
  return description ? std::optional(info_of(*description)) : std::nullopt;
}

std::uint64_t Session::updates() const {
  const StreamClient* mesh = state_->session.mesh();
  return mesh ? mesh->updates() : 0;
}

Mesh Session::mesh() const {
  const StreamClient* mesh = state_->session.mesh();
  return mesh ? mesh->mesh() : Mesh{};
}

}  // namespace intervale
