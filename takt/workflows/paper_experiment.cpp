// SPDX-License-Identifier: Apache-2.0
#include "takt/workflows/paper_experiment.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "takt/report/html_report.h"

namespace takt {
namespace {

using namespace paper;

// The paper's own figures, ms: filter, rate, amplitude; rate, filter; exposure, stamp; IMU, temperature.
constexpr double tables_1_to_3[3][4][3]{
    {{3.186, 3.078, 2.822}, {4.570, 4.490, 4.255}, {7.411, 7.324, 7.001}, {8.901, 8.754, 8.416}},
    {{4.153, 4.064, 3.788}, {5.580, 5.481, 5.225}, {8.427, 8.303, 7.960}, {9.852, 9.765, 9.441}},
    {{6.135, 6.034, 5.765}, {7.554, 7.449, 7.171}, {10.437, 10.339, 10.007}, {11.841, 11.744, 11.453}}};
constexpr double table_4[4][3]{
    {3.177, 4.145, 6.128}, {4.567, 5.548, 7.546}, {7.409, 8.417, 10.431}, {8.829, 9.842, 11.830}};
constexpr double table_4_kalibr[4][3]{
    {4.960, 4.967, 5.970}, {5.996, 5.972, 5.968}, {7.959, 8.909, 9.907}, {9.942, 9.960, 10.867}};
constexpr double table_5[3][3]{{3.687, 3.177, 2.692}, {3.926, 3.167, 2.433}, {4.161, 3.155, 2.165}};
constexpr double table_5_kalibr[3]{4.960, 4.963, 1.688};
constexpr double repeat_mean[2][5]{{3.033, 3.116, 3.157, 3.153, 3.134}, {3.058, 3.128, 3.159, 3.170, 3.136}};
constexpr double repeat_std[2][5]{{0.0128, 0.0103, 0.0164, 0.0174, 0.0138}, {0.00756, 0.0103, 0.0167, 0.0171, 0.00015}};
constexpr int steps[3][2]{{1, 0}, {2, 1}, {2, 0}};
constexpr const char* batch_column = "batch (takt calibrate)";

std::string ms(double v) {
  return fmt::format("{:.3f}", v);
}
std::string ms(double v, double sigma) {
  return fmt::format("{:.3f} ± {:.3f}", v, sigma);
}

std::string batch_words(const BatchDelay& d) {
  if (d.verdict == Verdict::refused) return "refused";
  return ms(d.delay, d.sigma) + (d.verdict == Verdict::weak ? " (weak)" : "");
}

std::vector<ReportTable> filter_tables(const Runs& runs) {
  std::vector<ReportTable> out;
  for (std::size_t f = 0; f < 3; ++f) {
    ReportTable t{fmt::format("Table {}: filter delay {} ms", f + 1, filters_ms[f]),
                  "Delays in ms; in brackets the variance from swing to swing, ms².",
                  {"rate Hz", "amplitude", "paper", "extrema", "damped", "spline", "truth"},
                  {}};
    for (std::size_t r = 0; r < 4; ++r)
      for (std::size_t w = 0; w < 3; ++w) {
        const Delays& d = runs.windows[f][r][w];
        t.rows.push_back({fmt::format("{}", rates_hz[r]), fmt::format("{}°–{}°", windows_deg[w][0], windows_deg[w][1]),
                          ms(tables_1_to_3[f][r][w]), fmt::format("{:.3f} ({:.1e})", d.extrema, d.swing_variance),
                          ms(d.damped), ms(d.spline, d.sigma), ms(d.truth)});
      }
    out.push_back(std::move(t));
  }
  return out;
}

ReportTable rate_table(const Runs& runs) {
  ReportTable t{
      "Table 4: 15° to 9°",
      fmt::format("Means of {} recordings in ms; extrema and damped on 15° to 9°, spline on every swing. The "
                  "last column is the IMU off the pendulum, 8 s of free motion before a board.",
                  runs.rates[0][0].size()),
      {"rate Hz", "filter ms", "paper", "paper's Kalibr", "extrema", "damped", "spline", "truth", batch_column},
      {}};
  for (std::size_t r = 0; r < 4; ++r)
    for (std::size_t f = 0; f < 3; ++f) {
      const Delays d = mean_of(runs.rates[f][r]);
      t.rows.push_back({fmt::format("{}", rates_hz[r]), fmt::format("{}", filters_ms[f]), ms(table_4[r][f]),
                        ms(table_4_kalibr[r][f]), ms(d.extrema), ms(d.damped), ms(d.spline, d.sigma), ms(d.truth),
                        batch_words(runs.batch_rates[f][r])});
    }
  return t;
}

ReportTable step_table(const Runs& runs) {
  ReportTable t{"Table 4: steps of the filter",
                "Differences in ms.",
                {"rate Hz", "step", "paper", "paper's Kalibr", "extrema", "spline", "truth", batch_column},
                {}};
  for (std::size_t r = 0; r < 4; ++r)
    for (const auto& s : steps) {
      const Delays a = mean_of(runs.rates[s[0]][r]), b = mean_of(runs.rates[s[1]][r]);
      const BatchDelay &p = runs.batch_rates[s[0]][r], &q = runs.batch_rates[s[1]][r];
      t.rows.push_back({fmt::format("{}", rates_hz[r]), fmt::format("D{}−D{}", s[0] + 1, s[1] + 1),
                        ms(table_4[r][s[0]] - table_4[r][s[1]]), ms(table_4_kalibr[r][s[0]] - table_4_kalibr[r][s[1]]),
                        ms(a.extrema - b.extrema), ms(a.spline - b.spline, std::hypot(a.sigma, b.sigma)),
                        ms(a.truth - b.truth), ms(p.delay - q.delay, std::hypot(p.sigma, q.sigma))});
    }
  return t;
}

/// Straight line through delay against output interval (ms): slope and rms residual.
struct Line {
  double slope, residual;
};
Line line_of(const std::array<double, 4>& delay) {
  double x = 0, y = 0, xx = 0, xy = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const double t = 1e3 / rates_hz[i];
    x += t / 4, y += delay[i] / 4, xx += t * t / 4, xy += t * delay[i] / 4;
  }
  const double slope = (xy - x * y) / (xx - x * x);
  double squares = 0;
  for (std::size_t i = 0; i < 4; ++i) squares += std::pow(delay[i] - y - slope * (1e3 / rates_hz[i] - x), 2) / 4;
  return {slope, std::sqrt(squares)};
}

/// Delays of one filter at the four rates.
struct OverRates {
  std::array<double, 4> paper, spline, sigma, truth;
};
OverRates over_rates(const Runs& runs, std::size_t f) {
  OverRates o{};
  for (std::size_t r = 0; r < 4; ++r) {
    const Delays d = mean_of(runs.rates[f][r]);
    o.paper[r] = table_4[r][f], o.spline[r] = d.spline, o.sigma[r] = d.sigma, o.truth[r] = d.truth;
  }
  return o;
}

ReportTable line_table(const Runs& runs) {
  ReportTable t{"Figure 10: lines through delay against output interval",
                "Slope in ms a ms, rms residual in ms.",
                {"filter ms", "slope, paper's table 4", "residual", "slope, spline", "residual", "slope, truth"},
                {}};
  for (std::size_t f = 0; f < 3; ++f) {
    const OverRates o = over_rates(runs, f);
    const Line p = line_of(o.paper), s = line_of(o.spline);
    t.rows.push_back({fmt::format("{}", filters_ms[f]), ms(p.slope), fmt::format("{:.4f}", p.residual), ms(s.slope),
                      fmt::format("{:.4f}", s.residual), ms(line_of(o.truth).slope)});
  }
  return t;
}

ReportTable exposure_table(const Runs& runs) {
  ReportTable t{"Table 5: exposure and stamp",
                "Every stamp is taken for the middle of the exposure, so that start and end should differ from it by "
                "half an exposure; means in ms.",
                {"exposure ms", "stamp", "half exposure", "paper", "paper's difference", "paper's Kalibr", "extrema",
                 "spline", "spline's difference", batch_column},
                {}};
  constexpr const char* modes[3]{"start", "middle", "end"};
  constexpr double side[3]{0.5, 0, -0.5};
  for (std::size_t x = 0; x < 3; ++x)
    for (std::size_t m = 0; m < 3; ++m) {
      const Delays d = mean_of(runs.exposures[x][m]), middle = mean_of(runs.exposures[x][1]);
      t.rows.push_back({fmt::format("{}", exposures_ms[x]), modes[m], fmt::format("{:.2f}", side[m] * exposures_ms[x]),
                        ms(table_5[x][m]), ms(table_5[x][m] - table_5[x][1]), m == 1 ? ms(table_5_kalibr[x]) : "",
                        ms(d.extrema), ms(d.spline, d.sigma),
                        m == 1 ? "" : ms(d.spline - middle.spline, std::hypot(d.sigma, middle.sigma)),
                        batch_words(runs.batch_exposures[x][m])});
    }
  return t;
}

struct Repeat {
  double mean = 0, deviation = 0;
};
Repeat repeat_of(const std::vector<Delays>& runs, double Delays::*which) {
  Repeat r;
  for (const Delays& d : runs) r.mean += d.*which / static_cast<double>(runs.size());
  for (const Delays& d : runs) r.deviation += std::pow(d.*which - r.mean, 2);
  r.deviation = std::sqrt(r.deviation / static_cast<double>(runs.size() - 1));
  return r;
}

ReportTable repeat_table(const Runs& runs, std::size_t imu, int repeats) {
  ReportTable t{fmt::format("Table {}: repeats, IMU{}", 6 + imu, imu),
                fmt::format("{} runs a temperature; mean ± standard deviation, ms.", repeats),
                {"°C", "paper", "extrema", "spline", "truth", batch_column},
                {}};
  for (std::size_t c = 0; c < 5; ++c) {
    const Repeat e = repeat_of(runs.repeats[imu][c], &Delays::extrema),
                 s = repeat_of(runs.repeats[imu][c], &Delays::spline);
    const auto words = [](double mean, double deviation) { return fmt::format("{:.3f} ± {:.4f}", mean, deviation); };
    t.rows.push_back({fmt::format("{}", temperatures_c[imu][c]), words(repeat_mean[imu][c], repeat_std[imu][c]),
                      words(e.mean, e.deviation), words(s.mean, s.deviation), ms(runs.repeats[imu][c].front().truth),
                      batch_words(runs.batch_repeats[imu][c])});
  }
  return t;
}

/// Figures 7 to 9: the delay of each swing as the amplitude dies, at 1000 Hz.
Panel swing_figure(const Runs& runs, std::size_t f) {
  Panel p = runs.swings[f];
  p.name = fmt::format("figure_{}", 7 + f);
  p.title = fmt::format("Figure {}: delay of each swing, filter {} ms, 1000 Hz", 7 + f, filters_ms[f]);
  p.caption =
      "The published estimator falls as the swing dies, as in the paper; with the phase that friction adds the delay "
      "is the same for all swings.";
  return p;
}

/// What explains tables 1 to 3: the fall of the published estimator from window to window.
Panel damping_figure(const Runs& runs) {
  Panel p{
      "damping",
      "points",
      "Tables 1 to 3: why the published delay falls with the amplitude",
      "Filter 2.9 ms at 1000 Hz. Dry friction's phase grows as the amplitude dies; eq. 9 leaves it out, and extrema "
      "falls with the paper's figures. The truth is one delay for all.",
      {"amplitude, middle of the window", "deg", {}, {}},
      {{"paper", "ms", {}, {}},
       {"extrema", "ms", {}, {}},
       {"damped", "ms", {}, {}},
       {"spline", "ms", {}, {}},
       {"truth", "ms", {}, {}, "lines"}},
      {}};
  for (std::size_t w = 0; w < 3; ++w) {
    const Delays& d = runs.windows[0][0][w];
    p.x.values.push_back(0.5 * (windows_deg[w][0] + windows_deg[w][1]));
    const double values[5]{tables_1_to_3[0][0][w], d.extrema, d.damped, d.spline, d.truth};
    for (std::size_t k = 0; k < 5; ++k) p.y[k].values.push_back(values[k]);
    p.y[3].sigma.push_back(d.sigma);
  }
  return p;
}

Panel rate_figure(const Runs& runs) {
  Panel p{
      "figure_10",
      "points",
      "Figure 10: delay against output interval",
      "The delay grows in proportion to the interval between two outputs; the paper's points lie below by the phase "
      "that its estimator leaves out.",
      {"output interval", "ms", {}, {}},
      {},
      {}};
  for (const double rate : rates_hz) p.x.values.push_back(1e3 / rate);
  for (std::size_t f = 0; f < 3; ++f) {
    const OverRates o = over_rates(runs, f);
    const auto values = [](const std::array<double, 4>& a) { return std::vector<double>(a.begin(), a.end()); };
    p.y.push_back({fmt::format("spline, {} ms", filters_ms[f]), "ms", values(o.spline), values(o.sigma)});
    p.y.push_back({fmt::format("paper, {} ms", filters_ms[f]), "ms", values(o.paper), {}});
    p.y.push_back({fmt::format("truth, {} ms", filters_ms[f]), "ms", values(o.truth), {}, "lines"});
  }
  return p;
}

Panel exposure_figure(const Runs& runs) {
  Panel p{"table_5",
          "points",
          "Table 5: what another stamp than the middle's does",
          "Against half an exposure (start positive, end negative): on the diagonal the middle is the right instant.",
          {"half exposure", "ms", {}, {}},
          {{"spline", "ms", {}, {}}, {"paper", "ms", {}, {}}, {"expected", "ms", {}, {}, "lines"}},
          {}};
  struct Point {
    double x, spline, sigma, paper;
  };
  std::vector<Point> points;
  constexpr double side[3]{0.5, 0, -0.5};
  for (std::size_t x = 0; x < 3; ++x)
    for (const std::size_t m : {std::size_t{0}, std::size_t{2}}) {
      const Delays d = mean_of(runs.exposures[x][m]), middle = mean_of(runs.exposures[x][1]);
      points.push_back({side[m] * exposures_ms[x], d.spline - middle.spline, std::hypot(d.sigma, middle.sigma),
                        table_5[x][m] - table_5[x][1]});
    }
  std::sort(points.begin(), points.end(), [](const Point& a, const Point& b) { return a.x < b.x; });
  for (const Point& q : points) {
    p.x.values.push_back(q.x);
    p.y[0].values.push_back(q.spline);
    p.y[0].sigma.push_back(q.sigma);
    p.y[1].values.push_back(q.paper);
    p.y[2].values.push_back(q.x);
  }
  return p;
}

Panel temperature_figure(const Runs& runs, std::size_t imu) {
  Panel p{
      fmt::format("figure_11_imu{}", imu),
      "points",
      fmt::format("Figure 11: delay against temperature, IMU{}", imu),
      "Means of the repeats with their standard deviation.",
      {"temperature", "°C", {}, {}},
      {{"paper", "ms", {}, {}}, {"extrema", "ms", {}, {}}, {"spline", "ms", {}, {}}, {"truth", "ms", {}, {}, "lines"}},
      {}};
  for (std::size_t c = 0; c < 5; ++c) {
    const auto& repeats = runs.repeats[imu][c];
    const Repeat e = repeat_of(repeats, &Delays::extrema), s = repeat_of(repeats, &Delays::spline);
    p.x.values.push_back(temperatures_c[imu][c]);
    const double values[4]{repeat_mean[imu][c], e.mean, s.mean, repeats.front().truth};
    for (std::size_t k = 0; k < 4; ++k) p.y[k].values.push_back(values[k]);
    p.y[0].sigma.push_back(repeat_std[imu][c]);
    p.y[1].sigma.push_back(e.deviation);
    p.y[2].sigma.push_back(s.deviation);
  }
  return p;
}

/// How far the batch column is from the truth at worst, ms; nothing where a setting has no answer.
std::optional<double> largest_batch_error(const Runs& runs) {
  double worst = 0;
  const auto look = [&worst](const BatchDelay& d) {
    if (const double error = std::abs(d.delay - d.truth); !(error <= worst)) worst = error;  // NaN stays
  };
  for (const auto& filter : runs.batch_rates) std::for_each(std::begin(filter), std::end(filter), look);
  for (const auto& exposure : runs.batch_exposures) std::for_each(std::begin(exposure), std::end(exposure), look);
  for (const auto& imu : runs.batch_repeats) std::for_each(std::begin(imu), std::end(imu), look);
  return std::isfinite(worst) ? std::optional(worst) : std::nullopt;
}

/// What the tables come to, in s: how far the steps are from the truth, how far repeats scatter.
void add_sums(Estimate& e, const Runs& runs) {
  double step = 0, exposure = 0, scatter = 0, slope = 0;
  for (std::size_t r = 0; r < 4; ++r)
    for (const auto& s : steps) {
      const Delays a = mean_of(runs.rates[s[0]][r]), b = mean_of(runs.rates[s[1]][r]);
      step = std::max(step, std::abs(a.spline - b.spline - (a.truth - b.truth)));
    }
  constexpr double side[3]{0.5, 0, -0.5};
  for (std::size_t x = 0; x < 3; ++x)
    for (std::size_t m = 0; m < 3; ++m)
      exposure = std::max(exposure, std::abs(mean_of(runs.exposures[x][m]).spline -
                                             mean_of(runs.exposures[x][1]).spline - side[m] * exposures_ms[x]));
  for (const auto& imu : runs.repeats)
    for (const auto& repeats : imu) scatter = std::max(scatter, repeat_of(repeats, &Delays::spline).deviation);
  for (std::size_t f = 0; f < 3; ++f) {
    const OverRates o = over_rates(runs, f);
    slope = std::max(slope, std::abs(line_of(o.spline).slope - line_of(o.truth).slope));
  }
  e.extras = {{"table_4_largest_step_error_s", step * 1e-3, std::nullopt},
              {"figure_10_largest_slope_error", slope, std::nullopt},
              {"table_5_largest_difference_error_s", exposure * 1e-3, std::nullopt},
              {"tables_6_7_largest_repeat_std_s", scatter * 1e-3, std::nullopt}};
  if (const auto worst = largest_batch_error(runs))
    e.extras.push_back({"tables_4_7_largest_batch_error_s", *worst * 1e-3, std::nullopt});
}

Estimate summary(const Runs& runs) {
  const Delays first = mean_of(runs.rates[0][0]);
  Estimate e;
  e.method = "spline";
  e.sensor = "cam0";
  e.reference = "imu0";
  e.verdict = Verdict::trusted;
  if (!std::isfinite(first.spline)) return Estimate::refusal("spline", "the first setting has no answer");
  e.offset = from_seconds(first.spline * 1e-3);
  e.sigma_s = first.sigma * 1e-3;
  e.epoch = from_ns(1'700'000'000'000'000'000);
  e.frame_instant = "middle";
  e.frame_row = "first";
  e.notes = {"simulated rig; the offset is that of table 4's first row, a mean of repeats: filter 2.9 ms, 1000 Hz"};
  add_sums(e, runs);
  for (std::size_t f = 0; f < 3; ++f) e.evidence.panels.push_back(swing_figure(runs, f));
  for (Panel& p : e.evidence.panels) std::erase_if(p.y, [](const Series& s) { return s.values.empty(); });
  e.evidence.panels.push_back(damping_figure(runs));
  e.evidence.panels.push_back(rate_figure(runs));
  e.evidence.panels.push_back(exposure_figure(runs));
  for (std::size_t i = 0; i < 2; ++i) e.evidence.panels.push_back(temperature_figure(runs, i));
  return e;
}

}  // namespace

PaperExperiment paper_experiment(const PaperExperimentOptions& options) {
  const Runs runs = run_experiments(options);
  std::vector<ReportTable> tables = filter_tables(runs);
  for (ReportTable t : {rate_table(runs), step_table(runs), line_table(runs), exposure_table(runs),
                        repeat_table(runs, 0, options.repeats), repeat_table(runs, 1, options.repeats)})
    tables.push_back(std::move(t));
  PaperExperiment out;
  out.estimate = summary(runs);
  out.html = html_report(out.estimate, {.names = {}, .tables = tables});
  out.markdown = fmt::format(
      "# The experiments of [Fu2021] on the simulated rig\n\nSeed {}, {}. The friction and the transport delay of the "
      "simulated rig were chosen so that `extrema` at 1000 Hz falls with the amplitude as the paper's does; everything "
      "else follows. `extrema` is the paper's estimator: that it lies below the truth, and the lower the smaller the "
      "swing, is the phase it leaves out (docs/methods/pendulum.md).\n\n",
      options.seed, options.images ? "angles read from rendered pictures of the coded dial" : "at the level of angles");
  for (const ReportTable& t : tables) out.markdown += to_markdown(t);
  return out;
}

}  // namespace takt
