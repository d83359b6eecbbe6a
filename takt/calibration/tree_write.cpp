// SPDX-License-Identifier: Apache-2.0
#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "takt/calibration/tree.h"

namespace takt::tree {

namespace {

using Kind = Node::Kind;

/// Length of the valid UTF-8 sequence at s[i], or 0 [RFC 3629, section 4].
std::size_t sequence_length(std::string_view s, std::size_t i) {
  const auto byte = [&](std::size_t k) { return i + k < s.size() ? static_cast<unsigned char>(s[i + k]) : 0u; };
  const auto tail = [&](std::size_t k) { return (byte(k) & 0xC0u) == 0x80u; };
  const unsigned b0 = byte(0), b1 = byte(1);
  if (b0 < 0x80) return 1;
  if (b0 >= 0xC2 && b0 <= 0xDF) return tail(1) ? 2 : 0;
  if (b0 >= 0xE0 && b0 <= 0xEF) {
    const bool overlong = b0 == 0xE0 && b1 < 0xA0, surrogate = b0 == 0xED && b1 > 0x9F;
    return tail(1) && tail(2) && !overlong && !surrogate ? 3 : 0;
  }
  if (b0 >= 0xF0 && b0 <= 0xF4) {
    const bool overlong = b0 == 0xF0 && b1 < 0x90, beyond = b0 == 0xF4 && b1 > 0x8F;
    return tail(1) && tail(2) && tail(3) && !overlong && !beyond ? 4 : 0;
  }
  return 0;
}

/// Characters that YAML does not call printable, besides those that every quoted string escapes.
bool needs_code(std::string_view character) {
  static constexpr std::array<std::string_view, 4> hidden{"\x7f", "\xE2\x80\xA8", "\xE2\x80\xA9", "\xEF\xBB\xBF"};
  const bool c1 = character.size() == 2 && character[0] == '\xC2' && static_cast<unsigned char>(character[1]) < 0xA0;
  return c1 || std::find(hidden.begin(), hidden.end(), character) != hidden.end();
}

unsigned code_point(std::string_view character) {
  const auto low = [&](std::size_t k) { return static_cast<unsigned char>(character[k]) & 0x3Fu; };
  const unsigned b0 = static_cast<unsigned char>(character[0]);
  if (character.size() == 1) return b0;
  if (character.size() == 2) return (b0 & 0x1Fu) << 6 | low(1);
  return (b0 & 0x0Fu) << 12 | low(1) << 6 | low(2);
}

/// A double-quoted string that is right in JSON and in YAML.
std::string quoted(std::string_view s) {
  std::string out = "\"";
  for (std::size_t i = 0; i < s.size();) {
    const std::size_t n = sequence_length(s, i);
    const std::string_view character = s.substr(i, std::max<std::size_t>(n, 1));
    if (n == 0)
      out += "\xEF\xBF\xBD";
    else if (character == "\"" || character == "\\")
      out += "\\" + std::string(character);
    else if (character == "\n")
      out += "\\n";
    else if (character == "\t")
      out += "\\t";
    else if ((n == 1 && static_cast<unsigned char>(s[i]) < 0x20) || needs_code(character))
      out += fmt::format("\\u{:04x}", code_point(character));
    else
      out += character;
    i += character.size();
  }
  return out + "\"";
}

/// Lists of scalars, and lists of those, stay on one line: a matrix row, a series.
bool is_flat(const Node& n) {
  if (n.children.empty()) return true;
  return n.kind == Kind::list && std::all_of(n.children.begin(), n.children.end(), [](const auto& c) {
           return c.node.children.empty() && c.node.kind != Kind::text;
         });
}

std::string json_scalar(const Node& n) {
  switch (n.kind) {
    case Kind::text:
      return quoted(n.scalar);
    case Kind::boolean:
    case Kind::number:
      return n.scalar;
    case Kind::list:
      return "[]";
    case Kind::object:
      return "{}";
    case Kind::null:
      break;
  }
  return "null";
}

std::string on_one_line(const Node& n) {
  if (n.children.empty()) return json_scalar(n);
  std::string out = "[";
  for (const auto& [key, item] : n.children) out += (out.size() > 1 ? ", " : "") + json_scalar(item);
  return out + "]";
}

void write_json(const Node& n, std::string& out, const std::string& indent) {
  if (is_flat(n)) {
    out += on_one_line(n);
    return;
  }
  const std::string deeper = indent + "  ";
  out += n.kind == Kind::list ? "[" : "{";
  bool first = true;
  for (const auto& [key, item] : n.children) {
    out += (first ? "\n" : ",\n") + deeper;
    if (n.kind == Kind::object) out += quoted(key) + ": ";
    write_json(item, out, deeper);
    first = false;
  }
  out += "\n" + indent + (n.kind == Kind::list ? "]" : "}");
}

/// A word that no YAML reader takes for anything but a string.
bool is_plain_word(std::string_view s) {
  const auto letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; };
  const auto inner = [&](char c) { return letter(c) || (c >= '0' && c <= '9') || c == '-' || c == '.' || c == '/'; };
  if (s.empty() || !letter(s[0]) || !std::all_of(s.begin(), s.end(), inner)) return false;
  std::string lower(s);
  for (char& c : lower) c = static_cast<char>(c >= 'A' && c <= 'Z' ? c + 32 : c);
  static constexpr std::array<std::string_view, 9> taken{"y", "n", "yes", "no", "on", "off", "true", "false", "null"};
  return std::find(taken.begin(), taken.end(), lower) == taken.end();
}

std::string yaml_text(const std::string& s) {
  return is_plain_word(s) ? s : quoted(s);
}

void write_yaml(const Node& n, std::string& out, const std::string& indent);

/// What stands behind "key:" or "-".
void write_yaml_value(const Node& n, std::string& out, const std::string& indent, bool in_list) {
  if (is_flat(n)) {
    out += " " + (n.kind == Kind::text ? yaml_text(n.scalar) : on_one_line(n)) + "\n";
    return;
  }
  std::string block;
  write_yaml(n, block, indent + "  ");
  // "- key: value": the first line of a list's item stands behind its dash.
  out += in_list ? " " + block.substr(indent.size() + 2) : "\n" + block;
}

void write_yaml(const Node& n, std::string& out, const std::string& indent) {
  for (const auto& [key, item] : n.children) {
    const bool in_list = n.kind == Kind::list;
    out += indent + (in_list ? "-" : yaml_text(key) + ":");
    write_yaml_value(item, out, indent, in_list);
  }
}

}  // namespace

