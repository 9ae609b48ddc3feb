#include "protocol/codec.h"

#include <algorithm>
#include <cstring>
#include <memory>
#include <string>
#include <utility>

#include "common/codec/split_names.h"
#include "common/codec/value_table.h"
#include "common/diamond/domain.h"
#include "protocol/stream_generated.h"

namespace intervale::protocol {
namespace {

using flatbuffers::FlatBufferBuilder, flatbuffers::Offset, flatbuffers::VectorLength;
using Bytes = std::span<const std::uint8_t>;

fbs::Vector to_vector(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }
std::array<double, 3> to_array(const fbs::Vector& v) { return {v.x(), v.y(), v.z()}; }

// How many weights the description of a data set with this grid has; 0 for a grid that cannot be.
std::size_t weight_count(const Grid& grid) { return check_grid(grid) ? std::size_t(Domain(grid.dims).levels()) * 3 * kPredictors : 0; }

// The i-th of them: scale by scale from the finest, class by class.
template <class Weights>
auto& weight_at(Weights& weights, std::size_t i) {
  return weights.of[i / (3 * kPredictors)][i / kPredictors % 3][i % kPredictors];
}

// Encoding: each message to its table.

Offset<fbs::Open> encode_body(FlatBufferBuilder& out, const Open& message) {
  const auto dataset = out.CreateString(message.dataset);
  const auto client = out.CreateString(message.client);
  return fbs::CreateOpen(out, dataset, client, message.credit, message.resume, message.payload);
}

fbs::Camera to_camera(const Camera& c) {
  return {to_vector(c.eye), to_vector(c.look_at), to_vector(c.up), c.fov, c.viewport[0], c.viewport[1], c.pixel_error};
}

Offset<fbs::View> encode_body(FlatBufferBuilder& out, const View& message) {
  const Lod& lod = message.lod;
  fbs::Box box;
  if (lod.roi) box = fbs::Box(to_vector(lod.roi->min), to_vector(lod.roi->max));
  fbs::Camera camera, ahead;
  if (lod.camera) camera = to_camera(*lod.camera);
  if (message.ahead) ahead = to_camera(*message.ahead);
  const auto table = fbs::CreateLod(out, lod.error, lod.error_percent, lod.roi ? &box : nullptr, lod.max_updates, lod.camera ? &camera : nullptr);
  const auto forget = message.forget.empty() ? 0 : out.CreateVector(encode_splits(message.forget));
  const RangeRequest& shown = message.shown;
  std::vector<fbs::Range> ranges;
  ranges.reserve(shown.ranges.size());
  for (const Range& range : shown.ranges) ranges.emplace_back(range.alpha, range.beta);
  const auto in_order = ranges.empty() ? 0 : out.CreateVectorOfStructs(ranges);
  const auto refine = std::uint8_t(shown.refine ? 1 + int(*shown.refine) : 0);
  const auto channels = message.channels.empty() ? 0 : out.CreateVectorOfStrings(message.channels);
  const auto& map = message.depth;
  const auto depth =
      map ? fbs::CreateDepthMap(out, std::uint8_t(map->width), std::uint8_t(map->height), map->nearest, map->farthest, out.CreateVector(map->codes))
          : 0;
  return fbs::CreateView(out, message.epoch, table, message.room, forget, in_order, refine, message.early, message.coarse_error_percent, channels,
                         depth, message.ahead ? &ahead : nullptr);
}

Offset<fbs::Credit> encode_body(FlatBufferBuilder& out, const Credit& message) { return fbs::CreateCredit(out, message.bytes); }

Offset<fbs::Have> encode_body(FlatBufferBuilder& out, const Have& message) {
  return fbs::CreateHave(out, out.CreateVector(encode_splits(message.splits)), std::uint8_t(message.channel ? 1 + *message.channel : 0));
}

std::vector<std::int16_t> flat_weights(const Grid& grid, const ValueWeights& weights) {
  std::vector<std::int16_t> flat(weight_count(grid));
  for (std::size_t i = 0; i < flat.size(); ++i) flat[i] = weight_at(weights, i);
  return flat;
}

Offset<fbs::Channel> encode_channel(FlatBufferBuilder& out, const Grid& grid, const Channel& channel) {
  std::vector<Offset<fbs::Component>> components;
  components.reserve(channel.components.size());
  for (const ChannelComponent& c : channel.components) {
    const auto corners = out.CreateVector(c.corners.data(), c.corners.size());
    const auto weights = out.CreateVector(flat_weights(grid, c.weights));
    components.push_back(
        fbs::CreateComponent(out, std::uint8_t(c.format.type), c.format.step, c.format.first, c.format.last, c.is_exact, corners, weights));
  }
  const auto name = out.CreateString(channel.name), unit = out.CreateString(channel.unit);
  return fbs::CreateChannel(out, name, unit, out.CreateVector(components));
}

Offset<fbs::Description> encode_description(FlatBufferBuilder& out, const Description& d) {
  const auto name = out.CreateString(d.name);
  const auto corners = out.CreateVector(d.corners.data(), d.corners.size());
  const auto weights = out.CreateVector(flat_weights(d.grid, d.weights));
  const fbs::Dims dims(d.grid.dims[0], d.grid.dims[1], d.grid.dims[2]);
  const auto affine = out.CreateVector(d.grid.affine.rows.data(), d.grid.affine.rows.size());
  const auto label = [&out](const std::string& text) { return text.empty() ? Offset<flatbuffers::String>() : out.CreateString(text); };
  const auto unit = label(d.labels.unit), field = label(d.labels.field), field_unit = label(d.labels.field_unit), space = label(d.labels.space);
  const ValueFormat& format = d.format;
  const auto table = format.table ? out.CreateVector(encode_value_table(*format.table)) : 0;
  std::vector<Offset<fbs::Channel>> each;
  each.reserve(d.channels.size());
  for (const Channel& channel : d.channels) each.push_back(encode_channel(out, d.grid, channel));
  const auto channels = each.empty() ? 0 : out.CreateVector(each);
  return fbs::CreateDescription(out, name, &dims, d.range.alpha, d.range.beta, std::uint8_t(d.refine), d.max_error, d.updates, d.coefficients,
                                d.full.vertices, d.full.tets, d.content_hash, std::uint8_t(format.type), format.step, format.first, format.last,
                                d.is_exact, corners, weights, d.has_every_range, affine, unit, field, field_unit, table, channels, space);
}

Offset<fbs::Opened> encode_body(FlatBufferBuilder& out, const Opened& message) {
  const auto description = encode_description(out, message.description);
  const SessionLimits& limits = message.limits;
  return fbs::CreateOpened(out, description, limits.max_window, limits.min_credit, limits.max_message, message.resumed, message.payload);
}

Offset<fbs::Batch> encode_body(FlatBufferBuilder& out, const Batch& message) {
  const auto payload = out.CreateVector(message.payload);
  const auto channels = message.channels.empty() ? 0 : out.CreateVector(message.channels);
  return fbs::CreateBatch(out, message.epoch, message.sequence, message.updates, message.remaining_error, payload, message.remaining_pixels,
                          message.updates_to_go, channels);
}

Offset<fbs::Done> encode_body(FlatBufferBuilder& out, const Done& message) {
  return fbs::CreateDone(out, message.epoch, message.updates_sent, message.full);
}

Offset<fbs::Fault> encode_body(FlatBufferBuilder& out, const Fault& message) {
  return fbs::CreateFault(out, static_cast<std::uint16_t>(message.code), out.CreateString(message.text));
}

std::vector<std::uint8_t> finished(FlatBufferBuilder& out) { return {out.GetBufferPointer(), out.GetBufferPointer() + out.GetSize()}; }

// Decoding: each verified table to its message. The verifier has checked that a string or array lies within the
// message; its own limit is checked here.

tl::unexpected<Error> malformed(const std::string& what) { return fail("malformed message: " + what); }

Result<ClientMessage> decode_body(const fbs::Open& table) {
  if (VectorLength(table.dataset()) > kMaxName) return malformed("the data set's name is too long");
  if (VectorLength(table.client()) > kMaxText) return malformed("the client's name is too long");
  return Open{table.dataset()->str(), flatbuffers::GetString(table.client()), table.credit(), table.resume(), table.payload()};
}

Camera to_camera(const fbs::Camera& c) {
  return {.eye = to_array(c.eye()),
          .look_at = to_array(c.look_at()),
          .up = to_array(c.up()),
          .fov = c.fov(),
          .viewport = {c.width(), c.height()},
          .pixel_error = c.pixel_error()};
}

Result<ClientMessage> decode_body(const fbs::View& table) {
  const fbs::Lod& wire = *table.lod();
  Lod lod{.error = wire.error(), .error_percent = wire.error_percent(), .roi = {}, .camera = {}, .max_tets = {}, .max_updates = wire.max_updates()};
  if (const auto* roi = wire.roi()) lod.roi = Box{to_array(roi->min()), to_array(roi->max())};
  if (const auto* camera = wire.camera()) lod.camera = to_camera(*camera);
  if (auto ok = check_lod(lod); !ok) return malformed(ok.error().message);
  const auto coarse = table.coarse_error_percent();
  if (coarse && !(*coarse >= 0 && *coarse <= 100)) return malformed("the coarse error percent must be a number from 0 to 100");
  View view{table.epoch(), lod, table.room(), {}, {}, table.early(), coarse};
  if (const auto* ranges = table.ranges(); VectorLength(ranges) > 0) {
    if (ranges->size() > kMaxRanges)
      return malformed("a view of " + std::to_string(ranges->size()) + " ranges, of which at most " + std::to_string(kMaxRanges) + " can be shown");
    view.shown.ranges.reserve(ranges->size());
    for (const fbs::Range* const range : *ranges) {
      if (!(range->alpha() <= range->beta())) return malformed("a range's alpha is greater than its beta, or is no number");
      view.shown.ranges.push_back({range->alpha(), range->beta()});
    }
  }
  if (table.refine() > 1 + std::uint8_t(Refine::uniform)) return malformed("an unknown way to refine");
  if (table.refine() > 0) view.shown.refine = Refine(table.refine() - 1);
  if (const auto* forget = table.forget()) {
    auto splits = decode_splits({forget->data(), forget->size()}, kMaxHave);
    if (!splits) return malformed(splits.error().message);
    view.forget = std::move(*splits);
  }
  if (const auto* depth = table.depth()) {
    if (!lod.camera) return malformed("a depth map without a camera");
    const DepthMap map{depth->width(), depth->height(), depth->nearest(), depth->farthest(), {depth->codes()->begin(), depth->codes()->end()}};
    if (auto ok = check_depth_map(map); !ok) return malformed(ok.error().message);
    view.depth = map;
  }
  if (const auto* ahead = table.ahead()) {
    if (!lod.camera) return malformed("a camera ahead of none");
    view.ahead = to_camera(*ahead);
    Lod there;
    there.camera = view.ahead;
    if (auto ok = check_lod(there); !ok) return malformed(ok.error().message);
  }
  if (const auto* channels = table.channels()) {
    if (channels->size() > kMaxChannels) return malformed("a view of more than " + std::to_string(kMaxChannels) + " channels");
    for (const flatbuffers::String* const name : *channels) {
      if (VectorLength(name) > kMaxLabel) return malformed("a channel's name is too long");
      view.channels.push_back(name->str());
    }
  }
  return view;
}

Result<ClientMessage> decode_body(const fbs::Credit& table) { return Credit{table.bytes()}; }

Result<ClientMessage> decode_body(const fbs::Have& table) {
  auto splits = decode_splits({table.splits()->data(), table.splits()->size()}, kMaxHave);
  if (!splits) return malformed(splits.error().message);
  Have have{std::move(*splits)};
  if (table.channel() > kMaxChannels) return malformed("a channel that no data set has");
  if (table.channel() > 0) have.channel = table.channel() - 1u;
  return have;
}

// The channels of a description. d: has its dims.
Result<void> decode_channels(const fbs::Description& wire, Description& d) {
  if (VectorLength(wire.channels()) > kMaxChannels) return malformed("a description has too many channels");
  const std::size_t weights = weight_count(d.grid);
  for (flatbuffers::uoffset_t i = 0; i < VectorLength(wire.channels()); ++i) {
    const fbs::Channel& from = *wire.channels()->Get(i);
    if (VectorLength(from.name()) > kMaxLabel || VectorLength(from.unit()) > kMaxLabel) return malformed("a channel's name or unit is too long");
    if (from.components()->size() > kMaxComponents) return malformed("a channel has too many components");
    Channel& channel = d.channels.emplace_back(Channel{from.name()->str(), flatbuffers::GetString(from.unit()), {}});
    for (const fbs::Component* const c : *from.components()) {
      if (c->type() >= kSampleTypes) return malformed("an unknown type of samples");
      if (c->corners()->size() != kRootVertices || c->weights()->size() != weights)
        return malformed("a channel does not have 8 corners, and the weights of its levels");
      ChannelComponent& component = channel.components.emplace_back();
      component.format = {SampleType(c->type()), c->step(), c->first(), c->last()};
      component.is_exact = c->is_exact();
      std::copy(c->corners()->begin(), c->corners()->end(), component.corners.begin());
      for (std::size_t w = 0; w < weights; ++w) weight_at(component.weights, w) = c->weights()->Get(flatbuffers::uoffset_t(w));
    }
  }
  return {};
}

// The part of a description that depends on the version of payloads. d: has its dims.
Result<void> decode_values(const fbs::Description& wire, Description& d) {
  if (VectorLength(wire.affine()) != d.grid.affine.rows.size()) return malformed("a description's affine does not have 12 numbers");
  std::copy(wire.affine()->begin(), wire.affine()->end(), d.grid.affine.rows.begin());
  for (const auto* label : {wire.unit(), wire.field(), wire.field_unit(), wire.space()}) {
    if (VectorLength(label) > kMaxLabel) return malformed("a description's label is too long");
  }
  d.labels = {flatbuffers::GetString(wire.unit()), flatbuffers::GetString(wire.field()), flatbuffers::GetString(wire.field_unit()),
              flatbuffers::GetString(wire.space())};
  if (wire.type() >= kSampleTypes) return malformed("an unknown type of samples");
  if (VectorLength(wire.corners()) != d.corners.size()) return malformed("a description does not have 8 corners");
  const std::size_t weights = weight_count(d.grid);
  if (VectorLength(wire.weights()) != weights) return malformed("a description does not have the weights of its levels");
  d.format = {SampleType(wire.type()), wire.step(), wire.first(), wire.last()};
  if (has_table(d.format.step, d.format.type)) {
    if (VectorLength(wire.value_table()) > kMaxTableBytes || wire.last() >= kMaxTableValues) return malformed("the table of values is too large");
    if (wire.value_table() == nullptr) return malformed("a description has no table of values");
    auto table = decode_value_table({wire.value_table()->data(), wire.value_table()->size()}, std::size_t(wire.last()) + 1);
    if (!table) return malformed(table.error().message);
    d.format.table = std::make_shared<const std::vector<double>>(std::move(*table));
  }
  d.is_exact = wire.is_exact();
  std::copy(wire.corners()->begin(), wire.corners()->end(), d.corners.begin());
  for (std::size_t i = 0; i < weights; ++i) weight_at(d.weights, i) = wire.weights()->Get(flatbuffers::uoffset_t(i));
  return {};
}

Result<ServerMessage> decode_body(const fbs::Opened& table) {
  const fbs::Description& wire = *table.description();
  if (VectorLength(wire.name()) > kMaxName) return malformed("the data set's name is too long");
  if (wire.refine() > std::uint8_t(Refine::uniform)) return malformed("an unknown refinement (neither boundary nor uniform)");
  Description d;
  d.name = wire.name()->str();
  d.grid.dims = {wire.dims()->x(), wire.dims()->y(), wire.dims()->z()};
  d.range = {wire.alpha(), wire.beta()};
  d.refine = Refine(wire.refine());
  d.has_every_range = wire.has_every_range();
  d.max_error = wire.max_error();
  d.updates = wire.updates();
  d.coefficients = wire.coefficients();
  d.full = {wire.full_vertices(), wire.full_tets()};
  d.content_hash = wire.content_hash();
  if (table.payload() == kPayloadVersion) {
    if (auto values = decode_values(wire, d); !values) return tl::unexpected(values.error());
    if (auto channels = decode_channels(wire, d); !channels) return tl::unexpected(channels.error());
  }
  return Opened{std::move(d), {table.max_window(), table.min_credit(), table.max_message()}, table.resumed(), table.payload()};
}

Result<ServerMessage> decode_body(const fbs::Batch& table) {
  if (VectorLength(table.payload()) + VectorLength(table.channels()) > kMaxBatchPayload) return malformed("the batch is too large");
  if (!(table.remaining_error() >= 0)) return malformed("the remaining error is not a number of at least 0");
  if (!(table.remaining_pixels() >= 0)) return malformed("the remaining pixels are not a number of at least 0");
  Batch batch{.epoch = table.epoch(),
              .sequence = table.sequence(),
              .updates = table.updates(),
              .remaining_error = table.remaining_error(),
              .remaining_pixels = table.remaining_pixels(),
              .updates_to_go = table.updates_to_go(),
              .payload = {}};
  batch.payload.assign(table.payload()->begin(), table.payload()->end());
  if (table.channels() != nullptr) batch.channels.assign(table.channels()->begin(), table.channels()->end());
  return batch;
}

Result<ServerMessage> decode_body(const fbs::Done& table) { return Done{table.epoch(), table.updates_sent(), table.full()}; }

Result<ServerMessage> decode_body(const fbs::Fault& table) {
  if (VectorLength(table.text()) > kMaxText) return malformed("the fault's text is too long");
  return Fault{CloseCode(table.code()), table.text()->str()};
}

// The bytes at an address that is a multiple of 8, as FlatBuffers requires: the original, or a copy.
class Aligned {
 public:
  explicit Aligned(Bytes bytes) : bytes_(bytes) {
    if (bytes.empty() || reinterpret_cast<std::uintptr_t>(bytes.data()) % alignof(std::uint64_t) == 0) return;
    copy_.resize(bytes.size() / sizeof(std::uint64_t) + 1);
    std::memcpy(copy_.data(), bytes.data(), bytes.size());
    bytes_ = {reinterpret_cast<const std::uint8_t*>(copy_.data()), bytes.size()};
  }
  [[nodiscard]] Bytes bytes() const { return bytes_; }

