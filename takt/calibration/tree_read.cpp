// SPDX-License-Identifier: Apache-2.0
#include <fmt/core.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <charconv>
#include <nlohmann/json.hpp>

#include "takt/calibration/tree.h"
#include "takt/error.h"

namespace takt::tree {

namespace {

using Kind = Node::Kind;
using Json = nlohmann::json;

/// A result is five levels deep; a file that nests further is not one.
constexpr std::size_t max_depth = 32;

std::string at_byte(const std::string& source, const std::string& where, std::size_t byte) {
  const std::string_view before = std::string_view(source).substr(0, byte > 0 ? byte - 1 : 0);
  const auto line = std::count(before.begin(), before.end(), '\n') + 1;
  const auto newline = before.rfind('\n');
  const auto column = before.size() - (newline == before.npos ? 0 : newline + 1) + 1;
  return fmt::format("{}:{}:{}", where, line, column);
}

/// Builds the tree while nlohmann reads, because only so the digits of a number are seen as written.
class Builder : public nlohmann::json_sax<Json> {
 public:
  Builder(const std::string& source, const std::string& where) : source_(source), where_(where) {}

  Node root;

  bool null() override { return put({}); }
  bool boolean(bool v) override { return put({Kind::boolean, v ? "true" : "false", {}}); }
  bool number_integer(number_integer_t v) override { return put(integer(std::int64_t{v})); }
  bool number_unsigned(number_unsigned_t v) override { return put(integer(std::uint64_t{v})); }
  bool number_float(number_float_t, const string_t& as_written) override { return put(digits(as_written)); }
  bool string(string_t& v) override { return put(text(v)); }
  bool binary(binary_t&) override { return false; }
  bool start_object(std::size_t) override { return open(object()); }
  bool start_array(std::size_t) override { return open(list()); }
  bool end_object() override { return close(); }
  bool end_array() override { return close(); }
  bool key(string_t& v) override {
    key_ = v;
    return true;
  }
  bool parse_error(std::size_t byte, const std::string& last, const Json::exception&) override {
    const std::string found = last.empty() || byte > source_.size() ? "the end of the file" : "'" + last + "'";
    throw Error("this is not JSON: " + found + " is not expected here", at_byte(source_, where_, byte),
                "write it again with takt");
  }

 private:
  bool put(Node n) {
    if (open_.empty())
      root = std::move(n);
    else
      open_.back().second.add(open_.back().second.kind == Kind::object ? std::move(key_) : "", std::move(n));
    return true;
  }
  bool open(Node n) {
    if (open_.size() >= max_depth) throw Error("the document nests too deep", where_, "is it a result of takt?");
    open_.emplace_back(std::move(key_), std::move(n));
    return true;
  }
  bool close() {
    auto [key, node] = std::move(open_.back());
    open_.pop_back();
    key_ = std::move(key);
    return put(std::move(node));
  }

  const std::string& source_;
  const std::string& where_;
  std::string key_;
  std::vector<std::pair<std::string, Node>> open_;
};

bool is_number(const std::string& s) {
  double v = 0;
  const char* begin = s.data() + (s.starts_with('+') ? 1 : 0);
  const auto [end, error] = std::from_chars(begin, s.data() + s.size(), v);
  const bool digit = s.find_first_of("0123456789") != s.npos;  // not "inf", "nan"
  return digit && end == s.data() + s.size() && error != std::errc::invalid_argument;
}

Node yaml_scalar(const YAML::Node& n) {
  const std::string& s = n.Scalar();
  if (n.Tag() == "!") return text(s);  // it was quoted
  if (s == "true" || s == "false") return {Kind::boolean, s, {}};
  return is_number(s) ? digits(s) : text(s);
}

/// `budget` bounds the nodes by the length of the text, which only multiplying aliases exceed.
Node convert(const YAML::Node& n, const std::string& where, std::size_t& budget, std::size_t depth) {
  if (budget == 0 || depth > max_depth) throw Error("the document nests too deep", where, "is it a result of takt?");
  --budget;
  switch (n.Type()) {
    case YAML::NodeType::Scalar:
      return yaml_scalar(n);
    case YAML::NodeType::Sequence: {
      Node out = list();
      for (const auto& item : n) out.add(convert(item, where, budget, depth + 1));
      return out;
    }
    case YAML::NodeType::Map: {
      Node out = object();
      for (const auto& item : n) out.add(item.first.Scalar(), convert(item.second, where, budget, depth + 1));
      return out;
    }
    case YAML::NodeType::Null:
    case YAML::NodeType::Undefined:
      break;
  }
  return {};
}

}  // namespace

Node from_json(const std::string& source, const std::string& where) {
  Builder builder(source, where);
  Json::sax_parse(source, &builder);
  return std::move(builder.root);
}

Node from_yaml(const std::string& source, const std::string& where) {
  try {
    std::size_t budget = source.size() + 1;
    return convert(YAML::Load(source), where, budget, 0);
  } catch (const YAML::Exception& e) {
    throw Error("this is not YAML: " + e.msg, fmt::format("{}:{}:{}", where, e.mark.line + 1, e.mark.column + 1),
                "write it again with takt");
  }
}

}  // namespace takt::tree
