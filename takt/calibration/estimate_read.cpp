// SPDX-License-Identifier: Apache-2.0
#include <fmt/core.h>

#include <charconv>
#include <cmath>
#include <functional>
#include <limits>

#include "takt/calibration/estimate.h"
#include "takt/calibration/tree.h"
#include "takt/error.h"

/// docs/formats/result.md, from a document back to Estimate. Fields that are not there are unknown, as null is.
namespace takt {

namespace {

using tree::Node;
using Kind = Node::Kind;

const char* in_words(Kind kind) {
  switch (kind) {
    case Kind::boolean:
      return "a boolean";
    case Kind::number:
      return "a number";
    case Kind::text:
      return "a text";
    case Kind::list:
      return "a list";
    case Kind::object:
      return "an object";
    case Kind::null:
      break;
  }
  return "null";
}

/// A place in the document that knows its name: "estimates[2].offset_s".
class Field {
 public:
  Field(const Node* node, std::string path, const std::string& where) : node_(node), path_(path), where_(where) {}

  [[nodiscard]] bool known() const { return node_ && node_->kind != Kind::null; }
  [[nodiscard]] Field operator[](const std::string& key) const {
    return {node_ ? node_->find(key) : nullptr, path_.empty() ? key : path_ + "." + key, where_};
  }

  [[noreturn]] void fail(const std::string& what) const {
    throw Error(path_.empty() ? what : path_ + " " + what, where_, "docs/formats/result.md describes each field");
  }
  void require(Kind kind) const {
    if (!node_) fail("is missing");
    if (node_->kind != kind) fail(fmt::format("is {}, {} expected", in_words(node_->kind), in_words(kind)));
  }

  [[nodiscard]] std::string text() const {
    require(Kind::text);
    return node_->scalar;
  }
  [[nodiscard]] std::string text_or_empty() const { return known() ? text() : ""; }
  [[nodiscard]] std::optional<std::string> optional_text() const {
    return known() ? std::optional(text()) : std::nullopt;
  }

  template <class Number>
  [[nodiscard]] Number number() const {
    require(Kind::number);
    const std::string& s = node_->scalar;
    Number v{};
    const char* begin = s.data() + (s.starts_with('+') ? 1 : 0);
    const auto [end, error] = std::from_chars(begin, s.data() + s.size(), v);
    if (error == std::errc::result_out_of_range) fail("is " + s + ", beyond what can be held");
    if (error != std::errc{} || end != s.data() + s.size()) fail("is " + s + ", a whole number expected");
    return v;
  }
  [[nodiscard]] std::optional<double> optional_number() const {
    return known() ? std::optional(number<double>()) : std::nullopt;
  }
  [[nodiscard]] std::optional<double> optional_sigma() const {
    const auto v = optional_number();
    if (v && *v < 0) fail(fmt::format("is {}, a standard deviation is not negative", *v));
    return v;
  }

  void for_each(const std::function<void(const Field&)>& f) const {
    if (!known()) return;
    require(Kind::list);
    for (std::size_t i = 0; i < node_->children.size(); ++i)
      f({&node_->children[i].node, fmt::format("{}[{}]", path_, i), where_});
  }
  void for_each_key(const std::function<void(const std::string&, const Field&)>& f) const {
    if (!known()) return;
    require(Kind::object);
    for (const auto& [key, node] : node_->children) f(key, {&node, path_ + "." + key, where_});
  }
  [[nodiscard]] std::vector<double> numbers() const {  // null: a gap
    std::vector<double> out;
    for_each([&](const Field& f) {
      out.push_back(f.known() ? f.number<double>() : std::numeric_limits<double>::quiet_NaN());
    });
    return out;
  }
  [[nodiscard]] std::vector<std::string> texts() const {
    std::vector<std::string> out;
    for_each([&](const Field& f) { out.push_back(f.text()); });
    return out;
  }

