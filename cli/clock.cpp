// SPDX-License-Identifier: Apache-2.0
// takt clock IN | --pps FILE [--nmea FILE] [--ubx FILE] | --pairs FILE: a device's clock against UTC or a host;
// --frames FILE: a camera's frames against their strobes; --shared-trigger A B: two sensors that share a trigger.
#include "takt/workflows/clock.h"

#include <fmt/core.h>

#include <map>
#include <memory>

#include "cli/options.h"
#include "cli/output.h"
#include "takt/workflows/provenance.h"

namespace takt::cli {

namespace {

struct Line {
  ClockJob job;
  std::string method = "auto", nmea, ubx, stream;
  bool streamed = false;
};

int run_clock(const Line& line, const Common& common) {
  ClockJob job = line.job;
  for (const std::string& file : {line.nmea, line.ubx})
    if (!file.empty()) job.labels.push_back(file);
  if (job.input.empty() && job.pps.empty() && job.pairs.empty() && job.labels.empty() && job.frames.empty() &&
      job.shared_trigger.empty()) {
    fmt::print(
        stderr,
        "takt clock: give a folder or file, or --pps FILE with --nmea or --ubx FILE, or --pairs FILE, or --frames "
        "FILE with a capture, --strobes FILE or a receiver's log, or --shared-trigger A B\n");
    return 2;
  }
  job.pulses.method = job.exchanges.method = line.method;
  ClockOutcome outcome = relate_clocks(job);
  Estimate& e = outcome.estimate;
  e.provenance = make_provenance(common.command, outcome.files, common.seed);
  if (!common.quiet)
    for (const std::string& note : e.notes) fmt::print(stderr, "takt: {}\n", note);
  if (line.streamed) {
    for (const PulseStamp& s : outcome.stamps) fmt::print("{}\n", stamp_json(s.device_ns, s.stamp));
    return exit_status(e);
  }
  return hand_over(e, common);
}

}  // namespace

void add_clock(CLI::App& app, Common& common, Action& action) {
  static const std::map<std::string, TimeUnit> time_units{{"auto", TimeUnit::automatic},
                                                          {"s", TimeUnit::s},
                                                          {"ms", TimeUnit::ms},
                                                          {"us", TimeUnit::us},
                                                          {"ns", TimeUnit::ns}};
  CLI::App& verb =
      *app.add_subcommand("clock", "relate a counter to GNSS pulses and labels, or a device's clock to a host's");
  const auto line = std::make_shared<Line>();
  verb.add_option("IN", line->job.input,
                  "a folder of takt simulate clock, a capture of the gateware, a table of pulses or exchanges, or a "
                  "receiver's log");
  verb.add_option("--pps", line->job.pps, "captured pulses: ticks or t_ns [,edge] [,sequence] [,utc_s]")
      ->type_name("FILE");
  verb.add_option("--nmea", line->nmea, "receiver's sentences; arrivals before each line or by --arrivals")
      ->type_name("FILE");
  verb.add_option("--ubx", line->ubx, "receiver's binary messages; NMEA may be mixed in")->type_name("FILE");
  verb.add_option("--arrivals", line->job.arrivals, "byte,arrival of the receiver's log (default: FILE.arrivals.csv)")
      ->type_name("FILE");
  verb.add_option("--pairs", line->job.pairs, "exchanges: device,arrival or request,device,response")
      ->type_name("FILE");
  verb.add_option("--frames", line->job.frames,
                  "a camera's frames, t_ns[,exposure_s]: against the middles of their strobes")
      ->type_name("FILE");
  verb.add_option("--strobes", line->job.strobes, "start,end of each strobe (default: those of the capture IN)")
      ->type_name("FILE");
  verb.add_option("--camera", line->job.camera, "whose strobes of the capture: cam0, cam1, ...");
  verb.add_option("--event-channel", line->job.event_channel,
                  "input of the receiver whose stamped events (TIM-TM2) are the frames' strobes")
      ->check(CLI::Range(0, 255))
      ->capture_default_str();
  verb.add_option("--shared-trigger", line->job.shared_trigger, "device,arrival of two sensors that share a trigger")
      ->type_name("FILE FILE")
      ->expected(2);
  verb.add_option("--method", line->method, "kalman, hull, or auto")
      ->check(CLI::IsMember({"auto", "kalman", "hull"}))
      ->default_str("auto");
  verb.add_option("--tick-hz", line->job.csv.tick_hz, "nominal rate of the counter (default: found)")
      ->check(above_zero());
  verb.add_option("--counter-bits", line->job.csv.counter_bits, "width of the counter (default: found where it wraps)")
      ->check(CLI::Range(8, 64));
  verb.add_option("--time-unit", line->job.csv.time_unit, "unit of stamps: auto, s, ms, us, ns")
      ->transform(CLI::CheckedTransformer(time_units).description(""))
      ->type_name("UNIT");
  add_options(verb, line->job.pulses);
  verb.get_option("--reference")->check(CLI::IsMember({"utc", "gps"}));
  verb.get_option("--qerr")->check(CLI::IsMember({"auto", "on", "off"}));
  add_options(verb, line->job.exchanges);
  verb.add_flag("--stream", line->streamed, "print one JSON line a pulse or frame instead of the result");
  add_common(verb, common);
  add_result_output(verb, common);
  verb.callback([line, &common, &action] { action = [line, &common] { return run_clock(*line, common); }; });
}

}  // namespace takt::cli
