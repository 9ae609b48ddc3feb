#include "client/view/viewing_session.h"

namespace intervale {

Result<void> ViewingSession::look(const WantedView& view, std::optional<DepthMap> depth, Clock::time_point now) {
  Lod lod;
  lod.roi = view.region;
  lod.camera = view.camera;
  if (auto ok = check_lod(lod); !ok) return ok;
  if (view.budget.max_updates < kMinRoom) return fail("there must be room for at least " + std::to_string(kMinRoom) + " updates");
  if (view_ == view) return session_.preview(view.shown);  // the end of a preview
  if (view.region) lod.camera.reset();
  const auto ahead = motion_.next(view.camera, now);
  const ViewRequest request{.lod = lod,
                            .camera = view.camera,
                            .within = view.region,
                            .budget = view.budget,
                            .shown = view.shown,
                            .early = true,
                            .coarse_error_percent = kCoarseErrorPercent,
                            .channels = view.channels,
                            .is_opaque = view.is_opaque,
                            .depth = view.region ? std::nullopt : std::move(depth),
                            .ahead = view.region ? std::nullopt : ahead};
  if (auto looked = session_.look(request); !looked) return looked;
  view_ = view;
  gave_up_more_ = false;
  return {};
}

Result<ClientSession::Event> ViewingSession::receive(std::span<const std::uint8_t> message, Clock::time_point now) {
  auto event = session_.receive(message, now);
  if (event && is_done() && event->is_full && !std::exchange(gave_up_more_, true)) session_.look_again();
  return event;
}

double ViewingSession::remaining_pixels() const {
  if (!is_done() || session_.stats().is_full) return session_.stats().remaining_pixels;
  const bool has_all = mesh()->updates() == mesh()->description().updates;
  return has_all || view_->region ? 0 : view_->camera.pixel_error;
}

}  // namespace intervale
