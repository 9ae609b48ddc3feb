#include "common/program/channel_option.h"

namespace intervale {

void add_channel_option(CLI::App& app, std::vector<std::string>& channels) {
  app.add_option("--channel", channels, "A channel of the data set to bring along, as a point array of .vtu and .vtp; may be repeated")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->type_name("NAME");
}

}  // namespace intervale
