// SPDX-License-Identifier: Apache-2.0
#include <fmt/core.h>

#include <cmath>
#include <stdexcept>

#include "takt/calibration/estimate.h"
#include "takt/calibration/provenance_tree.h"
#include "takt/calibration/tree.h"

/// docs/formats/result.md, from Estimate to its document.
namespace takt {

namespace {

using tree::Node;

/// All nine decimals of the int64: "-0.003177000".
std::string exact_seconds(Duration d) {
  const auto ns = d.count();
  const auto size = ns < 0 ? 0 - static_cast<std::uint64_t>(ns) : static_cast<std::uint64_t>(ns);
  return fmt::format("{}{}.{:09}", ns < 0 ? "-" : "", size / 1'000'000'000, size % 1'000'000'000);
}

/// 15 digits, because the product with 1e6 has rounded away the sixteenth: 11, not 11.000000000000002.
Node in_ppm(std::optional<double> ratio) {
  return ratio && std::isfinite(*ratio) ? tree::digits(fmt::format("{:.15g}", 1e6 * *ratio)) : Node{};
}

Node optional_text(const std::optional<std::string>& s) {
  return s ? tree::text(*s) : Node{};
}

Node texts(const std::vector<std::string>& list) {
  Node out = tree::list();
  for (const std::string& s : list) out.add(tree::text(s));
  return out;
}

Node numbers(const std::vector<double>& values) {
  Node out = tree::list();
  for (const double v : values) out.add(tree::number(v));
  return out;
}

Node exposure_instant(const std::optional<std::string>& instant) {
  return instant ? tree::text(instant->starts_with("exposure_") ? *instant : "exposure_" + *instant) : Node{};
}

Node transform(const std::optional<Mat4>& T) {
  if (!T) return {};
  Node rows = tree::list();
  for (int r = 0; r < 4; ++r) {
    Node row = tree::list();
    for (int c = 0; c < 4; ++c) row.add(tree::number((*T)(r, c)));
    rows.add(std::move(row));
  }
  return rows;
}

Node pieces(const std::vector<OffsetPiece>& list) {
  Node out = tree::list();
  for (const OffsetPiece& p : list)
    out.add(tree::object()
                .add("start_ns", tree::integer(to_ns(p.start)))
                .add("epoch_ns", tree::integer(to_ns(p.epoch)))
                .add("offset_s", tree::digits(exact_seconds(p.offset)))
                .add("offset_ns", tree::integer(std::int64_t{p.offset.count()}))
                .add("sigma_s", tree::number(p.sigma_s))
                .add("drift_ppm", in_ppm(p.drift)));
  return out;
}

Node extras(const std::vector<Extra>& list) {
  Node out = tree::object();
  for (const Extra& x : list)
    out.add(x.name, tree::object().add("value", tree::number(x.value)).add("sigma", tree::number(x.sigma)));
  return out;
}

Node series(const Series& s) {
  Node out = tree::object();
  out.add("name", tree::text(s.name)).add("unit", tree::text(s.unit)).add("values", numbers(s.values));
  if (!s.sigma.empty()) out.add("sigma", numbers(s.sigma));
  if (!s.kind.empty()) out.add("kind", tree::text(s.kind));
  return out;
}

Node panel(const Panel& p) {
  Node out = tree::object();
  out.add("name", tree::text(p.name)).add("kind", tree::text(p.kind)).add("title", tree::text(p.title));
  out.add("caption", tree::text(p.caption)).add("x", series(p.x));
  Node y = tree::list();
  for (const Series& s : p.y) y.add(series(s));
  Node marks = tree::list();
  for (const Mark& m : p.marks) marks.add(tree::object().add("label", tree::text(m.label)).add("x", tree::number(m.x)));
  return std::move(out.add("y", std::move(y)).add("marks", std::move(marks)));
}

Node evidence(const Evidence& e) {
  Node panels = tree::list();
  for (const Panel& p : e.panels) panels.add(panel(p));
  return std::move(tree::object().add("panels", std::move(panels)));
}

/// What every method's answer has, the nested ones too.
void add_answer(const Estimate& e, Node& out) {
  const bool refused = e.verdict == Verdict::refused;
  if (!refused && !e.offset)
    throw std::logic_error("to_json: " + e.method + " is " + to_string(e.verdict) + " but has no offset");
  const auto unless_refused = [&](Node n) { return refused ? Node{} : std::move(n); };
  out.add("method", tree::text(e.method)).add("sensor", tree::text(e.sensor));
  out.add("reference", tree::text(e.reference));
  out.add("verdict", tree::text(to_string(e.verdict))).add("reasons", texts(e.reasons));
  out.add("offset_s", refused ? Node{} : tree::digits(exact_seconds(*e.offset)));
  out.add("offset_ns", refused ? Node{} : tree::integer(std::int64_t{e.offset->count()}));
  out.add("sigma_s", unless_refused(tree::number(e.sigma_s)));
  out.add("epoch_ns", tree::integer(to_ns(e.epoch)));
  out.add("drift_ppm", unless_refused(in_ppm(e.drift)));
  out.add("drift_sigma_ppm", unless_refused(in_ppm(e.drift_sigma)));
  if (!e.pieces.empty()) out.add("pieces", unless_refused(pieces(e.pieces)));
  out.add("frame_instant", exposure_instant(e.frame_instant)).add("frame_row", optional_text(e.frame_row));
  out.add("line_delay_s", unless_refused(tree::number(e.line_delay_s)));
  out.add("line_delay_sigma_s", unless_refused(tree::number(e.line_delay_sigma_s)));
  out.add("T_reference_sensor", transform(e.T_reference_sensor));
  out.add("extras", extras(e.extras)).add("notes", texts(e.notes));
}

Node document(const Estimate& e) {
  Node out = tree::object();
  out.add("schema", tree::text("takt/1"));
  add_answer(e, out);
  Node others = tree::list();
  for (const Estimate& other : e.estimates) {
    Node answer = tree::object();
    add_answer(other, answer);
    others.add(std::move(answer));
  }
  out.add("estimates", std::move(others)).add("evidence", evidence(e.evidence));
  return std::move(out.add("provenance", tree::provenance(e.provenance)));
}

}  // namespace

tree::Node tree::provenance(const Provenance& p) {
  Node inputs = tree::list(), libraries = tree::object();
  for (const auto& i : p.inputs)
    inputs.add(tree::object().add("path", tree::text(i.path)).add("sha256", tree::text(i.sha256)));
  for (const auto& l : p.libraries) libraries.add(l.name, tree::text(l.version));
  Node out = tree::object();
  out.add("version", tree::text(p.version)).add("command", tree::text(p.command)).add("inputs", std::move(inputs));
  out.add("seed", p.seed ? tree::integer(*p.seed) : Node{}).add("libraries", std::move(libraries));
  return out;
}

std::string to_json(const Estimate& e) {
  return tree::to_json(document(e));
}

std::string to_yaml(const Estimate& e) {
  return tree::to_yaml(document(e));
}

}  // namespace takt
