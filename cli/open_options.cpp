// SPDX-License-Identifier: Apache-2.0
#include "cli/open_options.h"

#include <map>
#include <string>

namespace takt::cli {

void add_time_unit(CLI::App& verb, OpenOptions& options) {
  static const std::map<std::string, TimeUnit> time_units{{"auto", TimeUnit::automatic},
                                                          {"s", TimeUnit::s},
                                                          {"ms", TimeUnit::ms},
                                                          {"us", TimeUnit::us},
                                                          {"ns", TimeUnit::ns}};
  verb.add_option("--time-unit", options.time_unit, "unit of a log's time column: auto, s, ms, us, ns")
      ->transform(CLI::CheckedTransformer(time_units).description(""))
      ->type_name("UNIT");
}

void add_open_options(CLI::App& verb, OpenOptions& options) {
  static const std::map<std::string, RateUnit> rate_units{
      {"auto", RateUnit::automatic}, {"rad_s", RateUnit::rad_s}, {"deg_s", RateUnit::deg_s}};
  add_time_unit(verb, options);
  verb.add_option("--rate-unit", options.rate_unit, "unit of a log's rates: auto, rad_s, deg_s")
      ->transform(CLI::CheckedTransformer(rate_units).description(""))
      ->type_name("UNIT");
  verb.add_option("--from", options.from_s, "leave out what is earlier than this, in s after the first stamp")
      ->type_name("S");
  verb.add_option("--to", options.to_s, "leave out what is later than this, in s after the first stamp")
      ->type_name("S");
  verb.add_option("--frame-shift", options.frame_shift,
                  "numbered pictures beside a stamp list: picture N has stamp N + this, counted from 1")
      ->type_name("N");
}

}  // namespace takt::cli
