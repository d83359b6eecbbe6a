// SPDX-License-Identifier: Apache-2.0
// takt listen SOURCE: events of a live device on UTC, one JSON line each, until the source ends or Ctrl-C.
#include "takt/workflows/listen.h"

#include <fmt/core.h>

#include <cstdio>
#include <memory>

#include "cli/interrupt.h"
#include "cli/options.h"
#include "cli/output.h"
#include "cli/progress.h"
#include "takt/calibration/words.h"

namespace takt::cli {

namespace {

std::string status_line(const ListenStatus& s) {
  std::string line = s.plugged ? to_string(s.state) : "unplugged";
  line += fmt::format(" · {} pulses, {} rejected · {} labels · {} events, {} lost", s.pulses, s.rejected, s.labels,
                      s.events, s.lost);
  if (s.sigma_s > 0) line += fmt::format(" · {:+.4f} ppm ± {}", s.rate_ppm, rounded_time_words(s.sigma_s));
  if (!s.why.empty()) line += " · " + s.why.substr(0, 60);
  return line;
}

int run_listen(ListenJob job, const Common& common) {
  stop_on_interrupt();
  const bool shown = stderr_is_terminal() && !common.quiet;
  job.stop = interrupted;
  job.on_line = [](const std::string& json) {
    std::fputs(json.c_str(), stdout);
    std::fputc('\n', stdout);
    std::fflush(stdout);
  };
  if (shown) job.on_status = [](const ListenStatus& s) { fmt::print(stderr, "\r\x1b[K{}", status_line(s)); };
  const ListenStatus last = listen(job);
  if (shown) fmt::print(stderr, "\r\x1b[K");
  if (!common.quiet) fmt::print(stderr, "takt: {}\n", status_line(last));
  fmt::print(
      R"({{"event":"end","state":"{}","pulses":{},"rejected":{},"labels":{},"events":{},"lost":{},"unplugged":{},"rate_ppm":{:.6f},"sigma_s":{:.4g}}})"
      "\n",
      to_string(last.state), last.pulses, last.rejected, last.labels, last.events, last.lost, last.unplugged,
      last.rate_ppm, last.sigma_s);
  return last.state == ClockState::ambiguous ? 3 : 0;
}

}  // namespace

void add_listen(CLI::App& app, Common& common, Action& action) {
  CLI::App& verb = *app.add_subcommand("listen", "a live device's events on UTC, one JSON line each");
  const auto job = std::make_shared<ListenJob>();
  verb.add_option("SOURCE", job->source, "serial device, pipe, file, or - for standard input")->required();
  verb.add_option("--baud", job->baud, "of a serial device")->check(above_zero())->capture_default_str();
  verb.add_option("--format", job->format, "gateware, text, or auto")
      ->check(CLI::IsMember({"auto", "gateware", "text"}))
      ->default_str("auto");
  verb.add_option("--tick-hz", job->tick_hz, "rate of the counter, where the device does not say it")
      ->check(above_zero());
  verb.add_option("--counter-bits", job->counter_bits, "width of a text device's counter")
      ->check(CLI::Range(8, 64))
      ->capture_default_str();
  verb.add_option("--pulse-error", job->pulse_error_s,
                  "no pulse is further off than so many seconds: makes hard bounds")
      ->check(CLI::PositiveNumber);
  verb.add_option("-o,--mcap", job->mcap, "all events into an MCAP file too: a topic each, JSON, times on UTC")
      ->type_name("FILE");
  add_common(verb, common);
  verb.callback([job, &common, &action] { action = [job, &common] { return run_listen(*job, common); }; });
}

}  // namespace takt::cli