 private:
  Bytes bytes_;
  std::vector<std::uint64_t> copy_;
};

// Verifies the bytes, and decodes the one of these tables that their root holds. what: the root, for the error.
template <class Message, class Root, class... Tables>
Result<Message> decode(Bytes bytes, const char* what) {
  const Aligned aligned(bytes);
  flatbuffers::Verifier verifier(aligned.bytes().data(), bytes.size(), kMaxDepth, kMaxTables);
  if (!verifier.VerifyBuffer<Root>(nullptr)) return malformed(std::string("not a ") + what);
  const auto& root = *flatbuffers::GetRoot<Root>(aligned.bytes().data());
  std::optional<Result<Message>> message;
  const auto take = [&message](const auto* table) {
    if (table != nullptr) message = decode_body(*table);
  };
  (take(root.template body_as<Tables>()), ...);
  if (!message) return malformed("unknown message type");  // the verifier accepts unknown union types
  return *std::move(message);
}

}  // namespace

std::vector<std::uint8_t> encode(const ClientMessage& message) {
  FlatBufferBuilder out(256);
  const auto body = [&out]<class Table>(Offset<Table> table) {
    return fbs::CreateClientMessage(out, fbs::ClientBodyTraits<Table>::enum_value, table.Union());
  };
  out.Finish(std::visit([&](const auto& m) { return body(encode_body(out, m)); }, message));
  return finished(out);
}

std::vector<std::uint8_t> encode(const ServerMessage& message) {
  const auto* batch = std::get_if<Batch>(&message);
  FlatBufferBuilder out((batch == nullptr ? 0 : batch->payload.size() + batch->channels.size()) + 512);
  const auto body = [&out]<class Table>(Offset<Table> table) {
    return fbs::CreateServerMessage(out, fbs::ServerBodyTraits<Table>::enum_value, table.Union());
  };
  out.Finish(std::visit([&](const auto& m) { return body(encode_body(out, m)); }, message));
  return finished(out);
}

Result<void> check_sendable(const Description& description) {
  const auto& table = description.format.table;
  if (!table || (table->size() <= kMaxTableValues && encode_value_table(*table).size() <= kMaxTableBytes)) return {};
  return fail("the table of its " + std::to_string(table->size()) + " exact values is too large for a message: build it with --step S to serve it");
}

Result<ClientMessage> decode_client_message(Bytes bytes) {
  return decode<ClientMessage, fbs::ClientMessage, fbs::Open, fbs::View, fbs::Credit, fbs::Have>(bytes, "client message");
}

Result<ServerMessage> decode_server_message(Bytes bytes) {
  return decode<ServerMessage, fbs::ServerMessage, fbs::Opened, fbs::Batch, fbs::Done, fbs::Fault>(bytes, "server message");
}

}  // namespace intervale::protocol