Node& Node::add(std::string key, Node value) {
  children.push_back({std::move(key), std::move(value)});
  return *this;
}

Node& Node::add(Node value) {
  return add({}, std::move(value));
}

const Node* Node::find(std::string_view key) const {
  const auto hit = std::find_if(children.begin(), children.end(), [&](const auto& c) { return c.key == key; });
  return kind == Kind::object && hit != children.end() ? &hit->node : nullptr;
}

Node object() {
  return {Kind::object, {}, {}};
}
Node list() {
  return {Kind::list, {}, {}};
}
Node text(std::string s) {
  return {Kind::text, std::move(s), {}};
}
Node digits(std::string decimal) {
  return {Kind::number, std::move(decimal), {}};
}
Node number(double v) {
  return std::isfinite(v) ? digits(fmt::format("{}", v)) : Node{};
}
Node number(std::optional<double> v) {
  return v ? number(*v) : Node{};
}
Node integer(std::int64_t v) {
  return digits(std::to_string(v));
}
Node integer(std::uint64_t v) {
  return digits(std::to_string(v));
}

std::string to_json(const Node& root) {
  std::string out;
  write_json(root, out, "");
  return out + "\n";
}

std::string to_yaml(const Node& root) {
  if (is_flat(root)) return on_one_line(root) + "\n";
  std::string out;
  write_yaml(root, out, "");
  return out;
}

}  // namespace takt::tree
