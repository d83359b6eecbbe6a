// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

/// What JSON and YAML have in common: the document between an object and its text.
namespace takt::tree {

struct Child;

struct Node {
  enum class Kind { null, boolean, number, text, list, object };

  Kind kind = Kind::null;
  std::string scalar;           ///< as written: "0.003177000" keeps its zeros, so an int64 of nanoseconds survives
  std::vector<Child> children;  ///< in order

  /// Appends to an object and to a list.
  Node& add(std::string key, Node value);
  Node& add(Node value);
  /// The first child of that name; nullptr where there is none.
  [[nodiscard]] const Node* find(std::string_view key) const;
};

struct Child {
  std::string key;  ///< empty in a list
  Node node;
};

[[nodiscard]] Node object();
[[nodiscard]] Node list();
[[nodiscard]] Node text(std::string s);
/// Shortest digits that read back as the same double; null for what is not finite.
[[nodiscard]] Node number(double v);
[[nodiscard]] Node number(std::optional<double> v);
[[nodiscard]] Node integer(std::int64_t v);
[[nodiscard]] Node integer(std::uint64_t v);
/// Digits already chosen by the caller.
[[nodiscard]] Node digits(std::string decimal);

/// Always valid UTF-8: broken bytes become U+FFFD. Ends with a newline.
[[nodiscard]] std::string to_json(const Node& root);
[[nodiscard]] std::string to_yaml(const Node& root);

/// Throws takt::Error naming `where` with line and column.
[[nodiscard]] Node from_json(const std::string& source, const std::string& where);
[[nodiscard]] Node from_yaml(const std::string& source, const std::string& where);

}  // namespace takt::tree