 private:
  const Node* node_;
  std::string path_;
  const std::string& where_;
};

Verdict verdict(const Field& f) {
  const std::string s = f.text();
  for (const Verdict v : {Verdict::trusted, Verdict::weak, Verdict::refused})
    if (s == to_string(v)) return v;
  f.fail("is \"" + s + "\", trusted, weak or refused expected");
}

/// offset_ns where it is there; else offset_s to the nearest nanosecond.
std::optional<Duration> offset(const Field& f) {
  if (f["offset_ns"].known()) return Duration(f["offset_ns"].number<std::int64_t>());
  if (!f["offset_s"].known()) return std::nullopt;
  const long double ns = 1e9L * f["offset_s"].number<long double>();
  if (!(std::abs(ns) < 9.2e18L)) f["offset_s"].fail("is beyond 292 years");
  return Duration(static_cast<std::int64_t>(std::llroundl(ns)));
}

std::optional<double> from_ppm(std::optional<double> ppm) {
  return ppm ? std::optional(*ppm / 1e6) : std::nullopt;
}

std::optional<std::string> one_of(const Field& f, const std::vector<std::string>& allowed, const std::string& prefix) {
  auto s = f.optional_text();
  if (!s) return s;
  const std::string as_written = *s;
  if (s->starts_with(prefix)) s->erase(0, prefix.size());
  for (const std::string& a : allowed)
    if (*s == a) return s;
  f.fail("is \"" + as_written + "\", which is not known");
}

std::optional<Mat4> transform(const Field& f) {
  if (!f.known()) return std::nullopt;
  std::vector<std::vector<double>> rows;
  f.for_each([&](const Field& row) { rows.push_back(row.numbers()); });
  Mat4 T;
  if (rows.size() != 4) f.fail(fmt::format("has {} rows, 4 expected", rows.size()));
  for (std::size_t r = 0; r < 4; ++r) {
    if (rows[r].size() != 4) f.fail(fmt::format("has {} columns in row {}, 4 expected", rows[r].size(), r));
    for (std::size_t c = 0; c < 4; ++c) T(static_cast<int>(r), static_cast<int>(c)) = rows[r][c];
  }
  if (!T.allFinite()) f.fail("has a null");
  return T;
}

Series series(const Field& f) {
  Series s;
  s.name = f["name"].text_or_empty();
  s.unit = f["unit"].text_or_empty();
  s.values = f["values"].numbers();
  s.sigma = f["sigma"].numbers();
  s.kind = f["kind"].text_or_empty();
  if (!s.sigma.empty() && s.sigma.size() != s.values.size())
    f["sigma"].fail(fmt::format("has {} numbers, values has {}", s.sigma.size(), s.values.size()));
  return s;
}

Panel panel(const Field& f) {
  Panel p;
  p.name = f["name"].text_or_empty();
  p.kind = f["kind"].text_or_empty();
  p.title = f["title"].text_or_empty();
  p.caption = f["caption"].text_or_empty();
  p.x = series(f["x"]);
  f["y"].for_each([&](const Field& y) {
    p.y.push_back(series(y));
    if (p.y.back().values.size() != p.x.values.size())
      y.fail(fmt::format("has {} values, x has {}", p.y.back().values.size(), p.x.values.size()));
  });
  f["marks"].for_each([&](const Field& m) {
    p.marks.push_back({m["label"].text_or_empty(), m["x"].number<double>()});
  });
  return p;
}

Provenance provenance(const Field& f) {
  Provenance p;
  p.version = f["version"].text_or_empty();
  p.command = f["command"].text_or_empty();
  f["inputs"].for_each([&](const Field& i) { p.inputs.push_back({i["path"].text(), i["sha256"].text_or_empty()}); });
  if (f["seed"].known()) p.seed = f["seed"].number<std::uint64_t>();
  f["libraries"].for_each_key([&](const std::string& name, const Field& v) {
    p.libraries.push_back({name, v.text()});
  });
  return p;
}

std::vector<OffsetPiece> pieces(const Field& f) {
  std::vector<OffsetPiece> out;
  f.for_each([&](const Field& p) {
    OffsetPiece piece;
    piece.start = from_ns(p["start_ns"].number<std::int64_t>());
    piece.epoch = from_ns(p["epoch_ns"].number<std::int64_t>());
    if (!out.empty() && piece.start < out.back().start) p["start_ns"].fail("is before that of the piece before");
    const auto at_epoch = offset(p);
    if (!at_epoch) p["offset_ns"].fail("is missing");
    piece.offset = *at_epoch;
    piece.sigma_s = p["sigma_s"].optional_sigma().value_or(0);
    piece.drift = from_ppm(p["drift_ppm"].optional_number()).value_or(0);
    if (!(piece.drift > -1)) p["drift_ppm"].fail("runs time backwards");
    out.push_back(piece);
  });
  return out;
}

Estimate answer(const Field& f) {
  f.require(Kind::object);
  Estimate e;
  e.method = f["method"].text_or_empty();
  e.sensor = f["sensor"].text_or_empty();
  e.reference = f["reference"].text_or_empty();
  e.verdict = verdict(f["verdict"]);
  e.reasons = f["reasons"].texts();
  e.offset = offset(f);
  e.sigma_s = f["sigma_s"].optional_sigma();
  if (f["epoch_ns"].known()) e.epoch = from_ns(f["epoch_ns"].number<std::int64_t>());
  e.drift = from_ppm(f["drift_ppm"].optional_number());
  e.drift_sigma = from_ppm(f["drift_sigma_ppm"].optional_sigma());
  e.pieces = pieces(f["pieces"]);
  e.frame_instant = one_of(f["frame_instant"], {"start", "middle", "end"}, "exposure_");
  e.frame_row = one_of(f["frame_row"], {"first", "middle"}, "");
  e.line_delay_s = f["line_delay_s"].optional_number();
  e.line_delay_sigma_s = f["line_delay_sigma_s"].optional_sigma();
  e.T_reference_sensor = transform(f["T_reference_sensor"]);
  f["extras"].for_each_key([&](const std::string& name, const Field& x) {
    const auto value = x["value"].optional_number();
    e.extras.push_back({name, value.value_or(std::numeric_limits<double>::quiet_NaN()), x["sigma"].optional_sigma()});
  });
  e.notes = f["notes"].texts();
  if (e.verdict == Verdict::refused && e.offset) f["offset_s"].fail("is given, but the verdict is refused");
  if (e.verdict != Verdict::refused && !e.offset)
    f["offset_s"].fail(fmt::format("is not given, but the verdict is {}", to_string(e.verdict)));
  return e;
}

Estimate from_document(const Node& root, const std::string& where) {
  const Field f(&root, "", where);
  if (root.kind != Kind::object) f.fail(fmt::format("{} found, an object expected", in_words(root.kind)));
  if (const std::string schema = f["schema"].text(); schema != "takt/1")
    f["schema"].fail("is \"" + schema + "\", takt/1 expected");
  Estimate e = answer(f);
  f["estimates"].for_each([&](const Field& other) { e.estimates.push_back(answer(other)); });
  f["evidence"]["panels"].for_each([&](const Field& p) { e.evidence.panels.push_back(panel(p)); });
  e.provenance = provenance(f["provenance"]);
  return e;
}

}  // namespace

Estimate estimate_from_json(const std::string& text, const std::string& where) {
  return from_document(tree::from_json(text, where), where);
}

Estimate estimate_from_yaml(const std::string& text, const std::string& where) {
  return from_document(tree::from_yaml(text, where), where);
}

}  // namespace takt
