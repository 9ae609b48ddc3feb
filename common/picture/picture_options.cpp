#include "common/picture/picture_options.h"

#include <array>
#include <string>

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
}

}  // namespace intervale
