// SPDX-License-Identifier: Apache-2.0
#include "cli/open_options.h"

#include <map>
#include <string>

#include "cli/options.h"

namespace takt::cli {

namespace {

/// An option whose values have names. CLI11's own way of that tells numbers where a name is misspelt.
template <class Value>
void add_named(CLI::App& verb, const std::string& flag, Value& to, const std::map<std::string, Value>& values,
               const std::string& help) {
  verb.add_option_function<std::string>(
          flag, [&to, values](const std::string& name) { to = values.at(name); }, help)
      ->check(CLI::IsMember(values).description(""))
      ->type_name("UNIT");
}

}  // namespace

void add_time_unit(CLI::App& verb, OpenOptions& options) {
  add_named<TimeUnit>(verb, "--time-unit", options.time_unit,
                      {{"auto", TimeUnit::automatic},
                       {"s", TimeUnit::s},
                       {"ms", TimeUnit::ms},
                       {"us", TimeUnit::us},
                       {"ns", TimeUnit::ns}},
                      "unit of a log's time column: auto, s, ms, us, ns");
}

void add_open_options(CLI::App& verb, OpenOptions& options) {
  add_time_unit(verb, options);
  add_named<RateUnit>(verb, "--rate-unit", options.rate_unit,
                      {{"auto", RateUnit::automatic}, {"rad_s", RateUnit::rad_s}, {"deg_s", RateUnit::deg_s}},
                      "unit of a log's rates: auto, rad_s, deg_s");
  verb.add_option("--from", options.from_s, "leave out what is earlier than this, in s after the first stamp")
      ->check(a_number())
      ->type_name("S");
  verb.add_option("--to", options.to_s, "leave out what is later than this, in s after the first stamp")
      ->check(a_number())
      ->type_name("S");
  verb.add_option("--frame-shift", options.frame_shift,
                  "numbered pictures beside a stamp list: picture N has stamp N + this, counted from 1")
      ->type_name("N");
}

}  // namespace takt::cli
