#include "common/picture/picture_options.h"

#include <array>
#include <string>

#include "common/view/palette.h"

namespace intervale {

void add_picture_options(CLI::App& app, std::optional<PictureOptions>& picture) {
  const auto given = [&picture]() -> PictureOptions& { return picture ? *picture : picture.emplace(); };
  const auto group = "Picture";
  CLI::Option* image = app.add_option_function<std::string>(
      "--image", [given](const std::string& path) { given().file = path; }, "Draw a picture, seen from --eye; without it, of the whole box");
  image->type_name("PNG")->group(group);
  app.add_option_function<std::array<double, 6>>(
         "--clip",
         [given](const std::array<double, 6>& v) {
           given().clip = Plane{{v[0], v[1], v[2]}, {v[3], v[4], v[5]}};
         },
         "Clip plane, by a world point and a normal: the side to which the normal points is removed")
      ->type_name("X Y Z NX NY NZ")
      ->group(group)
      ->needs(image);
  app.add_flag_function(
         "--edges", [given](std::int64_t count) { given().edges = count > 0; }, "Draw the edges of the mesh on its surfaces too")
      ->group(group)
      ->needs(image);
  const auto set_colour_by = [given](const std::string& what) { given().colour_by = what == "value" ? ColourBy::value : ColourBy::surface; };
  app.add_option_function<std::string>("--color-by", set_colour_by, "Colours: of the surface (default), or of the field's value, with a colour bar")
      ->check(CLI::IsMember({"surface", "value"}))
      ->group(group)
      ->needs(image);
  app.add_option_function<std::string>(
         "--palette", [given](const std::string& name) { given().palette = name; },
         "With --color-by value: " + palette_list() + " (default " + std::string(kPaletteNames[0]) + ")")
      ->type_name("NAME")
      ->group(group)
      ->needs(image);
  app.add_option_function<std::array<double, 2>>(
         "--color-span",
         [given](const std::array<double, 2>& v) {
           given().colour_span = ValueSpan{v[0], v[1]};
         },
         "With --color-by value: the values at the palette's ends (default: the part of the range that the data set has)")
      ->type_name("LO HI")
      ->group(group)
      ->needs(image);
}

}  // namespace intervale
