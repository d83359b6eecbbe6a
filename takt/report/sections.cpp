// SPDX-License-Identifier: Apache-2.0
#include "takt/report/sections.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "takt/calibration/words.h"
#include "takt/report/figures/figures.h"
#include "takt/report/html.h"
#include "takt/report/intervals.h"
#include "takt/report/svg.h"

namespace takt::report {

namespace {

std::string badge(Verdict v) {
  const char* sign = v == Verdict::trusted ? "✓" : v == Verdict::weak ? "!" : "✕";
  return fmt::format(R"(<span class="badge {0}">{1} {0}</span>)", to_string(v), sign);
}

const char* meaning(Verdict v) {
  switch (v) {
    case Verdict::trusted:
      return "The data support this answer.";
    case Verdict::weak:
      return "An answer, but read the reasons first.";
    case Verdict::refused:
      break;
  }
  return "The data cannot tell. There is no answer.";
}

std::string with_minus(std::string s) {
  for (std::size_t at = 0; (at = s.find('-', at)) != s.npos; at += 3) s.replace(at, 1, "−");
  return s;
}

std::string fact(const std::string& name, const std::string& value_html, bool wide = false) {
  return fmt::format("<div{}><dt>{}</dt><dd>{}</dd></div>\n", wide ? " class=\"wide\"" : "", escape(name), value_html);
}

std::optional<double> times(std::optional<double> v, double factor) {
  return v ? std::optional(*v * factor) : std::nullopt;
}

std::string drift_words(const Estimate& e) {
  return e.drift ? with_minus(value_words(1e6 * *e.drift, times(e.drift_sigma, 1e6))) + " ppm" : "not estimated";
}

/// How a stamp is corrected, ready to be copied.
std::string equation(const Estimate& e) {
  const bool late = e.offset->count() < 0;
  const Duration size = late && *e.offset != Duration::min() ? -*e.offset : *e.offset;
  std::string out = fmt::format("<i>t</i><sub>{}</sub> = <i>t</i><sub>{}</sub> {} {}", escape(e.reference),
                                escape(e.sensor), late ? "−" : "+", time_words(size, std::nullopt));
  if (e.drift && *e.drift != 0)
    out += fmt::format(" {} {:.6g}·10⁻⁶ · (<i>t</i><sub>{}</sub> − epoch)", *e.drift < 0 ? "−" : "+",
                       std::abs(1e6 * *e.drift), escape(e.sensor));
  return out;
}

std::string holds_for(const Estimate& e) {
  const std::string row = e.frame_row ? "the " + *e.frame_row + " row" : "";
  if (!e.frame_instant) return row;
  return "exposure " + *e.frame_instant + (row.empty() ? "" : " of " + row);
}

std::string matrix(const Mat4& T) {
  std::string out = "<table class=\"matrix\">";
  for (int r = 0; r < 4; ++r) {
    out += "<tr>";
    for (int c = 0; c < 4; ++c) out += "<td>" + with_minus(fmt::format("{:.6g}", T(r, c))) + "</td>";
    out += "</tr>";
  }
  return "<div class=\"scroll\">" + out + "</table></div>";
}

std::string list_items(const std::vector<std::string>& texts) {
  std::string out;
  for (const std::string& t : texts) out += "<li>" + escape(t) + "</li>\n";
  return out;
}

std::string method_row(const Estimate& e, const Estimate& result, const Intervals& intervals) {
  const bool same_pair = e.reference == result.reference, chosen = same_pair && e.method == result.method;
  const std::string offset = e.answered() ? with_minus(time_words(*e.offset, e.sigma_s)) : "no answer";
  const std::string why = e.reasons.empty() ? "" : escape(e.reasons.front());
  return fmt::format(
      "<tr{}><td>{}</td><td class=\"n\">{}</td><td class=\"span\">{}</td><td>{} <span "
      "class=\"why\">{}</span></td></tr>\n",
      chosen ? " class=\"chosen\"" : "", escape(same_pair ? e.method : e.method + ", " + e.reference), offset,
      same_pair ? intervals.svg(e) : "", badge(e.verdict), why);
}

std::string legend(const Figure& f) {
  std::string out = "<div class=\"legend\">", seen = "\n";
  std::vector<Layer> in_order = f.layers;
  std::stable_sort(in_order.begin(), in_order.end(),
                   [](const Layer& a, const Layer& b) { return a.colour < b.colour; });
  for (const Layer& l : in_order) {
    if (seen.find("\n" + l.series + "\n") != seen.npos) continue;
    seen += l.series + "\n";
    out += fmt::format(
        R"(<button type="button" class="key c{}" data-series="{}" disabled><i></i><span>{}</span> <span class="value"></span></button>)",
        l.colour % 6, escape(l.series), escape(l.series));
  }
  return out + "<span class=\"value where\" aria-live=\"off\"></span></div>\n";
}

std::string canvas(const Figure& f, const Panel& p, const std::string& id) {
  std::size_t points = 0;
  for (const Layer& l : f.layers) points = std::max(points, l.x.size());
  const std::string description =
      p.caption + fmt::format(" {} against {}, up to {} values a series.", f.y.label(), f.x.label(), points);
  return "<div class=\"canvas\">\n" + legend(f) + to_svg(f, {id, p.title, description}) +
         "\n<button type=\"button\" class=\"back\" hidden>whole range</button>\n<script type=\"application/json\">" +
         to_script_data(f) + "</script>\n</div>\n";
}

}  // namespace

std::string headline(const Estimate& e) {
  std::string said = escape(sentence(e));
  if (e.answered()) {
    // The badge says the verdict, so the heading ends before its bracket; the number stands out.
    said = said.substr(0, said.rfind(e.verdict == Verdict::weak ? " (weak: " : " ("));
    const Duration size = e.offset->count() < 0 && *e.offset != Duration::min() ? -*e.offset : *e.offset;
    const std::string number = time_words(size, e.sigma_s);
    if (const auto at = said.find(" is " + number + " "); at != said.npos)
      said = said.substr(0, at + 4) + "<b>" + number + "</b>" + said.substr(at + 4 + number.size());
  }
  return headline("time offset", said, e.verdict, e.reasons);
}

std::string headline(const std::string& kind, const std::string& heading, Verdict verdict,
                     const std::vector<std::string>& reasons) {
  std::string out = "<header>\n<p class=\"kicker\">takt · " + escape(kind) + "</p>\n<h1>" + heading +
                    "</h1>\n<p class=\"verdict\">" + badge(verdict) + " " + meaning(verdict) + "</p>\n";
  if (!reasons.empty()) out += "<ul class=\"reasons\">\n" + list_items(reasons) + "</ul>\n";
  return out + "</header>\n";
}

std::string facts(const Estimate& e) {
  std::string out = "<dl class=\"facts\">\n";
  if (e.answered()) {
    out += fact("To correct a stamp", "<span class=\"equation\">" + equation(e) + "</span>", true);
    out += fact("Offset", with_minus(time_words(*e.offset, e.sigma_s)));
    out += fact("Drift", drift_words(e));
    if (e.line_delay_s)
      out += fact("Line delay", with_minus(time_words(*e.line_delay_s, e.line_delay_sigma_s)) + " a row");
  }
  if (const std::string instant = holds_for(e); !instant.empty()) out += fact("A frame's stamp means", escape(instant));
  if (!e.method.empty()) out += fact("Method", escape(e.method));
  if (e.answered())
    out += fact("Epoch", time_words(e.epoch.time_since_epoch(), std::nullopt) + " on " + escape(e.sensor) + "’s clock",
                true);
  return out + "</dl>\n";
}

std::string methods(const Estimate& e) {
  if (e.estimates.empty()) return "";
  const std::vector<Estimate> answers = answers_at_one_epoch(e);
  std::vector<Estimate> comparable;  // a clock against host and GNSS has an offset to each
  std::copy_if(answers.begin(), answers.end(), std::back_inserter(comparable),
               [&](const Estimate& other) { return other.reference == e.reference; });
  const Intervals intervals(comparable);
  std::string out =
      "<section>\n<h2>Every method's answer</h2>\n<div class=\"scroll\"><table>\n<tr><th>method</th><th>offset ± σ</th>"
      "<th class=\"span\"></th><th>verdict</th></tr>\n";
  for (const Estimate& other : answers) out += method_row(other, e, intervals);
  return out + "</table></div>\n</section>\n";
}

std::string evidence(const Evidence& e, const std::string& prefix) {
  if (e.panels.empty()) return "";
  std::string out =
      "<section>\n<h2>Evidence</h2>\n<p class=\"hint\">Drag across a plot to look closer, double-click to go back, "
      "click a name to hide it.</p>\n";
  for (std::size_t i = 0; i < e.panels.size(); ++i) {
    const Panel& p = e.panels[i];
    out += fmt::format("<figure data-panel=\"{}\">\n<figcaption><h3><span class=\"number\">{}</span>{}</h3>",
                       escape(p.name), i + 1, escape(p.title));
    out += (p.caption.empty() ? "" : "<p>" + escape(p.caption) + "</p>") + "</figcaption>\n";
    int part = 0;
    for (const Figure& f : figures_of(p)) out += canvas(f, p, fmt::format("{}fig{}-{}", prefix, i + 1, ++part));
    out += "</figure>\n";
  }
  return out + "</section>\n";
}

std::string assumptions(const Estimate& e) {
  if (e.notes.empty() && e.extras.empty() && !e.T_reference_sensor) return "";
  std::string out = "<section>\n<h2>What was assumed and what else was found</h2>\n";
  if (!e.notes.empty()) out += "<ul>\n" + list_items(e.notes) + "</ul>\n";
  if (!e.extras.empty()) {
    out += "<div class=\"scroll\"><table>\n<tr><th>quantity</th><th>value</th></tr>\n";
    for (const Extra& x : e.extras)
      out += "<tr><td>" + escape(x.name) + "</td><td class=\"n\">" + with_minus(value_words(x.value, x.sigma)) +
             "</td></tr>\n";
    out += "</table></div>\n";
  }
  if (e.T_reference_sensor)
    out += fmt::format("<p>Takes points from {} to {} (metres):</p>\n", escape(e.sensor), escape(e.reference)) +
           matrix(*e.T_reference_sensor);
  return out + "</section>\n";
}

std::string remarks(const std::vector<std::string>& notes) {
  return notes.empty() ? ""
                       : "<section>\n<h2>What was assumed</h2>\n<ul>\n" + list_items(notes) + "</ul>\n</section>\n";
}

std::string provenance(const Provenance& p) {
  if (p.version.empty() && p.command.empty() && p.inputs.empty()) return "";
  std::string out = "<section>\n<h2>Provenance</h2>\n";
  if (!p.command.empty()) out += "<pre>" + escape(p.command) + "</pre>\n";
  if (!p.inputs.empty()) {
    out += "<table>\n<tr><th>input</th><th>SHA-256</th></tr>\n";
    for (const auto& i : p.inputs)
      out +=
          "<tr><td class=\"hash\">" + escape(i.path) + "</td><td class=\"hash\">" + escape(i.sha256) + "</td></tr>\n";
    out += "</table>\n";
  }
  out += "<p>takt " + escape(p.version);
  if (p.seed) out += fmt::format(", seed {}", *p.seed);
  for (const auto& l : p.libraries) out += ", " + escape(l.name) + " " + escape(l.version);
  return out + ".</p>\n</section>\n";
}

}  // namespace takt::report
