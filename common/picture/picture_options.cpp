#include "common/picture/picture_options.h"

#include <array>
#include <string>
#include <utility>

#include "common/view/palette.h"

namespace intervale {

namespace {

constexpr auto kGroup = "Picture";

PictureOptions& given(std::optional<PictureOptions>& picture) { return picture ? *picture : picture.emplace(); }

void add_colour_options(CLI::App& app, CLI::Option* image, std::optional<PictureOptions>& picture) {
  const auto set_colour_by = [&picture](const std::string& what) {
    given(picture).colour_by = what == "value" ? ColourBy::value : what == "surface" ? ColourBy::surface : ColourBy::channel;
    if (picture->colour_by == ColourBy::channel) picture->channel = what;
  };
  app.add_option_function<std::string>(
         "--color-by", set_colour_by,
         "Colours: of the surface (default); or of the field's value, or of a channel, which comes along, with a colour bar")
      ->type_name("surface|value|CHANNEL")
      ->group(kGroup)
      ->needs(image);
  app.add_option_function<std::string>(
         "--palette", [&picture](const std::string& name) { given(picture).palette = name; },
         "With --color-by value or a channel, or --render volume: " + palette_list() + " (default " + std::string(kPaletteNames[0]) + ")")
      ->type_name("NAME")
      ->group(kGroup)
      ->needs(image);
  app.add_option_function<std::array<double, 2>>(
         "--color-span",
         [&picture](const std::array<double, 2>& v) {
           given(picture).colour_span = ValueSpan{v[0], v[1]};
         },
         "Likewise: the values at the palette's ends (default: the part of the range that the data set has; all values of a channel)")
      ->type_name("LO HI")
      ->group(kGroup)
      ->needs(image);
}

void add_volume_options(CLI::App& app, CLI::Option* image, std::optional<PictureOptions>& picture) {
  const auto set_render = [&picture](const std::string& what) { given(picture).render = what == "volume" ? Render::volume : Render::surface; };
  app.add_option_function<std::string>("--render", set_render,
                                       "surface (default), or volume: a cloud of the field's values, and --refine uniform where there is a choice")
      ->check(CLI::IsMember({"surface", "volume"}))
      ->group(kGroup)
      ->needs(image);
  const auto set_opacity = [&picture](const std::string& text) {
    auto curve = parse_opacity(text);
    if (!curve) throw CLI::ValidationError("--opacity", curve.error().message);
    given(picture).opacity = std::move(*curve);
  };
  app.add_option_function<std::string>(
         "--opacity", set_opacity,
         "With --render volume: opacities 0 to 1 of ascending values, linear in between; of 1/100 of the box's diagonal "
         "(default: 0 to 0.3 over the range)")
      ->type_name("V:A,V:A,...")
      ->group(kGroup)
      ->needs(image);
}

}  // namespace

void add_picture_options(CLI::App& app, std::optional<PictureOptions>& picture) {
  CLI::Option* image = app.add_option_function<std::string>(
      "--image", [&picture](const std::string& path) { given(picture).file = path; },
      "Draw a picture, seen from --eye; without it, of the whole box");
  image->type_name("PNG")->group(kGroup);
  app.add_option_function<std::array<double, 6>>(
         "--clip",
         [&picture](const std::array<double, 6>& v) {
           given(picture).clip = Plane{{v[0], v[1], v[2]}, {v[3], v[4], v[5]}};
         },
         "Clip plane, by a world point and a normal: the side to which the normal points is removed")
      ->type_name("X Y Z NX NY NZ")
      ->group(kGroup)
      ->needs(image);
  app.add_flag_function(
         "--edges", [&picture](std::int64_t count) { given(picture).edges = count > 0; }, "Draw the edges of the mesh on its surfaces too")
      ->group(kGroup)
      ->needs(image);
  add_volume_options(app, image, picture);
  add_colour_options(app, image, picture);
}

std::vector<std::string> with_channel_of(const std::optional<PictureOptions>& picture, std::vector<std::string> channels) {
  if (picture && picture->colour_by == ColourBy::channel) channels.push_back(picture->channel);
  return channels;
}

}  // namespace intervale
