// SPDX-License-Identifier: Apache-2.0
#include "takt/workflows/report.h"

#include <algorithm>

#include "takt/calibration/tree.h"
#include "takt/report/html_report.h"
#include "takt/report/repeatability.h"

namespace takt {

namespace {

tree::Node row_of(const Estimate& e, std::size_t i, const std::vector<std::string>& names,
                  const std::vector<Repeatability>& pairs) {
  using namespace tree;
  const bool outlier = std::any_of(pairs.begin(), pairs.end(), [&](const Repeatability& r) {
    return std::find(r.outliers.begin(), r.outliers.end(), i) != r.outliers.end();
  });
  std::optional<double> temperature;
  for (const Extra& x : e.extras)
    if (x.name == "temperature_c") temperature = x.value;
  Node row = object();
  row.add("path", i < names.size() ? text(names[i]) : Node{});
  row.add("sensor", text(e.sensor)).add("reference", text(e.reference)).add("method", text(e.method));
  row.add("verdict", text(to_string(e.verdict)));
  row.add("offset_s", e.offset ? number(static_cast<double>(e.offset->count()) / 1e9) : Node{});
  row.add("sigma_s", number(e.sigma_s)).add("epoch_ns", integer(to_ns(e.epoch)));
  row.add("temperature_c", number(temperature));
  row.add("outlier", Node{Node::Kind::boolean, outlier ? "true" : "false", {}});
  return row;
}

}  // namespace

std::string report_page(const std::vector<Estimate>& results, const std::vector<std::string>& names) {
  return html_report(results, {.names = names});
}

std::string repeatability_words(const std::vector<Estimate>& results, const std::vector<std::string>& names) {
  std::string out;
  for (const Repeatability& r : repeatability(results))
    out += r.sensor + " against " + r.reference + ": " + in_words(r, names) + "\n";
  return out;
}

std::string repeatability_json(const std::vector<Estimate>& results, const std::vector<std::string>& names) {
  using namespace tree;
  const auto pairs = repeatability(results);
  Node rows = list();
  for (std::size_t i = 0; i < results.size(); ++i) rows.add(row_of(results[i], i, names, pairs));
  Node root = object();
  root.add("schema", text("takt/1")).add("results", std::move(rows));
  root.add("repeatability", *from_json(to_json(pairs), "").find("repeatability"));
  return tree::to_json(root);
}

}  // namespace takt
